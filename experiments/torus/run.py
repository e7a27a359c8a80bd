#!/usr/bin/env python3
"""A bouncing torus (Weiss 2020, figure 8): Young's modulus from 20 random starts, everything else known.

Starts are log-uniform between a tenth and ten times the truth. A few of them are repeated with Rprop, the paper's
optimiser, for evaluations and time side by side."""
import pathlib
import random
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

STARTS, RPROP_STARTS, SEED = 20, 2, 1
KNOWN = {"poissons_ratio": 0.3, "mass_damping": 0.1, "stiffness_damping": 0.004}
CELLS = 15.4  # about the paper's 690 elements


def choices(start, optimiser):
    chosen = {"cells": CELLS, "youngs_modulus": f"{start:.6g}", "optimiser": optimiser}
    if optimiser == "rprop":
        chosen["max_iterations"] = 40
    for name, value in KNOWN.items():
        chosen[name] = value
        chosen[name + ".estimate"] = False
    return chosen


def one(arguments, capture, name, start, optimiser, truth):
    figures = common.fit(arguments.program, capture, arguments.work / name, choices(start, optimiser), threads=1)
    result = figures["result"]
    found = result["parameters"]["youngs_modulus"]
    row = {"start": common.number(start), "youngs_modulus": common.number(found["value"]), "std": common.number(found["std"], 2),
           "relative_error": common.number(common.relative_error(found["value"], truth), 3),
           "surface_rms": common.number(result["error"]["surface_rms"], 3), "converged": figures["exit_code"] == 0,
           "iterations": figures["iterations"], "evaluations": sum(figures["iterations"].values()),
           "forward_steps": result["time"]["forward_steps"], "wall_seconds": figures["wall_seconds"]}
    print(f"{optimiser:20} {row['start']:8.5g} -> {row['youngs_modulus']:8.5g} ({100 * row['relative_error']:+.1f} %) "
          f"{row['evaluations']} iterations, {row['wall_seconds']} s", flush=True)
    return row


def main():
    arguments = common.arguments(__doc__)
    capture = arguments.work / "capture"
    common.run(arguments.program, "synth", HERE / "scene.toml", "--out", capture)
    truth = common.read(capture / "truth.json")["parameters"]["youngs_modulus"]["value"]
    generator = random.Random(SEED)
    starts = [common.log_uniform(generator, 0.1 * truth, 10.0 * truth) for _ in range(STARTS)]
    rows = [one(arguments, capture, f"start-{i}", start, "levenberg_marquardt", truth) for i, start in enumerate(starts)]
    rprop = [one(arguments, capture, f"rprop-{i}", start, "rprop", truth) for i, start in enumerate(starts[:RPROP_STARTS])]
    head = (arguments.work / "start-0/model.vtu").read_bytes()[:4000].decode(errors="replace")
    errors = [abs(row["relative_error"]) for row in rows]
    timing = common.read(arguments.work / "start-0/result.json")["time"]
    common.write_results(__file__, {
        "truth": truth, "elements": int(re.search(r'NumberOfCells="(\d+)"', head)[1]),
        "nodes": int(re.search(r'NumberOfPoints="(\d+)"', head)[1]), "threads": 1,
        "within_5_percent": sum(error < 0.05 for error in errors), "starts": STARTS,
        "mean_error": common.number(sum(errors) / len(errors), 3), "worst_error": max(errors),
        "median_wall_seconds": common.median([row["wall_seconds"] for row in rows]),
        "ms_per_forward_step": common.number(timing["ms_per_forward_step"], 3),
        "ms_per_adjoint_step": common.number(timing["ms_per_adjoint_step"], 3),
        "levenberg_marquardt": rows, "rprop": rprop})


if __name__ == "__main__":
    main()
