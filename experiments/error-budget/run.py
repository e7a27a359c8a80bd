#!/usr/bin/env python3
"""What each error of a recording costs: recordings that are right, fitted with no choices, and again with one thing wrong that nobody told.

    run.py [PROGRAM] [--battery FOLDER] [--only NAME ...] [--work FOLDER]

Each error has the size that good equipment and care leave. An error is put into the capture's files, so all else is the same to the last
bit. The truth is read for judging alone. A fit that is in the work folder already is not run again."""
import math
import pathlib
import re
import shutil
import sys

import numpy as np
from PIL import Image

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

RECORDINGS = ["drop-04", "tilted-01", "hang-07", "release-06"]


# One thing in a capture's folder -------------------------------------------------------------------------------------

def edit(folder, pattern, replace):
    """Replaces what the pattern finds in capture.toml; false where there is none."""
    path = folder / "capture.toml"
    text, found = re.subn(pattern, replace, path.read_text(), flags=re.MULTILINE)
    path.write_text(text)
    return found > 0


def scaled(key, factor):
    return lambda folder: edit(folder, rf"^({key} = )([0-9.e-]+)", lambda m: f"{m[1]}{float(m[2]) * factor!r}")


def numbers(text):
    return [float(x) for x in re.findall(r"[-+0-9.e]+", text)]


def with_matrix(change):
    """Changes the matrix [camera_to_world] of every camera."""
    def matrix(match):
        flat = numbers(match[2])
        rows = change([flat[0:4], flat[4:8], flat[8:12], flat[12:16]])
        return match[1] + repr(rows)
    return lambda folder: edit(folder, r"^(camera_to_world = )(\[\[.*\]\])", matrix)


def moved_camera(rows, shift=0.003):
    """Along the diagonal of its own axes."""
    for row in rows[:3]:
        row[3] += shift / math.sqrt(3.0) * sum(row[:3])
    return rows


def turned_camera(rows, degrees=0.3):
    """About its own upward axis and about the way that it looks, equally, where it stands."""
    def turn(a, b, angle):
        for row in rows[:3]:
            row[a], row[b] = math.cos(angle) * row[a] + math.sin(angle) * row[b], math.cos(angle) * row[b] - math.sin(angle) * row[a]
    angle = math.radians(degrees) / math.sqrt(2.0)
    turn(0, 2, angle), turn(0, 1, angle)
    return rows


def tilted(match, degrees=1.0):
    g = numbers(match[2])
    down = max(range(3), key=lambda k: abs(g[k]))
    side = (down + 1) % 3
    g[side], g[down] = g[side] + math.sin(math.radians(degrees)) * abs(g[down]), math.cos(math.radians(degrees)) * g[down]
    return match[1] + repr(g)


def scan(change):
    """Moves the vertices of rest.ply: change(vertices, normals) are their new places [m]."""
    def run(folder):
        content = bytearray((folder / "rest.ply").read_bytes())
        head = content.index(b"end_header\n") + len(b"end_header\n")
        count, faces = (int(re.search(rf"element {kind} (\d+)".encode(), content[:head])[1]) for kind in ("vertex", "face"))
        v = np.frombuffer(content, "<f8", 3 * count, head).reshape(-1, 3)
        corners = np.frombuffer(content, [("corners", "u1"), ("at", "<i4", 3)], faces, head + v.nbytes)["at"]
        normals = np.zeros_like(v)
        across = np.cross(v[corners[:, 1]] - v[corners[:, 0]], v[corners[:, 2]] - v[corners[:, 0]])
        for k in range(3):
            np.add.at(normals, corners[:, k], across)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        content[head:head + v.nbytes] = change(v, normals).astype("<f8").tobytes()
        (folder / "rest.ply").write_bytes(content)
        return True
    return run


def longer_range(folder, bias=0.002):
    """Of every reading, the background's too."""
    scale = re.search(r"^depth_scale = ([0-9.]+)", (folder / "capture.toml").read_text(), re.MULTILINE)
    if not scale:
        return False
    for path in folder.glob("*/*.png"):
        if path.name.startswith("mask"):
            continue
        readings = np.asarray(Image.open(path)).astype(np.uint16)
        Image.fromarray(np.where(readings > 0, readings + round(bias * float(scale[1])), 0).astype(np.uint16)).save(path)
    return True


