#!/usr/bin/env python3
"""Moduli and dampings of a synthetic bar (Wang 2015, figures 6, 7 and 9 and table 1), by Levenberg-Marquardt and by Nelder-Mead.

Runs whose output is in the work folder already are not run again. About 40 minutes on two shared cores."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common
import tracks

MODULI = {1: [6.8e5], 2: [3e5, 1e6], 8: [5e5, 2e5, 8e5, 3e5, 1e6, 1.5e5, 6e5, 2.5e5]}
# Wang 2015, table 1: three decades, at control points drawn at random; the bar is let go bent, twisted and stretched.
PAPER = [2e5, 1e6, 1e4, 6.8e5, 2e6, 7e4, 1e7, 3e4]
FRAMES, FIRST, NOISE, BUDGET = 250, 50, 0.01, 180
HORIZONS = f"{FIRST},{FRAMES}"
SIMPLEX = {"optimiser": "nelder_mead", "budget": BUDGET, "horizon": FIRST}
LANDSCAPE = {"task": "landscape", "controls": 2, "frames": 15, "horizon": 15, "samples": 15, "from": 1e4, "to": 1e7}


def cases():
    """(name, controls, choices) of each fit. The simplex compares the first frames alone: within its budget it would evaluate all of them a few times only."""
    yield "clean-8", 8, {}
    for count in (2, 1):
        yield f"clean-{count}", count, {"curve_samples": 50}
    for count in (8, 2, 1):
        yield f"noise-{count}", count, {"noise": NOISE}
    for count in (1, 2, 8):
        yield f"nelder_mead-{count}", count, SIMPLEX
    yield "homogeneous-8", 8, {"moduli": MODULI[1][0], "horizon": FIRST, "solver": "cholmod"}
    for seed in (1, 2):
        for kind, more in (("paper", {}), ("paper_noise", {"noise": NOISE})):
            yield f"{kind}_{seed}-8", 8, {"moduli": tracks.moduli(PAPER), "seed": seed, "starts": "deformed", **more}
    yield "paper_even_1-8", 8, {"moduli": MODULI[1][0], "seed": 1, "starts": "deformed", "noise": NOISE}
    yield "finer_truth-2", 2, {"truth_steps": 2, "horizon": FIRST, "solver": "cholmod"}


def main():
    arguments = common.arguments(__doc__, only={"metavar": "NAME", "help": "of the fits, those whose name begins so; all else stays as it is stored"})
    file = HERE / "results.json"
    stored = common.read(file) if file.exists() and arguments.only else {}
    rows = stored.get("runs", {})
    for name, count, choices in cases():
        if name.startswith(arguments.only or ""):
            rows[name] = tracks.fit(arguments, name, {"moduli": tracks.moduli(MODULI[count]), "controls": count, "frames": FRAMES,
                                                      "horizon": HORIZONS, "solver": "automatic", **choices})
            common.write_results(__file__, {**{key: value for key, value in stored.items() if key != "machine"}, "runs": rows})
    if arguments.only:
        return
    landscape = tracks.run(tracks.program(arguments), arguments.work / "landscape.json",
                           {"moduli": tracks.moduli(MODULI[2]), "solver": "automatic", **LANDSCAPE})
    deviations = tracks.run(tracks.program(arguments), arguments.work / "deviations.json",
                            {"moduli": tracks.moduli(MODULI[8]), "controls": 8, "noise": NOISE, "frames": FRAMES, "horizon": HORIZONS,
                             "solver": "automatic", "task": "deviations"})
    common.write_results(__file__, {"frames": FRAMES, "first_horizon": FIRST, "noise": NOISE, "nelder_mead_budget_seconds": BUDGET,
                                    "landscape_frames": LANDSCAPE["frames"], "landscape": landscape["landscape"], "deviations": deviations["deviations"],
                                    "runs": rows})


if __name__ == "__main__":
    main()
