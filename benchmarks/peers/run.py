#!/usr/bin/env python3
"""pliant beside other programs on the same bar and torus, on one machine: time of a step, and error against fine references.

    apt-get install calculix-ccx python3-venv
    python3 benchmarks/peers/run.py build/release [--work DIR] [--only PROGRAM ...] [--sections SECTION ...]

Standard library; what it measures goes into DIR/venv by pip (requirements.txt; torch-fem, with PyTorch 6 GB, by a file of its own). The build holds
pliant's Python package, for the same version of Python. What does not install or does not converge is told with its reason. What is not in --only
keeps the figures that it has in results.json."""
import argparse
import datetime
import json
import os
import pathlib
import platform
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
RESULTS = HERE / "results.json"
PROGRAMS = {"pliant": (1,), "newton": (1,), "mujoco": (1,), "calculix": (1, 2), "torch_fem": (1, 2)}  # and the cores that each can use
BODIES = ("bar", "torus")
SECTIONS = (*BODIES, "at rest", "laws", "first")
AT_REST = ("pliant", "calculix", "torch_fem")
MOVE = {"bar": ("pliant", "newton", "mujoco", "calculix"), "torus": ("pliant", "newton", "mujoco")}
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def installed(work, programs):
    """A virtual environment's Python, and why a requirements file did not install, by program."""
    python, reasons = work / "venv/bin/python", {}
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", work / "venv"], check=True)
    for file, of in (("requirements.txt", "newton mujoco"), ("requirements-torch-fem.txt", "torch_fem")):
        if not set(of.split()) & set(programs) and of != "newton mujoco":
            continue
        done = subprocess.run([python, "-m", "pip", "install", "-q", "-r", HERE / file], capture_output=True, text=True, check=False)
        if done.returncode:
            reasons |= dict.fromkeys(of.split(), f"does not install: {done.stderr.strip().splitlines()[-1]}")
    return python, reasons


def environment(build, cores):
    """Of a worker that may use so many cores."""
    kept = {key: value for key, value in os.environ.items() if not key.startswith("OPENBLAS_")}  # what chooses numpy's kernels is its own
    return {**kept, **dict.fromkeys(THREADS, str(cores)), "PYTHONPATH": str(build / "python"), "PYTHONDONTWRITEBYTECODE": "1"}


def worker(python, build, program, folder, cores, *options, **variables):
    """What worker.py measures of a program on so many cores, or why not."""
    pinned = ["taskset", "-c", ",".join(map(str, sorted(os.sched_getaffinity(0))[:cores]))] if cores < len(os.sched_getaffinity(0)) else []
    done = subprocess.run([*pinned, python, HERE / "worker.py", program, folder, *options], capture_output=True, text=True, check=False, cwd=folder,
                          env={**environment(build, cores), **variables})
    try:
        return {**json.loads(done.stdout.splitlines()[-1]), "load": os.getloadavg()[0]}
    except (json.JSONDecodeError, IndexError):
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        return {"reason": " ".join(lines[-2:]) if lines else f"ended with {done.returncode}"}


def machine():
    model = re.search(r"model name\s*:\s*(.*)", pathlib.Path("/proc/cpuinfo").read_text())
    return {"processor": model[1] if model else platform.processor(), "cores": os.cpu_count(), "python": platform.python_version(),
            "date": datetime.date.today().isoformat()}


def rounded(value):
    if isinstance(value, float):
        return float(f"{value:.6g}")
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    return [rounded(item) for item in value] if isinstance(value, list) else value


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path, help="a build folder of pliant's, with its Python package")
    parser.add_argument("--work", type=pathlib.Path, help="folder for the virtual environment, meshes and references; a temporary one where left out")
    parser.add_argument("--only", nargs="+", default=list(PROGRAMS), choices=PROGRAMS)
    parser.add_argument("--sections", nargs="+", default=list(SECTIONS), choices=SECTIONS, help="of results.json")
    given = parser.parse_args()
    build, work = given.build.resolve(), (given.work or pathlib.Path(tempfile.mkdtemp(prefix="pliant."))).resolve()
    work.mkdir(parents=True, exist_ok=True)
    python, reasons = installed(work, given.only)
    if not all((work / body / "body.npz").exists() for body in BODIES):
        subprocess.run([python, HERE / "bodies.py", build, work], check=True, env=environment(build, 1))
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    results["machine"] = machine()

    def keep(section, program, cores, out):
        results.setdefault(section, {}).setdefault(program, {})[cores] = rounded(out)
        RESULTS.write_text(json.dumps(results, indent=1) + "\n")
        print(section, program, cores, out.get("reason", f"{len(out.get('runs', []))} runs"), flush=True)

    for section, programs in {**MOVE, "at rest": AT_REST}.items():
        for program in programs:
            if section not in given.sections or program not in given.only:
                continue
            for cores in PROGRAMS[program]:
                body, options = ("bar", ["--equilibria"]) if section == "at rest" else (section, [])
                keep(section, program, str(cores), {"reason": reasons[program]} if program in reasons
                     else worker(python, build, program, work / body, cores, *options))
    for body, programs in MOVE.items():
        for program in programs:
            if "laws" in given.sections and program in given.only and program not in reasons:
                keep("laws", program, body, worker(python, build, program, work / body, 1, "--laws"))
    if "first" in given.sections and "newton" in given.only and "newton" not in reasons:  # the one that compiles: into a cache that is empty
        with tempfile.TemporaryDirectory(prefix="pliant.") as cache:
            keep("first", "newton", "1", worker(python, build, "newton", work / "bar", 1, "--first", WARP_CACHE_PATH=cache))


if __name__ == "__main__":
    main()