def waves(v, rms=0.001, length=0.05):
    """A smooth error: a sum of waves of that length in all directions [m], one a vertex."""
    random = np.random.default_rng(1)
    directions = random.normal(size=(12, 3))
    directions *= 2.0 * math.pi / length / np.linalg.norm(directions, axis=1, keepdims=True)
    sum_of_all = np.cos(v @ directions.T + random.uniform(0.0, 2.0 * math.pi, 12)).sum(axis=1)
    return rms * sum_of_all / np.sqrt(np.mean(sum_of_all**2))


ERRORS = {
    "scan 1 mm outside of the object": scan(lambda v, normals: v + 0.001 * normals),
    "scan wavy by 1 mm": scan(lambda v, normals: v + waves(v)[:, None] * normals),
    "scan 2 % too large": scan(lambda v, normals: v + 0.02 * (v - 0.5 * (v.min(axis=0) + v.max(axis=0)))),
    "mass 5 % too large": scaled("(?:mass|density)", 1.05),
    "camera turned by 0.3 degrees": with_matrix(turned_camera),
    "camera 3 mm beside": with_matrix(moved_camera),
    "focal length 0.5 % too long": scaled("f[xy]", 1.005),
    "range 2 mm too long": longer_range,
    "range 0.5 % too long": scaled("depth_scale", 1.0 / 1.005),
    "gravity tilted by 1 degree": lambda folder: edit(folder, r"^(gravity = )(\[.*\])", tilted),
    "frame rate 1 % too high": scaled("frame_rate", 1.01),
    "velocities at the start not told": lambda folder: edit(
        folder, r"^\[initial\]\n(?:.*\n)*?known = true", "[initial]\nknown = false"),
}


# Fits ----------------------------------------------------------------------------------------------------------------

def figures_of(result, truth):
    row = {"verdict": result.get("verdict", ""), "parameters": {}}
    for name in ("youngs_modulus", "poissons_ratio"):
        p, true = result["parameters"].get(name), truth.get(name, truth.get("poisson_ratio", {}) if name == "poissons_ratio" else {}).get("value")
        if not p or not true or not p.get("interval_90"):
            continue
        low, high = p["interval_90"]
        row["parameters"][name] = {"error": common.number(p["value"] / true - 1.0), "deviation": common.number(p["std"] / p["value"]),
                                   "held": low <= true <= high}
    return row


def main():
    arguments = common.arguments(__doc__.split("\n")[0], battery={"type": pathlib.Path, "default": common.shared_data() / "battery"},
                                 only={"nargs": "*", "default": RECORDINGS})
    found = {}
    for name in arguments.only:
        source = arguments.battery / name
        truth = common.read(source / "truth.json")["parameters"]
        found[name] = {}
        for number, (error, make) in enumerate({"none": lambda folder: True, **ERRORS}.items()):
            folder = arguments.work / name / f"{number:02d}"
            if not (folder / "capture.toml").exists():
                shutil.copytree(source, folder, ignore=shutil.ignore_patterns("truth.json"))
                if not make(folder):  # the recording has no such thing
                    (folder / "none").touch()
            if (folder / "none").exists():
                continue
            fitted = common.fit(arguments.program, folder, arguments.work / "fits" / name / f"{number:02d}")
            found[name][error] = {**figures_of(fitted["result"], truth), "wall_seconds": fitted["wall_seconds"]}
            E = found[name][error]["parameters"].get("youngs_modulus", {})
            print(f"{name}, {error}: E {100 * E.get('error', math.nan):+.1f} % (± {100 * E.get('deviation', math.nan):.1f}), "
                  f"{found[name][error]['verdict']}, {fitted['wall_seconds']:.0f} s", flush=True)
        common.write_results(__file__, {"recordings": found})


if __name__ == "__main__":
    main()
