"""CalculiX, by the decks that `pliant export --to calculix --linear` writes: the bar's sag of large motions, and its swing (*DYNAMIC, implicit, alpha
method with the default alpha of -0.05, fixed steps). Time is that of the whole program, its reading of the deck and writing of results with it."""
import os
import shutil
import subprocess

import numpy as np

from measured import Clock, Outcome, Unreached

if not shutil.which("ccx"):
    raise ImportError("ccx is not installed: apt-get install calculix-ccx")

METHODS = {"bar": {"alpha method": {"law": "saint_venant_kirchhoff", "consistent": True}}}
EQUILIBRIA = {"large motions": {"law": "saint_venant_kirchhoff"}}
STEPS = {"bar": (0.02, 0.01)}
DYNAMIC = """*INCLUDE, INPUT=mesh.inp
*STEP, NLGEOM, INC=1000000, AMPLITUDE=STEP
*DYNAMIC, DIRECT
{step!r}, {end!r}
*DLOAD
OBJECT, GRAV, 9.81, 0, -1, 0
*NODE PRINT, NSET=ALL, FREQUENCY={every}
U
*END STEP
"""


def version():
    return subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout.split()[-1]


def runs(body, method):
    return [{"step": step} for step in STEPS[body]]


def solved(body, deck):
    """Displacements that a deck prints, times x nodes x 3 [m], and the clock of the whole program."""
    folder = body.folder / "calculix"
    threads = os.environ.get("OMP_NUM_THREADS", "1")
    with Clock(children=True) as clock:
        done = subprocess.run(["ccx", deck], cwd=folder, capture_output=True, text=True, check=False, env={**os.environ, "CCX_NPROC_EQUATION_SOLVER": threads,
                                                                                                      "CCX_NPROC_STIFFNESS": threads, "CCX_NPROC_RESULTS": threads})
    if done.returncode or "*ERROR" in done.stdout:
        last = [line.strip() for line in done.stdout.splitlines() if line.strip()][-1:]
        raise Unreached(f"ccx ended with {done.returncode}: {' '.join(last)}")
    rows = [line.split() for line in (folder / f"{deck}.dat").read_text().splitlines()]
    numbers = np.array([[float(w) for w in row[1:]] for row in rows if len(row) == 4 and row[0].isdigit()])
    iterations = sum(line.strip().startswith("iteration") for line in done.stdout.splitlines())
    return numbers.reshape(-1, len(body.nodes), 3), clock, iterations


def run(body, method, settings):
    every = body.steps_between(settings["step"])
    (body.folder / "calculix/swing.inp").write_text(DYNAMIC.format(step=settings["step"], end=float(body.times[-1]), every=every))
    moved, clock, _ = solved(body, "swing")
    if len(moved) != len(body.times):
        raise Unreached(f"ccx printed {len(moved)} of {len(body.times)} times")
    return Outcome(body.nodes + moved, every * len(body.times), clock.processor_s, clock.wall_s)


def equilibrium(body, method, _):
    moved, clock, iterations = solved(body, "sag_large")
    return Outcome(body.nodes + moved[-1:], iterations, clock.processor_s, clock.wall_s)
