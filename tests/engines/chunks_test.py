#!/usr/bin/env python3
"""The snippet of docs/ensemble.md reads an ensemble's chunks, and NumPy finds the quantiles that its tables tell.

    chunks_test.py PROGRAM SOURCE

Exit code 77 where there is no NumPy.
"""

import csv
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from engines_test import leave_model, python_with, skip

try:
    import numpy
except ImportError:
    other = python_with("numpy")
    if not other:
        skip("no Python here has numpy: apt-get install python3-numpy")
    os.execv(other, [other, *sys.argv])

SHARES = [0.05, 0.25, 0.5, 0.75, 0.95]


def rows(path):
    with open(path, newline="") as file:
        return list(csv.reader(file))


def close(told, found, tolerance):
    """Nine digits are written, and numpy divides otherwise."""
    told = numpy.array([float(cell) for cell in told])
    assert numpy.allclose(told, found, rtol=tolerance, atol=1e-12), (told, found)


def main():
    program, source = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    snippet = re.search(r"```python\n(.*?)```", (source / "docs/ensemble.md").read_text(), re.S).group(1)
    with tempfile.TemporaryDirectory(prefix="pliant-chunks-") as name:
        os.chdir(name)
        leave_model(source, pathlib.Path(name))
        pathlib.Path("points.csv").write_text("id,x,y,z\ntop,0.1,0.2,0\nside,0,0.2,0.1\n")
        subprocess.run([program, "ensemble", "fit", "--from", "materials.csv", "--points", "points.csv", "--chunk", "3", "--out", "many"],
                       check=True)
        there = {}
        exec(snippet, there)
        told, members, median = there["told"], there["members"], there["median"]
        assert len(members) == 8 and (members["state"] == 1).all()

        table = rows("many/members.csv")
        for k, output in enumerate(told["outputs"]):
            column = table[0].index(f"{output['name']} [{output['unit']}]")
            close([row[column] for row in table[1:]], members["outputs"][:, k], 1e-8)
        for row in rows("many/quantiles.csv")[1:]:
            column = table[0].index(f"{row[0]} [{row[1]}]")
            assert row[2] == "8"
            close(row[3:], numpy.quantile([float(r[column]) for r in table[1:]], SHARES), 1e-7)
        for row in rows("many/frames.csv")[1:]:
            close(row[2:], numpy.quantile(members["series"][:, int(row[0])].astype(float), SHARES, axis=0).T.ravel(), 1e-8)
        points = rows("many/points.csv")[1:]
        assert len(points) == 2 * len(told["times"])
        for row in points:
            number = told["vertices"] + told["points"].index(row[2])
            there = members["positions"][:, int(row[0]), number].astype(float)
            close(row[3:], numpy.quantile(there, SHARES, axis=0).T.ravel(), 1e-8)
            close(row[5::5], median[int(row[0]), number], 1e-6)
    print("tables say what NumPy finds")


if __name__ == "__main__":
    main()
