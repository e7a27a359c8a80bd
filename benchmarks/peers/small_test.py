#!/usr/bin/env python3
"""The peers' benchmark on tiny meshes: pliant alone, and each program that is importable.

Usage: small_test.py BUILD
  Ends with 77, and a line that says so, where numpy or pliant's package is not importable. Programs that are not are named and left out."""
import importlib
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(pathlib.Path(sys.argv[1]) / "python")]
SKIPPED = 77
# rms over nodes and times, of the size: what steps of 1/100 and of 1/200 s leave of a tiny bar's swing, and a torus's impact, with a factor to spare.
CLOSE = {"bar": 2e-3, "torus": 2e-2}

try:
    import numpy as np

    import bodies
    import pliant_peer
    from measured import Unreached
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(SKIPPED)


def rms(a, b):
    return float(np.sqrt(((a - b) ** 2).sum(axis=-1).mean()))


def check(what, holds):
    print(f"{'ok' if holds else 'FAILED'}: {what}", flush=True)
    if not holds:
        check.failed = True


check.failed = False


def pliant_alone(body):
    """Against much shorter steps neither a step nor half of it leaves much of an error; without contact, half of it leaves less."""
    size = float(np.ptp(body.nodes, axis=0).max())
    method = next(iter(pliant_peer.METHODS[body.name]))
    longest = body.times[0] / 10
    fine = pliant_peer.run(body, method, {"step": longest / 32}).positions
    errors = [rms(pliant_peer.run(body, method, {"step": step}).positions, fine) for step in (longest, longest / 2)]
    check(f"pliant, {body.name}: errors of {errors[0]:.2e} and {errors[1]:.2e} m",
          max(errors) < CLOSE[body.name] * size and (body.floor or errors[1] < errors[0]))
    check(f"pliant, {body.name}: it moves", rms(fine, body.nodes[None]) > 10 * errors[0])
    return size


def against_own_law(body, program, size):
    """A program beside the explicit reference of its own law and masses, and pliant's equilibrium beside that of its."""
    reference = importlib.import_module("reference")
    peer = importlib.import_module(f"{program}_peer")
    for method, about in peer.METHODS.get(body.name, {}).items():
        if "law" not in about:
            continue
        fine = reference.motion(body, about["law"], about["consistent"], body.times[0] / 1000)
        settings = {**peer.runs(body.name, method)[-1], "step": body.times[0] / 400}
        error = rms(peer.run(body, method, settings).positions, fine)
        check(f"{program}, {method}: {error:.2e} m from {about['law']}", error < CLOSE["bar"] * size)
    for method, about in getattr(peer, "EQUILIBRIA", {}).items():
        error = rms(peer.equilibrium(body, method, {"increments": 2}).positions[0], reference.equilibrium(body, about["law"]))
        check(f"{program}, {method} at rest: {error:.2e} m from {about['law']}", error < 1e-5 * size)


def main():
    with tempfile.TemporaryDirectory() as work:
        subprocess.run([sys.executable, HERE / "bodies.py", sys.argv[1], work, "--small"], check=True)
        sizes = {name: pliant_alone(bodies.load(pathlib.Path(work) / name)) for name in ("bar", "torus")}
        try:
            importlib.import_module("scipy")
        except ImportError as missing:
            print(f"skipped: the explicit references, and other programs: {missing}")
        else:
            for program in ("pliant", "newton", "mujoco", "calculix", "torch_fem"):
                try:
                    importlib.import_module(f"{program}_peer")
                except ImportError as missing:
                    print(f"skipped: {program}: {missing}")
                    continue
                against_own_law(bodies.load(pathlib.Path(work) / "bar"), program, sizes["bar"])
    sys.exit(check.failed)


if __name__ == "__main__":
    main()
