#!/usr/bin/env python3
"""Stress between and beyond samples of one element's strain: eq. 8 of Bickel 2009 as printed, and pliant's sampled law.

    python3 experiments/strain-samples/run.py [PROGRAM]

PROGRAM is build/release/experiments/pliant_strain_samples. Standard library only."""
import csv
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else common.ROOT / "build/release/experiments/pliant_strain_samples"
    text = subprocess.run([str(program)], check=True, stdout=subprocess.PIPE, text=True).stdout
    errors = {}
    for row in csv.DictReader(text.splitlines()):
        errors.setdefault(row["truth"], {}).setdefault(row["noise"], {}).setdefault(row["method"], {})[row["size"]] = float(row["error"])
    common.write_results(__file__, {"errors": errors})


if __name__ == "__main__":
    main()
