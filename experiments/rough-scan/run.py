#!/usr/bin/env python3
"""A depth video of an object whose scan is only roughly right: the ring of examples/oracle-bounce-a, its scan bent on purpose.

Fitted with the scan as it is, with the bent one, and with the bent one corrected along with the material. The bend is no member of
the family of fields that corrects it. All three with linear tetrahedra, which a correction needs. Standard library only."""
import math
import pathlib
import struct
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

EXAMPLE = common.ROOT / "examples/oracle-bounce-a"
BEND, TWIST = 0.04, 0.03  # of the size
CHOICES = {"element": "tetrahedra", "cells": 10, "starts": 1}
FITS = {"exact": (False, {}), "bent": (True, {}), "corrected": (True, {"scan_points": 8, "scan_std": 0.02})}


def bent(path, out):
    """Writes the mesh with its vertices moved; returns their greatest and mean way over the size, and the vertices of both."""
    data = path.read_bytes()
    start = data.index(b"end_header\n") + 11
    assert data[:start].count(b"property double") == 3
    rest = common.read_vertices(path)
    low, high = ([pick(p[d] for p in rest) for d in range(3)] for pick in (min, max))
    size = max(h - l for l, h in zip(low, high))
    middle = [0.5 * (l + h) for l, h in zip(low, high)]
    moved = []
    for p in rest:
        x, y = ((p[d] - middle[d]) / size for d in (0, 1))
        moved.append((p[0], p[1] + BEND * size * 4 * x * x - BEND * size * 0.33, p[2] + TWIST * size * math.sin(2.5 * x + 4 * y)))
    out.write_bytes(data[:start] + b"".join(struct.pack("<3d", *p) for p in moved) + data[start + 24 * len(rest):])
    return rest, moved, size


def off(a, b, size):
    ways = [math.dist(p, q) / size for p, q in zip(a, b)]
    return {"rms": common.number(math.sqrt(sum(w * w for w in ways) / len(ways)), 3), "greatest": common.number(max(ways), 3)}


def main():
    arguments = common.arguments(__doc__)
    truth = common.read(EXAMPLE / "truth.json")["parameters"]
    folder = arguments.work / "captures/bent"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "capture.toml").write_text((EXAMPLE / "capture.toml").read_text())
    if not (folder / "front").is_symlink():
        (folder / "front").symlink_to(EXAMPLE / "front")
    rest, moved, size = bent(EXAMPLE / "rest.ply", folder / "rest.ply")
    fits = {}
    for name, (is_bent, choices) in FITS.items():
        figures = common.fit(arguments.program, folder if is_bent else EXAMPLE, arguments.work / name, {**CHOICES, **choices})
        result = figures.pop("result")
        parameters = {key: {"value": common.number(p["value"]), "std": common.number(p.get("std"), 2), "unit": p["unit"], "truth": truth.get(key, {}).get("value")}
                      for key, p in result["parameters"].items() if key in ("youngs_modulus", "poisson_ratio", "mass_damping", "stiffness_damping")}
        fits[name] = {"parameters": parameters, "surface_rms": common.number(result["error"]["surface_rms"], 4), "cost": common.number(result["cost"]["final"]),
                      "scan_off": off(common.read_vertices(arguments.work / name / "surface.ply"), rest, size), "commit": result["software"]["commit"],
                      "converged": figures["exit_code"] == 0, **figures}
        print(name, {k: p["value"] for k, p in parameters.items()}, fits[name]["surface_rms"], fits[name]["scan_off"], figures["wall_seconds"], flush=True)
    common.write_results(__file__, {"choices": CHOICES, "correction": FITS["corrected"][1], "bend": off(moved, rest, size), "size": size, "fits": fits})


if __name__ == "__main__":
    main()
