"""Motions: derivatives against central differences, arrays, and what is refused."""
import threading
import time

import numpy as np
import pytest

import pliant
from conftest import bar, thrown


def difference(along, derivative):
    """Smallest relative error of central differences over a range of steps."""
    return min(abs((along(h) - along(-h)) / (2 * h) - derivative) for h in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)) / abs(derivative)


def weighted(motion, weight, *arguments, **state):
    return float((weight * motion.run(*arguments, **state).positions).sum())


@pytest.mark.parametrize("make", [bar, thrown, lambda: bar(quadratic=True, integrator="newton"), lambda: bar(is_static=True, times=[0.0])],
                         ids=["held", "thrown", "Newton", "at rest"])
def test_gradient_by_each_parameter_matches_central_differences(make, rng):
    motion = make()
    run = motion.run()
    weight = rng.normal(size=run.positions.shape)
    gradient = motion.gradient(weight)
    assert set(gradient.values) == set(motion.names)
    checked = 0
    for name in motion.names:
        at = motion.slice(name)
        for i in range(at.start, at.stop):
            if gradient.theta[i] == 0.0:  # a plane's point may slide along it; dampings do not matter at rest
                continue
            scale = max(abs(motion.theta()[i]), 1e-2)

            def along(h):
                theta = motion.theta()
                theta[i] += h * scale
                return weighted(motion, weight, theta)

            assert difference(along, gradient.theta[i] * scale) < 2e-5, (name, i)
            checked += 1
    assert checked >= 6


@pytest.mark.parametrize("state", ["start", "start_velocities", "reference"])
@pytest.mark.parametrize("quadratic", [False, True])
def test_gradient_by_nodes_matches_central_differences(state, quadratic, rng):
    motion = bar(quadratic=quadratic)
    nodes = motion.body.nodes
    base = np.zeros_like(nodes) if state == "start_velocities" else nodes + 1e-4 * rng.normal(size=nodes.shape)
    weight = rng.normal(size=motion.run().positions.shape)
    gradient = getattr(motion.gradient(weight, **{state: base}), state)
    direction = rng.normal(size=nodes.shape) * (1.0 if state == "start_velocities" else 1e-2)
    # Steps are solved to 1e-8 of their forces.
    assert difference(lambda h: weighted(motion, weight, **{state: base + h * direction}), (gradient * direction).sum()) < 1e-5


def test_gradient_by_the_modulus_of_each_element(rng):
    body = pliant.Body.box([0, 0, 0], [0.2, 0.04, 0.04], [3, 1, 1], quadratic=False)
    count = len(body.elements)
    body = body.with_control_weights(np.eye(count))
    moduli = 2e4 * (1 + 0.3 * rng.random(count))
    motion = bar(body=body, youngs_modulus=moduli)
    weight = rng.normal(size=motion.run().positions.shape)
    gradient = motion.gradient(weight)
    names = [name for name in motion.names if name.startswith("youngs_modulus")]
    assert len(names) == count
    direction = moduli * rng.normal(size=count)

    def along(h):
        return weighted(motion, weight, dict(zip(names, moduli + h * direction)))

    assert difference(along, sum(gradient.values[name] * d for name, d in zip(names, direction))) < 1e-5


def test_a_cantilever_bends_as_beam_theory_says():
    length, edge, E, force = 0.4, 0.02, 1e7, 0.01
    body = pliant.Body.box([0, 0, 0], [length, edge, edge], [20, 2, 2])
    motion = pliant.Motion(body, times=[0.0], is_static=True, youngs_modulus=E, poissons_ratio=0.0, density=1.0, gravity=[0, 0, 0],
                           fixed=[pliant.Box(least=[-1, -1, -1], greatest=[1e-6, 1, 1])],
                           forces=[pliant.Force(at=[length, edge / 2, edge / 2], radius=edge, force=[0, -force, 0])])
    tip = body.nodes[:, 0] > length - 1e-9
    sag = (body.nodes - motion.run().positions[0])[tip, 1].mean()
    assert sag == pytest.approx(force * length**3 / (3 * E * edge**4 / 12), rel=0.03)


