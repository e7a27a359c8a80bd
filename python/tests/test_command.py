"""The command `pliant` of the package, and what the package says of itself."""
import inspect
import os
import pathlib
import signal
import subprocess
import sys
import time

import pytest

import pliant
from conftest import QUICK, RING


def run(*words):
    return subprocess.run([sys.executable, "-m", "pliant", *map(str, words)], capture_output=True, text=True)


def test_it_is_the_program(program):
    ours, theirs = run("--version"), subprocess.run([program, "--version"], capture_output=True, text=True)
    assert (ours.stdout, ours.returncode) == (theirs.stdout, theirs.returncode)
    assert pliant.__version__ in ours.stdout
    checked = run("check", RING)
    assert checked.returncode == 0 and "ring" in checked.stdout
    wrong = run("check", "nowhere")
    assert wrong.returncode == 2 and "nowhere" in wrong.stderr


def test_commands_are_run_from_python(tmp_path):
    scene = RING.parent / "synthetic-ring/scene.toml"
    text = scene.read_text().replace("frame_count = 48", "frame_count = 20").replace("width = 320", "width = 80").replace("height = 240", "height = 60")
    (tmp_path / "scene.toml").write_text(text)
    pliant.synth(tmp_path / "scene.toml", tmp_path / "made")
    assert pliant.Capture(tmp_path / "made").frame_count == 20
    planned = pliant.plan(tmp_path / "scene.toml")["youngs_modulus"]
    assert planned.interval_90[0] < 4000 < planned.interval_90[1] and planned.largest_cause
    with pytest.raises(pliant.InputError, match="nowhere"):
        pliant.command("check", "nowhere")


def test_ctrl_c_ends_a_fit_of_a_script_with_its_state(tmp_path):
    script = f"import pliant; pliant.fit({str(RING)!r}, {str(tmp_path)!r}, settings={QUICK!r}, on_event=lambda e, l: print(l, flush=True))"
    child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ)
    child.stdout.readline()
    child.send_signal(signal.SIGINT)
    begin = time.monotonic()
    _, errors = child.communicate(timeout=120)
    assert "KeyboardInterrupt" in errors, errors
    assert (tmp_path / "state.json").exists()
    assert time.monotonic() - begin < 60


def test_all_that_is_public_is_documented_and_takes_choices_by_keyword():
    for name in pliant.__all__:
        thing = getattr(pliant, name)
        assert inspect.getdoc(thing), name
        if inspect.isclass(thing):
            for member, value in vars(thing).items():
                if inspect.isfunction(value) and not member.startswith("_"):
                    assert inspect.getdoc(value), f"{name}.{member}"


def test_stubs_name_what_the_extension_has():
    from pliant import _pliant
    stub = (pathlib.Path(pliant.__file__).resolve().parent / "_pliant.pyi").read_text()
    for name in dir(_pliant):
        if not name.startswith("_"):
            assert f"class {name}" in stub or f"def {name}(" in stub or f"{name}:" in stub, name
    for member in dir(_pliant.Body):
        if not member.startswith("_"):
            assert f"def {member}(" in stub, f"Body.{member}"
