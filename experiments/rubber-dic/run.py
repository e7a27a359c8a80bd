#!/usr/bin/env python3
"""Speckles on a stretched rubber strip, followed by two cameras: Poisson's ratio from the strains of its middle, and from a
fit of the whole strip between its ends. No force was recorded, so no modulus follows. Standard library only."""
import csv
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import common
from common import dot, mean

FOLDER = "rubber-3d-dic"
THICKNESS = 0.002     # [m], not recorded: what is assumed for the body
MODULUS, DENSITY = 1e9, 1000.0  # of no effect: nothing but displacements is given, and a body as stiff as this does not sag
FITTED = [(3, 48), (3, 64), (6, 48), (6, 64), (10, 48), (10, 64)]  # frame, cells along the strip
# What the ends and the body do to the result: frame 3, one thing changed at a time. Name: (choices, of the capture)
VARIANTS = {
    "ends turned as all that was seen of them": ({}, {"whole_end": True}),
    "points on the outer side": ({}, {"middle": False}),
    "a body of 1 MPa, which sags": ({"youngs_modulus.start": 1e6}, {}),
    "16 quadratic tetrahedra": ({"element": "quadratic_tetrahedra", "cells": 16}, {}),
    "all of these": ({"youngs_modulus.start": 1e6, "element": "quadratic_tetrahedra", "cells": 16}, {"whole_end": True, "middle": False}),
}
END = 0.12            # share of the length at each end that is held
EDGE = 0.003          # [m] about where an end begins: it is held where, and turned as, the strip was seen there, though not stretched
CLEAR = 0.006         # [m] from the held ends, more than the strip's width: held, they do not contract as the strip does there


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    norm = math.sqrt(dot(a, a))
    return [v / norm for v in a]


