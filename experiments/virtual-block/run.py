#!/usr/bin/env python3
"""The virtual block of Bickel 2009, section 6: noise in the markers against the error of the fitted material.

    python3 experiments/virtual-block/run.py OUT [--pliant PROGRAM] [--make PROGRAM] [--seeds 1 2 3] [--laws ogden fung]

For each law of the true material every noise level is fitted with each material. Errors are those of all presses (fitted
and test) against markers without noise: root mean square over the greatest displacement of the press, averaged over
presses. Seeds are those of presses and noise. Figures are written after each fit; those of fits that are not asked for stay. Standard library only."""
import argparse
import itertools
import pathlib
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common


def truth_capture(capture):
    """The same capture with markers without noise, for judging."""
    text = (capture / "capture.toml").read_text()
    path = capture / "truth" / "capture.toml"
    path.parent.mkdir(exist_ok=True)
    for name in ("block.vtu", "markers_rest.csv"):
        text = text.replace(f'"{name}"', f'"../{name}"')
    path.write_text(text.replace('"press/', '"../press/').replace('.csv"\nmarkers_rest', '_truth.csv"\nmarkers_rest'))
    return path.parent


def fit(program, capture, out, material):
    """Seconds, and the exit code, of a fit whose output goes to OUT.log."""
    begin = time.monotonic()
    with open(out.with_suffix(".log"), "w") as log:
        code = subprocess.run([str(program), "fit", str(capture), "--out", str(out), "--set", f"material={material}"],
                              stdout=log, stderr=log, check=False).returncode
    return time.monotonic() - begin, code


def judged(program, out, judge):
    """Mean and greatest relative errors of the presses by their role, against markers without noise."""
    common.run(program, "evaluate", out / "model.toml", judge, "-o", out / "evaluation.json", allowed=(0, 3))
    presses = common.read(out / "evaluation.json")["presses"]
    entry = {"no_equilibrium": sum(p["relative_error"] is None for p in presses)}
    for role in ("fit", "test"):
        errors = [p["relative_error"] for p in presses if p["role"] == role and p["relative_error"] is not None]
        entry[role] = sum(errors) / len(errors) if errors else None
        entry[f"{role}_max"] = max(errors, default=None)
        entry[f"{role}_presses"] = len(errors)
    basis = out / "basis.csv"
    if basis.exists():
        entry["error_by_size"] = [float(line.split(",")[1]) for line in basis.read_text().splitlines()[1:]]
    return entry


def stored():
    """Figures of earlier fits by seed, law, noise and material; nothing of files of another layout."""
    file = HERE / "results.json"
    return common.read(file).get("seeds", {}) if file.exists() else {}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path, help="folder for captures and fits")
    parser.add_argument("--pliant", type=pathlib.Path, default=common.DEFAULT_PROGRAM)
    parser.add_argument("--make", type=pathlib.Path, default=common.ROOT / "build/release/experiments/pliant_virtual_block")
    parser.add_argument("--seeds", nargs="*", default=["1"])
    parser.add_argument("--laws", nargs="*", default=["ogden", "fung"], help="of the true material")
    parser.add_argument("--noise", nargs="*", default=["00", "10", "20", "30"], help="percent")
    parser.add_argument("--materials", nargs="*", default=["ogden", "sampled", "linear"], help="that are fitted")
    arguments = parser.parse_args()
    failed = []
    for seed, law in itertools.product(arguments.seeds, arguments.laws):
        folder = arguments.out / seed / law
        folder.mkdir(parents=True, exist_ok=True)
        subprocess.run([str(arguments.make), str(folder), seed, law], check=True)
        for noise, material in itertools.product(arguments.noise, arguments.materials):
            judge = truth_capture(folder / noise)
            out = folder / f"{material}-{noise}"
            seconds, code = fit(arguments.pliant, folder / noise, out, material)
            if code not in (0, 3):
                failed.append(f"{out}.log")
                print(seed, law, noise, material, f"returned {code}: see {out}.log", flush=True)
                continue
            notes = common.read(out / "result.json").get("notes", [])
            entry = {"seconds": round(seconds, 1), "converged": code == 0, **judged(arguments.pliant, out, judge),
                     "notes": notes, "zones": [n for n in notes if n.startswith("Zones:")]}
            seeds = stored()  # anew: another run may have written since
            seeds.setdefault(seed, {}).setdefault(law, {}).setdefault(noise, {})[material] = entry
            print(seed, law, noise, material, entry, flush=True)
            common.write_results(__file__, {"seeds": seeds})
    if failed:
        sys.exit("these fits failed: " + ", ".join(failed))


if __name__ == "__main__":
    main()
