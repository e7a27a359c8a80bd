#!/usr/bin/env python3
"""One depth image each of silicone bars at rest: two shapes of one silicone that hang from a clamp, and a bar of two silicones
that is twisted by half a turn. Standard library only; about a quarter of an hour."""
import math
import pathlib
import struct
import sys
import tomllib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import common
import png

POSE = {"sensor_turn.estimate": True, "sensor_shift.estimate": True}
NEARLY_INCOMPRESSIBLE = {"poissons_ratio": 0.49, "poissons_ratio.estimate": False}
HEXAHEDRA = {"element": "hexahedra", "budget": 0}
TWO_SILICONES = """
[[region]]
name = "mold star 15"
half_space = { point = [-0.0825, 0, 0], normal = [-1, 0, 0] }
"""
# The twisted bar shows a ratio alone: the softer half is given what the hanging bars say, with a tenth of deviation.
ANCHOR = {"youngs_modulus": 155e3, "youngs_modulus.prior_std": 0.1}

# name: (recording, choices beside a Poisson's ratio of 0.49; None: no choice at all)
FITS = {
    "bar-no-choice": ("silicone-h_e_c", None),
    "spine-no-choice": ("silicone-h_e_s", None),
    "bar": ("silicone-h_e_c", {"cells": 20, "coarse_cells": 12, **HEXAHEDRA, **POSE}),
    "bar-finer": ("silicone-h_e_c", {"cells": 28, "coarse_cells": 12, **HEXAHEDRA, **POSE}),
    "bar-given-pose": ("silicone-h_e_c", {"cells": 20, "coarse_cells": 12, **HEXAHEDRA}),
    "bar-raw": ("silicone-h_e_c-raw", {"cells": 20, "coarse_cells": 12, "range_error": 0.03, "range_error.estimate": True, "range_error.prior_std": 1.0, **HEXAHEDRA, **POSE}),
    "bar-raw-from-zero": ("silicone-h_e_c-raw", {"cells": 20, "coarse_cells": 12, "range_error.estimate": True, "range_error.prior_std": 5.0, **HEXAHEDRA, **POSE}),
    "spine-coarse": ("silicone-h_e_s", {"cells": 30, "coarse_cells": 20, "youngs_modulus": 170e3, **HEXAHEDRA, **POSE}),
    "spine": ("silicone-h_e_s", {"cells": 44, "coarse_cells": 20, "youngs_modulus": 170e3, **HEXAHEDRA, **POSE}),
    "spine-given-pose": ("silicone-h_e_s", {"cells": 44, "coarse_cells": 20, "youngs_modulus": 170e3, **HEXAHEDRA}),
    "twisted": ("silicone-t_em_c", {"cells": 24, "coarse_cells": 10, **HEXAHEDRA, **ANCHOR}),
    "twisted-finer": ("silicone-t_em_c", {"cells": 32, "coarse_cells": 10, **HEXAHEDRA, **ANCHOR}),
    "twisted-pose": ("silicone-t_em_c", {"cells": 24, "coarse_cells": 10, **HEXAHEDRA, **ANCHOR, **POSE}),
}


def captures(work):
    """Folders that point at the recordings' files: with the range as recorded, and with the second silicone named."""
    shared = common.shared_data()
    for name, source, text in (
            ("silicone-h_e_c", "silicone-h_e_c", lambda t: t), ("silicone-h_e_s", "silicone-h_e_s", lambda t: t),
            ("silicone-t_em_c", "silicone-t_em_c", lambda t: t + TWO_SILICONES),
            ("silicone-h_e_c-raw", "silicone-h_e_c", lambda t: t)):
        folder = work / "captures" / name
        folder.mkdir(parents=True, exist_ok=True)
        raw = name.endswith("-raw")
        written = text((shared / source / ("capture_raw.toml" if raw else "capture.toml")).read_text())
        if raw:  # the noise given there stands for the range error, which is estimated here
            written = "\n".join("noise = 0.003" if line.startswith("noise") else line for line in written.splitlines()) + "\n"
        (folder / "capture.toml").write_text(written)
        for file in ("rest.ply", "depth", "depth_raw", "masks"):
            link = folder / file
            if not link.is_symlink():
                link.symlink_to((shared / source / file).resolve())
    return work / "captures"


