#!/usr/bin/env python3
"""One fit of four recordings by several processes: how long it takes, and whether it gives the answer of one.

    python3 benchmarks/fits/joint_fit.py build/release/apps/pliant --processes 1 2 4 --repetitions 3

Makes four recordings of a bar that is pulled aside and let go, and fits them together by each number of processes in turns, so that a
machine that is busy slows all; the program is built with -DPLIANT_WITH_MPI=ON. Prints medians of wall time, of processor time of
all processes and of the busiest one. Exit code 1: an answer differs by a bit. Standard library only."""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

SCENE = """format = "scene/1"
name = "bar NUMBER"
seed = NUMBER
[object]
box = { size = [0.16, 0.04, 0.04], facet = 0.01 }
density = 200.0
[material]
youngs_modulus = 60000.0
poissons_ratio = 0.3
mass_damping = 0.5
stiffness_damping = 0.002
[world]
gravity = [0.0, -9.81, 0.0]
[simulation]
cell_size = 0.01
substeps = 10
[[fixed]]
box = { min = [-1, -1, -1], max = [-0.0399, 1, 1] }
[timing]
frame_rate = 60.0
frame_count = 40
start_frame = 1
[initial]
released = true
pulled = { at = [0.08, 0, 0], radius = 0.03, force = FORCE }
[cloud]
[[camera]]
name = "front"
width = 96
height = 64
eye = [0.02, 0.15, 0.35]
target = [0.02, 0.0, 0.0]
vertical_fov_deg = 35.0
sensor = { preset = "ideal", noise_base = 0.0005 }
[[camera]]
name = "back"
width = 96
height = 64
eye = [0.02, -0.15, -0.35]
target = [0.02, 0.0, 0.0]
vertical_fov_deg = 35.0
sensor = { preset = "ideal", noise_base = 0.0005 }
"""
FORCES = ["[0, 0.15, 0.05]", "[0, -0.15, 0.08]", "[0, 0.05, 0.15]", "[0, 0.12, -0.1]"]

# As one of mpirun's processes: runs the program, and notes the processor time that it took.
RANK = """import os, pathlib, resource, subprocess, sys
code = subprocess.call(sys.argv[2:])
used = resource.getrusage(resource.RUSAGE_CHILDREN)
pathlib.Path(sys.argv[1], os.environ["OMPI_COMM_WORLD_RANK"]).write_text(str(used.ru_utime + used.ru_stime))
sys.exit(code)"""


def fit(program, processes, captures, out, settings):
    """Wall time and the processor time of each process, in seconds, and the result but for its times."""
    used = pathlib.Path(tempfile.mkdtemp(dir=out.parent))
    root = ["--allow-run-as-root"] if os.geteuid() == 0 else []
    begin = time.monotonic()
    run = subprocess.run(["mpirun", "--oversubscribe", "--bind-to", "none", *root, "-n", str(processes), sys.executable, "-c", RANK, used,
                          program, "fit", *captures, "--out", out, "--threads", "1", *settings], capture_output=True, text=True)
    wall = time.monotonic() - begin
    if run.returncode not in (0, 3):
        raise SystemExit(f"the fit by {processes} ended with {run.returncode}:\n{run.stderr}")
    result = json.loads((out / "result.json").read_text())
    del result["time"]
    return wall, [float(file.read_text()) for file in used.iterdir()], result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path, help="pliant, built with MPI")
    parser.add_argument("--processes", type=int, nargs="+", default=[1, 2, 4], help="numbers of them (default 1 2 4)")
    parser.add_argument("--repetitions", type=int, default=3, help="fits by each number (default 3)")
    parser.add_argument("--set", action="append", default=["control_points=1"], metavar="KEY=VALUE", help="a choice of the fits")
    arguments = parser.parse_args()
    program = arguments.program.resolve()
    settings = [word for choice in arguments.set for word in ("--set", choice)]
    walls, processors, busiest, results = {}, {}, {}, []
    with tempfile.TemporaryDirectory(prefix="pliant.") as folder:
        work = pathlib.Path(folder)
        for number, force in enumerate(FORCES, 1):
            (work / "scene.toml").write_text(SCENE.replace("NUMBER", str(number)).replace("FORCE", force))
            subprocess.run([program, "synth", work / "scene.toml", "--out", work / f"bar{number}"], check=True, capture_output=True)
        captures = [work / f"bar{number}" for number in range(1, len(FORCES) + 1)]
        for _ in range(arguments.repetitions):
            for processes in arguments.processes:
                wall, each, result = fit(program, processes, captures, work / f"by{processes}", settings)
                walls.setdefault(processes, []).append(wall)
                processors.setdefault(processes, []).append(sum(each))
                busiest.setdefault(processes, []).append(max(each))
                results.append(result)
    print("| processes | wall [s] | processor, all [s] | processor, the busiest one [s] |")
    print("| --- | --- | --- | --- |")
    for processes in arguments.processes:
        numbers = [statistics.median(times[processes]) for times in (walls, processors, busiest)]
        print(f"| {processes} | " + " | ".join(f"{number:.1f}" for number in numbers) + " |")
    if any(result != results[0] for result in results):
        raise SystemExit("the answers differ")


if __name__ == "__main__":
    main()
