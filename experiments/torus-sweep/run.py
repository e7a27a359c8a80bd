#!/usr/bin/env python3
"""The cost of the bouncing torus and its derivative over Young's modulus (Weiss 2020, figures 7 and 18).

From a fifth of the truth to five times it, with the derivative by the adjoint and by tangents."""
import csv
import io
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

COUNT, CELLS = 25, 15.4
KNOWN = ["poissons_ratio=0.3", "mass_damping=0.1", "stiffness_damping=0.004"]


def main():
    arguments = common.arguments(__doc__)
    sweep = arguments.program.parent.parent / "experiments/pliant_sweep"
    capture = arguments.work / "capture"
    common.run(arguments.program, "synth", HERE.parent / "torus/scene.toml", "--out", capture)
    truth = common.read(capture / "truth.json")["parameters"]["youngs_modulus"]["value"]
    text = subprocess.run([sweep, capture, str(CELLS), str(truth / 5), str(truth * 5), str(COUNT), *KNOWN], check=True,
                          stdout=subprocess.PIPE, text=True).stdout
    rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(io.StringIO(text))]
    lowest = min(rows, key=lambda row: row["cost"])
    scale = max(abs(row["gradient_adjoint"]) for row in rows)
    # Beside the lowest value of the sweep the minimum may lie on either side of it.
    wrong = [row["youngs_modulus"] for row in rows if row is not lowest and
             (row["gradient_adjoint"] > 0) != (row["youngs_modulus"] > lowest["youngs_modulus"])]
    common.write_results(__file__, {
        "truth": truth, "lowest_at": lowest["youngs_modulus"], "evaluated": len(rows), "asked": COUNT,
        "wrong_signs": wrong,
        "adjoint_against_tangent": max(abs(row["gradient_adjoint"] - row["gradient_tangent"]) for row in rows) / scale,
        "rows": rows})


if __name__ == "__main__":
    main()
