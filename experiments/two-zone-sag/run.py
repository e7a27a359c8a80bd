#!/usr/bin/env python3
"""A bar of two stiffnesses, scanned as it sags, then struck: both moduli and its load-free shape are unknown (Wang 2015, figures 6
and 9, section 6.1). Points on it are followed. The recording comes from twice as many elements along and across."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common
import subprocess

CELLS, NOISE = 10, 2e-4
LANDSCAPE_CELLS, SAMPLES = 8, 17


def run(program, out, *words):
    if not out.exists():
        part = out.with_suffix(".part")
        with open(part, "w") as file:
            subprocess.run([program, *map(str, words)], check=True, stdout=file)
        part.rename(out)
    return common.read(out)


def main():
    arguments = common.arguments(__doc__)
    program = arguments.program.parent.parent / "experiments/pliant_load_free"
    compared = run(program, arguments.work / "compare.json", "compare", CELLS, NOISE)
    landscape = run(program, arguments.work / "landscape.json", "landscape", LANDSCAPE_CELLS, NOISE, SAMPLES)
    common.write_results(__file__, {"compared": compared, "landscape": landscape["landscape"],
                                    "landscape_elements": landscape["elements"], "landscape_nodes": landscape["nodes"]})


if __name__ == "__main__":
    main()
