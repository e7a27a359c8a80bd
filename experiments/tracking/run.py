#!/usr/bin/env python3
"""Objects that swing before three depth sensors: how far the tracked nodes are from the true ones.

A bar and a thin curved leaf at 30 Hz, noise of 3 mm, a third of the surface hidden (its middle, or its free end), 1 % outliers;
slow, and so fast that they move by a tenth of their size between frames; tracked with the true Young's modulus, a tenth and ten
times of it. Standard library only."""
import os
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common
import tracks

OBJECTS = [("bar", "linear", "middle"), ("leaf", "linear", "middle"), ("leaf", "quadratic", "middle"), ("bar", "linear", "end"), ("leaf", "quadratic", "end")]
MOTIONS = ["slow", "fast"]


def rounded(figures):
    for track in figures["tracks"]:
        track["errors"] = [common.number(e, 3) for e in track["errors"]]
        for key, value in track.items():
            if isinstance(value, float):
                track[key] = common.number(value, 4)
    figures["fastest"] = common.number(figures["fastest"], 4)
    return figures


def main():
    arguments = common.arguments(__doc__)
    os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1")
    program = arguments.program.parent.parent / "experiments/pliant_tracking"
    recordings = []
    for object_, elements, hidden in OBJECTS:
        for motion in MOTIONS:
            name = f"{object_}-{elements}-{hidden}-{motion}"
            recordings.append(rounded(tracks.run(program, arguments.work / f"{name}.json", {"object": object_, "elements": elements, "hidden": hidden, "motion": motion})))
            for track in recordings[-1]["tracks"]:
                print(name, {key: track[key] for key in ("modulus_factor", "mean_error", "worst_error", "lost_at")}, flush=True)
    common.write_results(__file__, {"recordings": recordings})


if __name__ == "__main__":
    main()