def test_a_thrown_body_falls_freely():
    motion = thrown(planes=(), mass_damping=0.0, frame_count=7)
    run = motion.run()
    fallen = run.positions.mean(axis=1) - run.positions[0].mean(axis=0)
    expected = np.outer(run.times, [0.3, -0.8, 0.1]) + 0.5 * np.outer(run.times**2, [0, -9.81, 0])
    # The scheme weighs the end of a step with 0.51: gravity acts by a hundredth of half a step too much.
    assert np.abs(fallen - expected).max() < 0.02 * 9.81 * run.times[-1] * motion.longest_step
    assert run.velocities.shape == run.positions.shape


def test_positions_by_hand_start_the_motion(rng):
    motion = thrown()
    start = motion.body.nodes + [0.0, 0.2, 0.0]
    assert np.array_equal(motion.run(start=start).positions[0], start)
    assert np.array_equal(motion.run().positions[0], motion.body.nodes), "and the next run starts where it did before"


def test_arrays_are_views_and_are_kept_alive():
    nodes = pliant.Body.box([0, 0, 0], [1, 1, 1], [1, 1, 1]).nodes
    assert nodes.base is not None and not nodes.flags.writeable
    assert nodes.max() == 1.0
    with pytest.raises(ValueError):
        nodes[0] = 0.0


@pytest.mark.parametrize("call, words", [
    (lambda m: m.run(start=np.zeros((3, 3))), r"start: expected an array of shape \(16, 3\), got \(3, 3\)"),
    (lambda m: m.run(start=np.full((16, 3), np.nan)), "start: number 0 of the array is not finite"),
    (lambda m: m.run({"modulus": 1.0}), "modulus: expected a parameter of the motion"),
    (lambda m: m.run({"gravity": [1.0, 2.0]}), r"gravity: expected an array of shape \(3,\), got \(2,\)"),
    (lambda m: m.run(np.zeros(3)), "theta: expected an array of shape"),
    (lambda m: m.run(frames=99), "frames: expected 1 to 4, got 99"),
    (lambda m: m.gradient(np.zeros((4, 2, 3))), r"cotangent: expected an array of shape \(n, 16, 3\), got \(4, 2, 3\)"),
    (lambda m: bar(law="rubber"), "law: expected neo_hookean or corotated, got 'rubber'"),
    (lambda m: bar(youngs_modulus=[1e4, 1e5]), r"youngs_modulus: expected an array of shape \(1,\), got \(2,\)"),
    (lambda m: bar(frame_count=None), "times: expected the time of each frame"),
    (lambda m: pliant.Body.of_tetrahedra(np.eye(4, 3), [[0, 1, 2, 9]]), "tetrahedra: element 0 names node 9, and there are 4"),
    (lambda m: pliant.Body.of_surface(np.zeros((3, 2)), [[0, 1, 2]]), r"vertices: expected an array of shape \(n, 3\), got \(3, 2\)"),
    (lambda m: m.body.with_control_weights(np.ones((18, 2))), "weights: those of an element sum to one"),
    (lambda m: thrown().run(reference=np.zeros((8, 3))), "element 0 has no positive volume"),
])
def test_what_cannot_be_used_is_named(call, words):
    with pytest.raises(ValueError, match=words):
        call(bar())


def test_a_motion_that_fails_says_why():
    with pytest.raises(pliant.SimulationError, match="."):
        bar(is_static=True, times=[0.0]).run({"youngs_modulus": -1.0})


def test_the_lock_is_released_and_calls_take_turns():
    motion = bar(frame_count=60, quadratic=True)
    expected = motion.run().positions
    ticks, done = [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.perf_counter())
            time.sleep(1e-3)

    results = []
    threads = [threading.Thread(target=lambda: results.append(motion.run().positions)) for _ in range(3)]
    ticker = threading.Thread(target=tick)
    ticker.start()
    begin = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    end = time.perf_counter()
    done.set()
    ticker.join()
    assert all(np.array_equal(r, expected) for r in results)
    assert sum(begin < t < end for t in ticks) >= 3, "another thread runs meanwhile"
