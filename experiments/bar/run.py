#!/usr/bin/env python3
"""Moduli and dampings of a synthetic bar (Wang 2015, figure 9 and table 1), by Levenberg-Marquardt and by Nelder-Mead.

Runs whose output is in the work folder already are not run again. About 20 minutes on two cores."""
import os
import pathlib
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

MODULI = {1: [6.8e5], 2: [3e5, 1e6], 8: [5e5, 2e5, 8e5, 3e5, 1e6, 1.5e5, 6e5, 2.5e5]}
NOISE, BUDGET = 0.01, 180


def cases():
    """(name, controls, choices) of each run."""
    for count in MODULI:
        yield f"clean-{count}", count, {}
    yield "finer_truth-8", 8, {"truth_steps": 2}
    for count in MODULI:
        yield f"noise-{count}", count, {"noise": NOISE}
    yield "homogeneous-8", 8, {"moduli": MODULI[1][0]}
    for count in MODULI:
        yield f"nelder_mead-{count}", count, {"optimiser": "nelder_mead", "budget": BUDGET}


def run(program, out, choices):
    if not out.exists():
        with open(out.with_suffix(".part"), "w") as file, open(out.with_suffix(".log"), "w") as log:
            subprocess.run([program, *(f"{key}={value}" for key, value in choices.items())], check=True, stdout=file, stderr=log)
        out.with_suffix(".part").rename(out)
    return common.read(out)


def errors(figures):
    """Worst relative errors of the moduli and of each damping, and where the worst modulus stands."""
    error = {p["name"]: p["relative_error"] for p in figures["parameters"]}
    moduli = {name: e for name, e in error.items() if name.startswith("youngs_modulus")}
    worst = max(moduli, key=lambda name: abs(moduli[name]))
    return {"worst_modulus": moduli[worst], "worst_at": int(worst.split("@")[1]), "mass_damping": error["mass_damping"],
            "stiffness_damping": error["stiffness_damping"]}


def main():
    arguments = common.arguments(__doc__)
    program = arguments.program.parent.parent / "experiments/pliant_bar"
    begin = time.monotonic()
    rows, first = {}, None
    for name, count, choices in cases():
        load = os.getloadavg()[0]
        figures = run(program, arguments.work / f"{name}.json",
                      {"moduli": ",".join(f"{E:g}" for E in MODULI[count]), "controls": count, **choices})
        first = first or figures
        rows[name] = {"controls": count, "choices": choices, "errors": errors(figures), "load_at_start": round(load, 1),
                      **{key: figures[key] for key in ("start", "parameters", "wall_seconds", "processor_seconds", "iterations",
                                                       "evaluations", "forward_steps", "converged", "reason", "start_cost", "cost",
                                                       "track_rms", "costs")}}
        print(name, rows[name]["errors"], round(figures["wall_seconds"]), "s", flush=True)
    common.write_results(__file__, {
        "nodes": first["nodes"], "elements": first["elements"], "motions": first["motions"], "settings": first["choices"],
        "costs": first["costs"], "noise": NOISE, "nelder_mead_budget_seconds": BUDGET,
        "whole_seconds": round(time.monotonic() - begin), "runs": rows})


if __name__ == "__main__":
    main()