def eigenvectors(S):
    """Of a symmetric 3 x 3 matrix, greatest first, by Jacobi's rotations."""
    S, V = [list(r) for r in S], [[float(i == j) for j in range(3)] for i in range(3)]
    for _ in range(50):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            if abs(S[p][q]) < 1e-300:
                continue
            angle = 0.5 * math.atan2(2 * S[p][q], S[q][q] - S[p][p])
            c, s = math.cos(angle), math.sin(angle)
            J = [[float(i == j) for j in range(3)] for i in range(3)]
            J[p][p] = J[q][q] = c
            J[p][q], J[q][p] = s, -s
            times = lambda A, B: [[sum(A[i][k] * B[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
            S = times(times([list(r) for r in zip(*J)], S), J)
            V = times(V, J)
    order = sorted(range(3), key=lambda i: -S[i][i])
    return [[V[d][i] for d in range(3)] for i in order]


def read_points():
    """frames[k]: {point: (x, y, z) [m]} in the strip's own axes: along it, across it, out of it; the middle of frame 0 at 0."""
    with open(common.shared_data() / FOLDER / "points_mm.csv", newline="") as file:
        rows = list(csv.reader(file))
    count = (len(rows[0]) - 1) // 3
    raw = [{int(r[0]): [1e-3 * float(v) for v in r[1 + 3 * k:4 + 3 * k]] for r in rows[1:]} for k in range(count)]
    missing = sum(any(map(math.isnan, p)) for frame in raw for p in frame.values())
    raw = [{n: p for n, p in frame.items() if not any(map(math.isnan, p))} for frame in raw]
    centre = mean(list(raw[0].values()))
    away = [[a - b for a, b in zip(p, centre)] for p in raw[0].values()]
    axes = eigenvectors([[sum(p[i] * p[j] for p in away) for j in range(3)] for i in range(3)])
    axes[2] = unit(cross(axes[0], axes[1]))
    frames = [{n: [dot(axis, [a - b for a, b in zip(p, centre)]) for axis in axes] for n, p in f.items()} for f in raw]
    return frames, missing


def solve3(A, b):
    """A x = b by Cramer's rule."""
    det = lambda M: dot(M[0], cross(M[1], M[2]))
    columns = [list(c) for c in zip(*A)]
    return [det([b if i == k else columns[i] for i in range(3)]) / det(columns) for k in range(3)]


def stretches(rest, now, within):
    """Greatest and least stretch of the plane, of the affine map that fits best where |x| <= within at rest; its rms [m]."""
    names = [n for n in rest if n in now and abs(rest[n][0]) <= within]
    design = [[1.0, rest[n][0], rest[n][1]] for n in names]
    normal = [[sum(r[i] * r[j] for r in design) for j in range(3)] for i in range(3)]
    maps = [solve3(normal, [sum(r[i] * now[n][d] for r, n in zip(design, names)) for i in range(3)]) for d in range(3)]
    squares = sum((dot(r, maps[d]) - now[n][d]) ** 2 for r, n in zip(design, names) for d in range(3))
    a, b = [m[1] for m in maps], [m[2] for m in maps]
    half, product = 0.5 * (dot(a, a) + dot(b, b)), dot(a, a) * dot(b, b) - dot(a, b) ** 2
    root = math.sqrt(max(half * half - product, 0.0))
    return math.sqrt(half + root), math.sqrt(half - root), math.sqrt(squares / len(names)), len(names)


def affine(rest, now, x, low, high):
    """Of the points in between: value at (x, 0), change along and change across, of each coordinate, by least squares."""
    names = [n for n in rest if n in now and low < rest[n][0] < high]
    design = [[1.0, rest[n][0] - x, rest[n][1]] for n in names]
    normal = [[sum(r[i] * r[j] for r in design) for j in range(3)] for i in range(3)]
    return [solve3(normal, [sum(r[i] * now[n][d] for r, n in zip(design, names)) for i in range(3)]) for d in range(3)]


def pose_at(rest, now, x, turned_by):
    """R, t of the strip's cross-section at x: where it was seen, and the rotation without the stretch of the affine map of the points
    in `turned_by`, an interval."""
    at = [m[0] for m in affine(rest, now, x, x - EDGE, x + EDGE)]
    maps = affine(rest, now, x, *turned_by)
    along, across = unit([m[1] for m in maps]), unit([m[2] for m in maps])
    # What the shear takes from the right angle between them, each gives half of.
    both, either = unit([a + b for a, b in zip(along, across)]), unit([a - b for a, b in zip(along, across)])
    along, across = unit([a + b for a, b in zip(both, either)]), unit([a - b for a, b in zip(both, either)])
    R = [list(row) for row in zip(along, across, cross(along, across))]
    return R, [at[d] - R[d][0] * x for d in range(3)]


def slab(rest, middle):
    """A plate whose middle (else: outer side) the seen points are, joined along the border: vertices, triangles. They were seen on one
    side; but ends that are held do not grow thinner, and that side would sink between them as it did not. Points that were not
    seen at rest are left out with their triangles."""
    lines = (common.shared_data() / FOLDER / "rest_surface.obj").read_text().split("\n")
    faces = [[int(w.split("/")[0]) - 1 for w in l.split()[1:4]] for l in lines if l.startswith("f ")]
    faces = [f for f in faces if all(n in rest for n in f)]
    if sum(cross([b - a for a, b in zip(rest[f[0]], rest[f[1]])], [b - a for a, b in zip(rest[f[0]], rest[f[2]])])[2] for f in faces) < 0:
        faces = [f[::-1] for f in faces]
    used = sorted({n for f in faces for n in f})
    number = {n: i for i, n in enumerate(used)}
    vertices = [[rest[n][0], rest[n][1], rest[n][2] + side * THICKNESS] for side in ((0.5, -0.5) if middle else (0.0, -1.0)) for n in used]
    half = len(used)
    top = [[number[n] for n in f] for f in faces]
    edges = {(f[i], f[(i + 1) % 3]) for f in top for i in range(3)}
    side = [t for a, b in sorted(edges) if (b, a) not in edges for t in ([b, a, a + half], [b, a + half, b + half])]
    return vertices, top + [[n + half for n in f[::-1]] for f in top] + side, used


def write_capture(folder, frames, k, middle=True, whole_end=False):
    folder.mkdir(parents=True, exist_ok=True)
    rest, now = frames[0], frames[k]
    vertices, triangles, used = slab(rest, middle)
    (folder / "rest.obj").write_text("".join("v " + " ".join(f"{c:.9g}" for c in v) + "\n" for v in vertices) +
                                     "".join("f " + " ".join(str(n + 1) for n in t) + "\n" for t in triangles))
    least, most = min(v[0] for v in vertices), max(v[0] for v in vertices)
    inner = (least + END * (most - least), most - END * (most - least))
    seen = [n for n in used if n in now and inner[0] + CLEAR < rest[n][0] < inner[1] - CLEAR]
    row = lambda n, p: f"{n}," + ",".join(f"{c:.9g}" for c in p)
    (folder / "rest.csv").write_text("id,x,y,z\n" + "".join(row(n, rest[n]) + "\n" for n in seen))
    (folder / "track.csv").write_text("frame,id,x,y,z\n" + "".join(f"0,{row(n, now[n])}\n" for n in seen))
    held = []
    for x, normal in zip(inner, (-1.0, 1.0)):
        R, t = pose_at(rest, now, x, ((x, math.inf) if normal > 0 else (-math.inf, x)) if whole_end else (x - EDGE, x + EDGE))
        matrix = [R[i] + [t[i]] for i in range(3)] + [[0.0, 0.0, 0.0, 1.0]]
        held.append({"half_space": {"point": [x, 0.0, 0.0], "normal": [normal, 0.0, 0.0]}, "displaced_to": matrix})
    common.write_capture(
        folder, f"rubber strip, frame {k}", object={"surface": "rest.obj", "density": DENSITY},
        world={"gravity": [0.0, 0.0, -9.81]}, timing={"frame_rate": 1.0, "frame_count": 1, "static": True}, fixed=held,
        markers=[{"rest": "rest.csv", "track": "track.csv"}])


def main():
    arguments = common.arguments(__doc__)
    frames, missing = read_points()
    half = max(p[0] for p in frames[0].values())
    strains = []
    for k in range(1, len(frames)):
        along, across, rms, points = stretches(frames[0], frames[k], 0.3 * half)
        strains.append({"frame": k, "points": points, "along": common.number(along), "across": common.number(across),
                        "rms_mm": common.number(1e3 * rms, 3), "ratio_of_logarithms": common.number(-math.log(across) / math.log(along), 4)})
    pieces = []
    for x in range(-20, 21, 4):
        rest_of, now_of = affine(frames[0], frames[0], 1e-3 * x, 1e-3 * (x - 2), 1e-3 * (x + 2)), affine(frames[0], frames[3], 1e-3 * x, 1e-3 * (x - 2), 1e-3 * (x + 2))
        pieces.append({"x_mm": x, "along": common.number(now_of[0][1], 4), "slope_sideways": common.number(now_of[1][1] - rest_of[1][1], 3),
                       "twist": common.number(now_of[2][2] - rest_of[2][2], 3)})
    fits = []
    plans = [("", k, {"cells": cells}, {}) for k, cells in FITTED]
    plans += [(name, 3, {"cells": 48, **choices}, change) for name, (choices, change) in VARIANTS.items()]
    for i, (variant, k, choices, change) in enumerate(plans):
        write_capture(arguments.work / f"capture-{i}", frames, k, **change)
        choices = {"youngs_modulus.start": MODULUS, "youngs_modulus.estimate": False, "poissons_ratio.prior_std": 5.0, "coarse_cells": 12, **choices}
        figures = common.fit(arguments.program, arguments.work / f"capture-{i}", arguments.work / f"fit-{i}", choices)
        result = figures["result"]
        nu = result["parameters"]["poisson_ratio"]
        fits.append({"variant": variant, "frame": k, "cells": choices["cells"], "poisson_ratio": common.number(nu["value"], 4),
                     "std": common.number(nu.get("std"), 2),
                     "marker_rms_mm": common.number(1e3 * (result["error"].get("marker_rms") or 0.0), 3),
                     "points": result["error"].get("points"), "wall_seconds": figures["wall_seconds"],
                     "converged": figures["exit_code"] == 0})
    common.write_results(__file__, {"points": len(frames[0]), "frames": len(frames), "missing": missing, "thickness": THICKNESS,
                                    "strains": strains, "pieces": pieces, "fits": fits})


if __name__ == "__main__":
    main()
