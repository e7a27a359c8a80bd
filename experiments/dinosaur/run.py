#!/usr/bin/env python3
"""Moduli and dampings of a synthetic dinosaur with seven control points (Wang 2015, figure 5b and table 1).

A run whose output is in the work folder already is not run again. About two hours on two cores."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common
import tracks

# Head, tail, hands, feet, belly. The values are the paper's; which of its control points had which, its table does not say.
MODULI = [1e5, 1e4, 1e5, 1e6, 1e6, 1e6, 1e6]
SHARED = {"object": "dinosaur", "cell_size": 0.0255, "controls": 7, "moduli": tracks.moduli(MODULI), "rate": 30, "steps": 4}
# The paper's number of frames, with and without noise, and one swing of them.
RUNS = {"clean-7": {"frames": 60, "horizon": 16},
        "whole-7": {"frames": 523, "horizon": "16,60,523"},
        "noise-7": {"frames": 523, "horizon": "16,60,523", "noise": 0.01}}


def main():
    arguments = common.arguments(__doc__, only={"metavar": "NAME", "help": "of the fits, this one; all else stays as it is stored"})
    file = HERE / "results.json"
    rows = common.read(file).get("runs", {}) if file.exists() and arguments.only else {}
    for name, choices in RUNS.items():
        if name == (arguments.only or name):
            rows[name] = tracks.fit(arguments, name, {**SHARED, **choices})
            common.write_results(__file__, {"runs": rows})


if __name__ == "__main__":
    main()
