"""Commands of the program that have no function of their own, run beside the interpreter."""
import dataclasses
import json
import pathlib
import subprocess
import sys
import tempfile

from ._errors import InputError


def command(*words, **choices):
    """Runs a command of the program, as a shell would: `pliant.command("check", "recordings/bear", out="look")`.

    Choices become options: `plan=FILE` is `--plan FILE`, `linear=True` is `--linear`.

    :returns: what it says
    :raises InputError: where it refuses its input, with what it says
    :raises RuntimeError: where it fails otherwise
    """
    told = [str(word) for word in words]
    for name, value in choices.items():
        if value is not False and value is not None:
            told += ["--" + name.replace("_", "-")] + ([] if value is True else [str(value)])
    done = subprocess.run([sys.executable, "-m", "pliant", *told], capture_output=True, text=True)
    if done.returncode == 2:
        raise InputError(done.stderr.strip(), done.stderr.strip().splitlines())
    if done.returncode != 0:
        raise RuntimeError(f"pliant {' '.join(told)} ended with exit code {done.returncode}: {done.stderr.strip()}")
    return done.stdout


@dataclasses.dataclass(frozen=True)
class Planned:
    """What a recording would tell of a parameter."""

    name: str
    value: float
    interval_90: tuple
    """of an estimate by such a recording"""
    largest_cause: str
    """of the interval: "noise", "mesh", ... """


def plan(scene):
    """What a recording would tell, before it is made (`pliant check --plan`).

    :param scene: file of a scene (docs/scene.md): the object, a guess at its material, what happens, and the sensors
    :returns: name of each parameter to `Planned`
    """
    with tempfile.TemporaryDirectory(prefix="pliant.") as folder:
        command("check", plan=scene, out=folder)
        found = json.loads((pathlib.Path(folder) / "plan.json").read_text())["parameters"]
    return {name: Planned(name, p["value"], tuple(p["interval_90"]), p.get("largest_cause", "")) for name, p in found.items()}


def synth(scene, out):
    """Simulates a scene and makes a recording of it whose truth is known (`pliant synth`).

    :param scene: file of a scene (docs/scene.md)
    :param out: folder for the recording
    """
    command("synth", scene, out=out)
