"""The virtual block of Bickel 2009, section 6: noise in the markers against the error of the fitted material.

    python3 experiments/virtual-block/run.py OUT [--pliant PROGRAM] [--make PROGRAM]

Every noise level is fitted with each material; errors are those of all presses (fitted and test) against markers
without noise, root mean square over the greatest displacement of the press, averaged over presses.
"""

import argparse
import csv
import json
import pathlib
import subprocess
import sys
import time

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common  # noqa: E402


def positions(path):
    with open(path) as file:
        return {row["id"]: np.array([float(row[k]) for k in "xyz"]) for row in csv.DictReader(file)}


def truth_capture(capture):
    """The same capture with markers without noise, for judging."""
    text = (capture / "capture.toml").read_text()
    path = capture / "truth" / "capture.toml"
    path.parent.mkdir(exist_ok=True)
    for name in ("block.vtu", "markers_rest.csv"):
        text = text.replace(f'"{name}"', f'"../{name}"')
    path.write_text(text.replace('"press/', '"../press/').replace('.csv"\nmarkers_rest', '_truth.csv"\nmarkers_rest'))
    return path.parent


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--pliant", default=str(common.DEFAULT_PROGRAM))
    parser.add_argument("--make", default="build/release/experiments/pliant_virtual_block")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--noise", nargs="*", default=["00", "10", "20", "30"])
    parser.add_argument("--materials", nargs="*", default=["ogden", "sampled", "linear"])
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    subprocess.run([arguments.make, str(arguments.out), arguments.seed], check=True)
    file = HERE / "results.json"
    results = json.loads(file.read_text()) if file.exists() else {}
    for noise in arguments.noise:
        capture = arguments.out / noise
        judge = truth_capture(capture)
        for material in arguments.materials:
            out = arguments.out / f"{material}-{noise}"
            begin = time.time()
            with open(arguments.out / f"{material}-{noise}.log", "w") as log:
                subprocess.run([arguments.pliant, "fit", str(capture), "--out", str(out), "--set",
                                f"material={material}"], stdout=log, stderr=log, check=False)
            seconds = time.time() - begin
            evaluation = out / "evaluation.json"
            subprocess.run([arguments.pliant, "evaluate", str(out / "model.toml"), str(judge), "-o", str(evaluation)],
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
            presses = json.loads(evaluation.read_text())["presses"]
            entry = {"seconds": round(seconds, 1)}
            for role in ("fit", "test"):
                errors = [p["relative_error"] for p in presses if p["role"] == role and p["relative_error"] is not None]
                entry[role] = float(np.mean(errors))
                entry[f"{role}_presses"] = len(errors)
            if material == "sampled":
                notes = json.loads((out / "result.json").read_text())["notes"]
                entry["notes"] = [n for n in notes if "samples an element" in n]
            results.setdefault(noise, {})[material] = entry
            print(noise, material, entry, flush=True)
            file.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
