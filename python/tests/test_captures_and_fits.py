"""Captures, fits, results and models, on the example."""
import json

import numpy as np
import pytest

import pliant
from conftest import QUICK, RING


def test_a_capture_is_read():
    capture = pliant.Capture(RING)
    assert capture.frame_count == len(capture.times) and capture.cameras == ["front"]
    assert capture.vertices.shape[1] == 3 and capture.triangles.max() < len(capture.vertices)
    frames = capture.observed(points_per_frame=300)
    assert len(frames) > 10 and all(0 < len(f.points) <= 300 and len(f.noise) == len(f.points) for f in frames)
    extent = np.ptp(capture.vertices, axis=0).max()
    assert all(np.ptp(f.points, axis=0).max() < 1.5 * extent for f in frames), "of the object alone"


def test_a_wrong_capture_names_file_and_advice(tmp_path):
    (tmp_path / "capture.toml").write_text('format = "capture/1"\nnonsense = 1\n')
    with pytest.raises(pliant.InputError, match="capture.toml:2") as error:
        pliant.Capture(tmp_path)
    assert isinstance(error.value, ValueError) and error.value.problems


def test_a_fit_leaves_its_folder_and_tells_its_steps(ring_fit):
    result, lines, events = ring_fit
    for name in ("result.json", "model.toml", "report.html", "fit.toml", "log.txt"):
        assert (result.folder / name).exists(), name
    assert not (result.folder / "state.json").exists()
    E = result["youngs_modulus"]
    assert E.estimated and E.std > 0 and E.interval_90[0] < E.value < E.interval_90[1] and E.unit == "Pa"
    assert result.verdict in ("explained", "unexplained", "undetermined")
    assert lines[0].startswith("pliant ") and events and events[-1]["youngs_modulus"] > 0
    assert "youngs_modulus" in repr(result) and "<table>" in result._repr_html_()
    with pytest.raises(KeyError, match="there are"):
        result["modulus"]


def test_an_exception_of_the_caller_ends_the_fit_with_its_state_and_it_resumes(tmp_path, ring_fit):
    def stop(event, line):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        pliant.fit(RING, tmp_path, settings=QUICK, on_event=stop)
    assert (tmp_path / "state.json").exists()
    resumed = pliant.fit(RING, tmp_path, settings=QUICK, resume=True)
    assert resumed["youngs_modulus"].value == pytest.approx(ring_fit[0]["youngs_modulus"].value, rel=1e-9)


def test_a_choice_that_there_is_not_is_refused(tmp_path):
    with pytest.raises(pliant.InputError, match="cels"):
        pliant.fit(RING, tmp_path, settings={"cels": 6})
    assert any(name == "cells" for name, _, _ in pliant.fit_keys())


def test_samples_have_the_stated_median_and_interval(ring_fit):
    result = ring_fit[0]
    drawn = result.samples(4000)
    E = result["youngs_modulus"]
    assert np.median(drawn["youngs_modulus"]) == pytest.approx(E.value, rel=0.02)
    inside = (drawn["youngs_modulus"] > E.interval_90[0]) & (drawn["youngs_modulus"] < E.interval_90[1])
    assert inside.mean() == pytest.approx(0.9, abs=0.02)
    assert np.array_equal(drawn["youngs_modulus"], result.samples(4000)["youngs_modulus"])
    with pytest.raises(ValueError, match="count"):
        result.samples(0)


def test_a_model_moves_as_the_fit_left_it(ring_fit, tmp_path):
    result = ring_fit[0]
    model = result.model
    assert model.youngs_modulus == pytest.approx(result["youngs_modulus"].value, rel=1e-6)
    motion = model.motion()
    run = motion.run()
    assert run.positions.shape == (len(motion.times), len(motion.body.nodes), 3)
    surface = run.at(model.vertices)
    assert np.abs(surface[0] - surface[0].mean(axis=0) - (model.vertices - model.vertices.mean(axis=0))).max() < 1e-6, "not deformed yet"
    lowest = surface[:, :, 1].min(axis=1)
    assert lowest[0] > 0.05 and -0.02 < lowest.min() < 0.01, "it falls on the floor, and not through it"
    gradient = motion.gradient(np.ones_like(run.positions))
    h = 1e-4 * model.youngs_modulus
    sums = [motion.run({"youngs_modulus": model.youngs_modulus + s * h}).positions.sum() for s in (1, -1)]
    assert gradient.values["youngs_modulus"] == pytest.approx((sums[0] - sums[1]) / (2 * h), rel=1e-3)

    softer = model.with_values(youngs_modulus=0.5 * model.youngs_modulus)
    assert softer.motion().values["youngs_modulus"] == pytest.approx(0.5 * model.youngs_modulus)
    softer.save(tmp_path / "softer")
    assert pliant.Model(tmp_path / "softer").youngs_modulus == pytest.approx(softer.youngs_modulus)
    with pytest.raises(ValueError, match="poissons_ratio"):
        model.with_values(poissons_ratio=0.7)


def test_a_model_in_a_situation(ring_fit, tmp_path):
    file = tmp_path / "situation.toml"
    file.write_text('format = "situation/1"\nduration = 0.2\n')
    motion = ring_fit[0].model.motion(file)
    assert motion.times[-1] == pytest.approx(0.2, abs=0.05)
    ring_fit[0].model.simulate(tmp_path / "out", situation=file)
    assert (tmp_path / "out/trajectory.pvd").exists()


def test_a_model_is_exported(ring_fit, tmp_path):
    assert "mujoco" in pliant.export_formats()
    told = ring_fit[0].model.export("calculix", tmp_path)
    assert all((tmp_path / file).exists() for file in told["files"])
    assert told["model"]["frequencies"][0] == pytest.approx(told["exported"]["frequencies"][0], rel=1e-6)
    coarse = ring_fit[0].model.export("mujoco", tmp_path / "coarse", cells=8)
    assert coarse["exported"]["frequencies"][0] == pytest.approx(coarse["model"]["frequencies"][0], rel=1e-6)
    with pytest.raises(ValueError, match="no elements"):
        ring_fit[0].model.export("gltf", tmp_path / "surface", cells=8)
    with pytest.raises(pliant.InputError, match="blender"):
        ring_fit[0].model.export("blender", tmp_path)


def test_a_result_that_is_not_there_or_broken_is_named(tmp_path):
    with pytest.raises(ValueError, match="result.json"):
        pliant.Result(tmp_path)
    (tmp_path / "result.json").write_text('{"parameters":')
    with pytest.raises(ValueError, match="result.json:1"):
        pliant.Result(tmp_path)


def test_the_result_is_that_of_the_command(ring_fit):
    text = json.loads((ring_fit[0].folder / "result.json").read_text())
    assert text["format"] == "result/1" and text["software"]["version"] == pliant.__version__