def observed_points(capture, most=400):
    """Points of the object's pixels in the world [m], evenly taken."""
    camera = tomllib.loads((capture / "capture.toml").read_text())["depth"][0]
    depth, mask = (png.read(capture / (camera[key] % 0), bits)[2] for key, bits in (("images", 16), ("masks", 8)))
    pixels = [(u, v) for v, row in enumerate(depth) for u, d in enumerate(row) if d and mask[v][u]]
    points = []
    for u, v in pixels[::max(1, len(pixels) // most)]:
        z = depth[v][u] / camera["depth_scale"]
        local = ((u - camera["cx"]) / camera["fx"] * z, (v - camera["cy"]) / camera["fy"] * z, z, 1.0)
        points.append(tuple(common.dot(row, local) for row in camera["camera_to_world"][:3]))
    return points


def deformed_surface(fit):
    """Triangles of the fitted surface at rest under load, out of a body of hexahedra."""
    frame = common.read_vtu(fit / "frames/000000.vtu")
    moved, there, cells = frame["displacement [m]"], frame["points"], frame["connectivity"]
    rest = [tuple(there[3 * n + d] - moved[3 * n + d] for d in range(3)) for n in range(len(there) // 3)]
    boxes = []
    for begin in range(0, len(cells), 8):
        nodes = [int(n) for n in cells[begin:begin + 8]]
        boxes.append(([min(rest[n][d] for n in nodes) for d in range(3)], max(rest[n][0] for n in nodes) - min(rest[n][0] for n in nodes), nodes))
    data = (fit / "surface.ply").read_bytes()
    at = data.index(b"end_header\n") + 11
    counts = {w[1]: int(w[2]) for w in (line.split() for line in data[:at].decode().split("\n")) if w[:1] == ["element"]}
    vertices = []
    for k in range(counts["vertex"]):
        p = struct.unpack_from("<3d", data, at + 24 * k)
        low, size, nodes = min(boxes, key=lambda box: sum(max(l - c, c - l - box[1], 0.0) for l, c in zip(box[0], p)))
        share = lambda n: math.prod(x if rest[n][d] > low[d] + 0.5 * size else 1.0 - x for d, x in enumerate((c - l) / size for c, l in zip(p, low)))
        weights = [(n, share(n)) for n in nodes]
        vertices.append(tuple(p[d] + sum(w * moved[3 * n + d] for n, w in weights) for d in range(3)))
    at += 24 * counts["vertex"]
    return [[vertices[n] for n in struct.unpack_from("<3i", data, at + 13 * k + 1)] for k in range(counts["face"])]


def distance_to(triangle, p):
    """Of a point to a triangle."""
    a, b, c = triangle
    ab, ac, ap = ([y - x for x, y in zip(a, q)] for q in (b, c, p))
    aa, am, mm, da, dm = common.dot(ab, ab), common.dot(ab, ac), common.dot(ac, ac), common.dot(ap, ab), common.dot(ap, ac)
    area = aa * mm - am * am
    if area > 0.0:
        s, t = (mm * da - am * dm) / area, (aa * dm - am * da) / area
        if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
            return math.dist(ap, [s * x + t * y for x, y in zip(ab, ac)])
    nearest = math.inf
    for begin, end in ((a, b), (a, c), (b, c)):
        along = [y - x for x, y in zip(begin, end)]
        share = min(1.0, max(0.0, common.dot([y - x for x, y in zip(begin, p)], along) / max(common.dot(along, along), 1e-30)))
        nearest = min(nearest, math.dist(p, [x + share * y for x, y in zip(begin, along)]))
    return nearest


def median_distance(points, triangles):
    """Of the points to the surface [m]: to the nearest place of it, not along anything that was matched."""
    middles = [(common.mean(t), t) for t in triangles]
    middles = [(m, max(math.dist(m, corner) for corner in t), t) for m, t in middles]
    distances = []
    for p in points:
        nearest = math.inf
        for far, radius, triangle in sorted(((math.dist(p, m), radius, t) for m, radius, t in middles), key=lambda item: item[0] - item[1]):
            if far - radius >= nearest:
                break
            nearest = min(nearest, distance_to(triangle, p))
        distances.append(nearest)
    return common.median(distances)


def main():
    arguments = common.arguments(__doc__)
    folder = captures(arguments.work)
    fits = {}
    for name, (recording, choices) in FITS.items():
        figures = common.fit(arguments.program, folder / recording, arguments.work / name, {**NEARLY_INCOMPRESSIBLE, **choices} if choices else {})
        result = figures["result"]
        # Where the camera's pose or range is estimated, the points are not where the file has them.
        as_given = choices is not None and not any(key.endswith(".estimate") for key in choices)
        median = median_distance(observed_points(folder / recording), deformed_surface(arguments.work / name)) if as_given else None
        fits[name] = {"median_distance": common.number(median, 3), "recording": recording, "cells": choices["cells"] if choices else None,
                      "pose_is_estimated": "sensor_turn.estimate" in (choices or {}), "wall_seconds": figures["wall_seconds"],
                      "surface_rms": result["error"]["surface_rms"],
                      "verdict": result["verdict"], "uncertainty": {u["cause"]: u["std"].get("youngs_modulus", 0.0) for u in result["uncertainty"]},
                      "parameters": {key: {"value": p["value"], "std": p["std"], "interval_90": p.get("interval_90")} for key, p in result["parameters"].items() if p.get("std") is not None},
                      "correlations": result["identifiability"], "notes": result.get("notes", [])}
        print(name, fits[name]["parameters"].get("youngs_modulus"), flush=True)
    common.write_results(__file__, {"poisson_ratio": NEARLY_INCOMPRESSIBLE["poissons_ratio"], "fits": fits})


if __name__ == "__main__":
    main()
