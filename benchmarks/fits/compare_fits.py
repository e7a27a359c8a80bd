#!/usr/bin/env python3
"""Whole fits of two builds of pliant in turns: how long each takes, and whether they give the same answers.

    python3 benchmarks/fits/compare_fits.py BASE/apps/pliant HEAD/apps/pliant examples/oracle-bounce-a --repetitions 5

Base and head take turns, so that a machine that is busy slows both. Prints medians and ratios of wall and processor time, and the
greatest difference of an estimate over its stated deviation. Exit code 1: one differs by more than --tolerance of that.
Standard library only."""
import argparse
import math
import pathlib
import statistics
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "experiments"))
import common


def estimates(result):
    """Numbers that were estimated and have a deviation: {name: (value, deviation)}."""
    return {name: (p["value"], p["std"]) for name, p in result["parameters"].items()
            if p.get("estimated") and isinstance(p["value"], (int, float)) and isinstance(p.get("std"), (int, float)) and p["std"] > 0.0}


def farthest(base, head):
    """Greatest difference of two fits' estimates, in deviations of the first, and whose it is."""
    of_base, of_head = estimates(base), estimates(head)
    if of_base.keys() != of_head.keys():
        raise SystemExit(f"the fits estimate different parameters: {sorted(of_base.keys() ^ of_head.keys())}")
    return max(((abs(of_head[name][0] - value) / std, name) for name, (value, std) in of_base.items()), default=(0.0, "nothing"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("base", type=pathlib.Path, help="the program to compare with")
    parser.add_argument("head", type=pathlib.Path, help="the program that was changed")
    parser.add_argument("captures", nargs="+", type=pathlib.Path, help="recordings")
    parser.add_argument("--repetitions", type=int, default=5, help="fits of each program and recording (default 5)")
    parser.add_argument("--tolerance", type=float, default=0.1, help="of a stated deviation (default 0.1)")
    parser.add_argument("--threads", type=int, help="threads of a fit")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="a choice of both fits; may be given many times")
    arguments = parser.parse_args()
    if arguments.repetitions < 1:
        parser.error("--repetitions must be at least 1")
    words = [word for choice in arguments.set for word in ("--set", choice)]
    words += ["--threads", arguments.threads] if arguments.threads else []
    differs = False
    print("| recording | wall, base [s] | head [s] | head over base | processor, base [s] | head [s] | head over base | farthest estimate, in deviations |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory(prefix="pliant.") as work:
        for capture in arguments.captures:
            times, found = {"base": [], "head": []}, {}
            for repetition in range(arguments.repetitions):
                for name in ("base", "head"):
                    out = pathlib.Path(work) / f"{name}-{repetition}"
                    times[name].append(common.run(getattr(arguments, name).resolve(), "fit", capture, "--out", out, *words, allowed=(0, 3)))
                    found[name] = common.read(out / "result.json")
            median = {name: [statistics.median(t[key] for t in all) for key in ("wall_seconds", "processor_seconds")] for name, all in times.items()}
            ratio = [h / b if b > 0.0 else math.nan for b, h in zip(median["base"], median["head"])]
            distance, of = farthest(found["base"], found["head"])
            differs = differs or distance > arguments.tolerance
            print("| " + " | ".join([capture.name, *(cell for k in (0, 1) for cell in (f"{median['base'][k]:.1f}", f"{median['head'][k]:.1f}", f"{ratio[k]:.2f}")),
                                     f"{distance:.3f} ({of})"]) + " |", flush=True)
    return 1 if differs else 0


if __name__ == "__main__":
    sys.exit(main())
