#!/usr/bin/env python3
"""Two ways from clouds to a material, on recordings of another simulator (a bar, and a bar of two stiffnesses, bent and let go): the
object tracked and its motion fitted, in turns, and the points fitted themselves; and what `pliant fit` makes of both with no
choice of ours. Then tracking alone, with the true material and with ones ten times too soft and too hard, and the loop from
there. truth.json and truth/ are read for judging only, and for those starts, which are wrong on purpose. Standard library only."""
import csv
import math
import pathlib
import struct
import subprocess
import sys
import time
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
sys.path.insert(0, str(HERE.parent / "oracle-release"))
import common
from importlib import import_module

release = import_module("run")

SETS = {"release": "oracle-release", "zones": "oracle-release-zones"}
WAYS = {"automatic": {}, "tracked motion": {"tracking": "loop"}, "tracked motion, control points by evidence": {"tracking": "loop", "control_points": "auto"},
        "points": {"tracking": "off"}}
WRONG = {"true material": 1.0, "ten times too soft": 0.1, "ten times too hard": 10.0}


def rest_points(folder):
    """Vertices of the true surface at rest [m]."""
    ply = (folder / "truth" / "reference.ply").read_bytes()
    with zipfile.ZipFile(folder / "truth" / "trajectory.npz") as archive:
        count = common.read_array(archive, "q")[0][1]
    flat = struct.unpack_from(f"<{3 * count}d", ply, ply.index(b"end_header\n") + 11)
    return [flat[3 * i:3 * i + 3] for i in range(count)]


def node_errors(folder, paths):
    """Mean distance of the true surface's vertices to where they were followed to, of each frame, times the object's size."""
    with zipfile.ZipFile(folder / "truth" / "trajectory.npz") as archive:
        (frames, count, _), q = common.read_array(archive, "q")
        scale = common.read_array(archive, "scale")[1][0]
    rest = rest_points(folder)
    size = max(max(p[d] for p in rest) - min(p[d] for p in rest) for d in range(3))
    sums, counts = [0.0] * frames, [0] * frames
    with open(paths, newline="") as file:
        for row in csv.DictReader(file):
            frame, at = int(row["frame"]), 3 * (count * int(row["frame"]) + int(row["id"][1:]))
            sums[frame] += math.dist((float(row["x"]), float(row["y"]), float(row["z"])), [scale * v for v in q[at:at + 3]])
            counts[frame] += 1
    return [s / c / size for s, c in zip(sums, counts) if c]


def track(program, folder, work, modulus):
    """Figures of a tracked recording."""
    points = work / (folder.name + "-points.csv")
    points.write_text("id,x,y,z\n" + "".join(f"v{i},{x:.9g},{y:.9g},{z:.9g}\n" for i, (x, y, z) in enumerate(rest_points(folder))))
    out = work / f"track-{folder.name}-{modulus:.3g}"
    begin = time.monotonic()
    done = subprocess.run([program, "track", folder, "--points", points, "--no-pictures", "--set", f"youngs_modulus={modulus}", "--out", out])
    seconds = time.monotonic() - begin
    errors = node_errors(folder, out / "points.csv")
    return {"youngs_modulus": common.number(modulus), "mean": common.number(sum(errors) / len(errors), 3),
            "worst_frame": common.number(max(errors), 3), "frames": len(errors), "lost": done.returncode == 3,
            "seconds_a_frame": common.number(seconds / len(errors), 2)}


def fit(program, folder, out, choices, truth):
    figures = common.fit(program, folder, out, choices)
    result = figures.pop("result")
    parameters = {name: {"value": common.number(p["value"]), "std": common.number(p.get("std"), 2)}
                  for name, p in result["parameters"].items() if name in release.NAMES or name.startswith("youngs_modulus")}
    figures.update({"parameters": parameters, "surface_rms": common.number(result["error"]["surface_rms"], 4),
                    "tracking": result.get("tracking"), "commit": result["software"]["commit"]})
    value = truth["youngs_modulus"]["value"]
    if isinstance(value, dict):
        figures["zones"] = release.zones_of(out / "model.vtu", value["zones"])
    else:
        figures["error"] = common.number(parameters["youngs_modulus"]["value"] / value - 1.0, 3)
    return figures


def main():
    arguments = common.arguments(__doc__, only={"metavar": "NAME", "help": "of the fits, this one ('zones, points'); all else stays as it is stored"})
    stored = HERE / "results.json"
    results = common.read(stored) if arguments.only and stored.exists() else {"fits": {}, "tracks": {}, "loops": {}}
    for name, source in SETS.items():
        folder = common.shared_data() / source
        if not (folder / "capture.toml").exists():
            print(f"{source} is not there, left out")
            continue
        truth = common.read(folder / "truth.json")["parameters"]
        for way, choices in WAYS.items():
            if arguments.only and arguments.only != f"{name}, {way}":
                continue
            figures = fit(arguments.program, folder, arguments.work / f"{name}-{way.replace(',', '').replace(' ', '-')}", choices, truth)
            results["fits"][f"{name}, {way}"] = figures
            print(name, way, figures.get("error"), figures.get("zones"), figures["wall_seconds"], "s", flush=True)
            common.write_results(__file__, results)
        if name == "zones" or arguments.only:
            continue
        true = truth["youngs_modulus"]["value"]
        for wrong, factor in WRONG.items():
            results["tracks"][wrong] = track(arguments.program, folder, arguments.work, factor * true)
            print("track", wrong, results["tracks"][wrong], flush=True)
            if factor == 1.0:
                continue
            figures = fit(arguments.program, folder, arguments.work / f"loop-{factor}",
                          {"tracking": "loop", "youngs_modulus": factor * true}, truth)
            figures["track_after"] = track(arguments.program, folder, arguments.work, figures["parameters"]["youngs_modulus"]["value"])
            results["loops"][wrong] = figures
            print("loop from", wrong, figures["error"], figures["track_after"], flush=True)
        common.write_results(__file__, results)


if __name__ == "__main__":
    main()
