#!/usr/bin/env python3
"""Moduli and dampings of a synthetic dinosaur with seven control points (Wang 2015, figure 5b and table 1).

A run whose output is in the work folder already is not run again. About 10 minutes on two cores."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common
import tracks

# Head, tail, hands, feet, belly. The values are the paper's; which of its control points had which, its table does not say.
MODULI = [1e5, 1e4, 1e5, 1e6, 1e6, 1e6, 1e6]
CHOICES = {"object": "dinosaur", "cell_size": 0.0255, "controls": 7, "moduli": tracks.moduli(MODULI), "rate": 30, "frames": 60, "horizon": 16, "steps": 4}


def main():
    arguments = common.arguments(__doc__)
    common.write_results(__file__, {"runs": {"clean-7": tracks.fit(arguments, "clean-7", CHOICES)}})


if __name__ == "__main__":
    main()
