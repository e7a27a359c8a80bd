#!/usr/bin/env python3
"""A stiffening foam block from another simulator, fitted by each material and judged on presses by another disc.

    python3 experiments/oracle-press/run.py OUT [--pliant PROGRAM] [--materials ...] [--set KEY=VALUE ...]

Errors are root mean squares of the markers over the greatest measured displacement of a press: against the markers as
they were measured (0.5 mm of noise a coordinate), and against where the other simulator had them. Figures are written
after each fit; those of materials that are not asked for stay. Standard library only."""
import argparse
import csv
import math
import pathlib
import subprocess
import sys
import time
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common


def write_markers(path, ids, positions):
    """Markers that are somewhere, as a capture has them; positions flat."""
    lines = ["id,x,y,z"]
    for i, marker in enumerate(ids):
        place = positions[3 * i:3 * i + 3]
        if all(map(math.isfinite, place)):
            lines.append(f"{marker}," + ",".join(f"{v:.9g}" for v in place))
    path.write_text("\n".join(lines) + "\n")


def read_markers(path):
    with open(path, newline="") as file:
        return {row["id"]: tuple(float(row[k]) for k in "xyz") for row in csv.DictReader(file)}


def without_noise(data, folder):
    """The capture with the true markers, for judging."""
    (folder / "press").mkdir(parents=True, exist_ok=True)
    ids = list(read_markers(data / "markers_rest.csv"))
    with zipfile.ZipFile(data / "truth" / "presses.npz") as archive:
        (count, *_), loaded = common.read_array(archive, "markers")
        write_markers(folder / "markers_rest.csv", ids, common.read_array(archive, "markers_rest")[1])
    for press in range(count):
        write_markers(folder / "press" / f"{press:03d}.csv", ids, loaded[3 * len(ids) * press:3 * len(ids) * (press + 1)])
    for name in ("rest.ply", "capture.toml"):
        (folder / name).write_bytes((data / name).read_bytes())
    return folder


def truth_error(data, judge, presses):
    """Mean relative errors by role that the true displacements themselves have against the measured markers."""
    errors = {"fit": [], "test": []}
    rest, true_rest = read_markers(data / "markers_rest.csv"), read_markers(judge / "markers_rest.csv")
    for number, (role, moved, _, _) in enumerate(presses):
        seen, true = (read_markers(folder / "press" / f"{number:03d}.csv") for folder in (data, judge))
        off = [rest[m][d] + true[m][d] - true_rest[m][d] - seen[m][d] for m in seen if m in true for d in range(3)]
        errors[role].append(math.sqrt(3.0 * sum(v * v for v in off) / len(off)) / moved)
    return {role: sum(e) / len(e) for role, e in errors.items() if e}


def judged(program, model, capture, out):
    """Mean relative errors of the presses by their role, and every press."""
    common.run(program, "evaluate", model, capture, "-o", out, allowed=(0, 3))
    presses = common.read(out)["presses"]
    entry = {}
    for role in ("fit", "test"):
        errors = [p["relative_error"] for p in presses if p["role"] == role and p["relative_error"] is not None]
        entry[role] = sum(errors) / len(errors) if errors else None
    entry["presses"] = [[p["role"], p["max_displacement"], p["marker_rms"], p["relative_error"]] for p in presses]
    return entry


def stored():
    """Figures of earlier fits; the machine is that of the last one."""
    file = HERE / "results.json"
    results = common.read(file) if file.exists() else {}
    results.pop("machine", None)
    return results


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path, help="folder for the fits")
    parser.add_argument("--pliant", type=pathlib.Path, default=common.DEFAULT_PROGRAM)
    parser.add_argument("--materials", nargs="*", default=["ogden", "sampled", "linear"])
    parser.add_argument("--set", nargs="*", default=[], dest="settings")
    arguments = parser.parse_args()
    data = common.shared_data() / "oracle-press"
    arguments.out.mkdir(parents=True, exist_ok=True)
    judge = without_noise(data, arguments.out / "truth")
    failed = []
    for material in arguments.materials:
        out = arguments.out / material
        begin = time.monotonic()
        settings = [word for setting in [f"material={material}", *arguments.settings] for word in ("--set", setting)]
        with open(out.with_suffix(".log"), "w") as log:
            code = subprocess.run([str(arguments.pliant), "fit", str(data), "--out", str(out), *settings], stdout=log,
                                  stderr=log, check=False).returncode
        if code not in (0, 3):
            failed.append(f"{out}.log")
            print(material, f"returned {code}: see {out}.log", flush=True)
            continue
        entry = {"seconds": round(time.monotonic() - begin, 1), "converged": code == 0, "settings": arguments.settings}
        fitted = common.read(out / "result.json")
        entry["parameters"] = {p: [v["value"], v.get("std")] for p, v in fitted["parameters"].items()}
        entry["notes"] = fitted.get("notes", [])
        for name, capture in (("measured", data), ("true", judge)):
            entry[name] = judged(arguments.pliant, out / "model.toml", capture, out / f"evaluation_{name}.json")
        results = stored()  # anew: another run may have written since
        results[material] = entry
        results["truth"] = {"measured": truth_error(data, judge, entry["measured"]["presses"])}
        print(material, entry["seconds"], "s measured", {k: entry["measured"][k] for k in ("fit", "test")}, "true",
              {k: entry["true"][k] for k in ("fit", "test")}, flush=True)
        common.write_results(__file__, results)
    if failed:
        sys.exit("these fits failed: " + ", ".join(failed))


if __name__ == "__main__":
    main()
