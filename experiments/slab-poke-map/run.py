#!/usr/bin/env python3
"""A soft slab on a table, scanned from above and poked at 90 places: a third of the pokes fitted, the others predicted.

Recordings are read where they lie; nothing of them is kept but figures and a picture, which needs matplotlib."""
import csv
import json
import math
import pathlib
import struct
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
import common

TABLE = 0.865                 # [m], by the recording's notes
TIP_RADIUS = 5e-3             # assumed: it is not stated [m]
POISSONS_RATIO = 0.45         # assumed
DEPTHS = (3e-3,)              # behind first touch that are compared [m]
WINDOW = 0.15                 # half a force's mean over the trace [mm]
CELL = 14e-3                  # of the body's quadratic tetrahedra [m]
FITTED = 3                    # of so many pokes one is fitted
CONTROLS = (1, 6)             # moduli of the field
FORCE_NOISE = 0.1             # [N]
IMAGE = common.ROOT / "docs/images/slab-poke-map.png"


def read_cloud(path, every=3):
    data = path.read_bytes()
    begin = data.index(b"end_header\n") + 11
    count = int(data[:begin].split(b"element vertex ")[1].split()[0])
    row = struct.Struct("<6f3B")
    return [row.unpack_from(data, begin + i * row.size)[:3] for i in range(0, count, every)]


def read_pokes():
    folder = common.shared_data() / "slab-poke-map"
    with open(folder / "poke_points.csv", newline="") as file:
        pokes = {r["poke"]: {"point": [float(r[f"{c}_m"]) for c in "xyz"], "normal": [float(r[f"n_{c}"]) for c in "xyz"], "trace": []} for r in csv.DictReader(file)}
    with open(folder / "poke_curves.csv", newline="") as file:
        for r in csv.DictReader(file):
            pokes[r["poke"]]["trace"].append((float(r["displacement_mm"]), float(r["force_n"])))
    return list(pokes.values())


def solve(A, b):
    """A small symmetric system by elimination."""
    n = len(b)
    M = [row[:] + [v] for row, v in zip(A, b)]
    for i in range(n):
        for k in range(i + 1, n):
            f = M[k][i] / M[i][i]
            M[k] = [x - f * y for x, y in zip(M[k], M[i])]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (M[i][n] - sum(M[i][k] * x[k] for k in range(i + 1, n))) / M[i][i]
    return x


def first_touch(trace):
    """(displacement [mm], force before) where a level force turns into a growing parabola: least squares up to 1.2 N."""
    end = next((i for i, (_, f) in enumerate(trace) if f > 1.2), len(trace))
    part = trace[:end:6]
    best = None
    for step in range(5, len(part) - 8, 2):
        c = part[step][0]
        rows = [(1.0, max(d - c, 0.0), max(d - c, 0.0)**2) for d, _ in part]
        A = [[sum(r[i] * r[k] for r in rows) for k in range(3)] for i in range(3)]
        A[1][1] += 1e-9
        A[2][2] += 1e-9
        x = solve(A, [sum(r[i] * f for r, (_, f) in zip(rows, part)) for i in range(3)])
        if x[1] < 0 or x[2] < 0:  # force grows, and ever faster
            continue
        left = sum((f - common.dot(r, x))**2 for r, (_, f) in zip(rows, part))
        if best is None or left < best[0]:
            best = (left, c, x[0])
    return best[1:] if best else None


def mean_force(trace, place):
    near = [f for d, f in trace if abs(d - place) < WINDOW]
    return sum(near) / len(near) if near else None


def prepare(pokes):
    """Those with a touch, a depth that is compared, and their forces less that before the touch."""
    good = []
    for poke in pokes:
        found = first_touch(poke["trace"])
        if not found:
            continue
        touch, before = found
        depths, forces = [], []
        for depth in DEPTHS:
            place = touch + 1e3 * depth
            force = mean_force(poke["trace"], place) if place < poke["trace"][-1][0] - WINDOW else None
            if force is not None:
                depths.append(depth)
                forces.append(force - before)
        if depths and forces[-1] > 3 * FORCE_NOISE:
            good.append({"point": poke["point"], "normal": poke["normal"], "touch": touch, "depths": depths, "forces": forces})
    return good


def errors(pokes, forces, of_fitted):
    """Relative errors: rms over all, of each poke's own greatest force; median and upper quartile of |error| at the deepest."""
    relative, deepest, lost = [], [], 0
    for poke, model in zip(pokes, forces):
        if poke["fitted"] != of_fitted:
            continue
        if None in model:
            lost += 1
            continue
        relative += [(m - f) / max(poke["forces"]) for m, f in zip(model, poke["forces"])]
        deepest.append(abs(model[-1] / poke["forces"][-1] - 1))
    deepest.sort()
    return {"rms": math.sqrt(sum(e * e for e in relative) / len(relative)), "median_deepest": common.median(deepest), "ninety_deepest": deepest[int(0.9 * len(deepest))], "pokes": len(deepest), "not_solved": lost}


def draw(pokes, fits):
    plt = common.pyplot()
    if not plt:
        return
    figure, panels = plt.subplots(1, 3, figsize=(16, 5))
    last = [p["forces"][-1] for p in pokes]
    for panel, key in ((panels[0], "measured"), (panels[1], "predicted")):
        values = last if key == "measured" else [f[-1] if f[-1] is not None else float("nan") for f in fits[-1]["forces"]]
        dots = panel.scatter([1e3 * p["point"][1] for p in pokes], [1e3 * p["point"][0] for p in pokes], c=values, cmap="viridis", vmin=0, vmax=2, s=60,
                             edgecolors=["#c00" if not p["fitted"] else "none" for p in pokes])
        panel.set_aspect("equal")
        panel.set_title(("measured" if key == "measured" else f"simulated, {fits[-1]['controls']} moduli") + " force at the deepest [N]; red: not fitted", fontsize=9)
        panel.set_xlabel("y [mm]")
        panel.set_ylabel("x [mm]")
        figure.colorbar(dots, ax=panel, shrink=0.7)
    for f, colour in zip(fits, ("#b5401f", "#1f5fa8")):
        for fitted, mark in ((True, "."), (False, "o")):
            chosen = [(p["forces"][-1], m[-1]) for p, m in zip(pokes, f["forces"]) if p["fitted"] == fitted and m[-1] is not None]
            panels[2].plot([c[0] for c in chosen], [c[1] for c in chosen], mark, color=colour, mfc="none" if mark == "o" else colour, label=f"{f['controls']} modul{'i' if f['controls'] > 1 else 'us'}, {'fitted' if fitted else 'predicted'}")
    panels[2].plot([0, 2.2], [0, 2.2], color="#999", lw=0.8)
    panels[2].set_xlabel("measured [N]")
    panels[2].set_ylabel("simulated [N]")
    panels[2].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(IMAGE, dpi=80)


def main():
    arguments = common.arguments(__doc__.splitlines()[0])
    program = arguments.program.parent.parent / "experiments/pliant_slab"
    every = read_pokes()
    pokes = prepare(every)
    for i, poke in enumerate(pokes):
        poke["fitted"] = i % FITTED == 0
    touch = common.median([p["touch"] for p in pokes])
    print(len(pokes), "pokes, median touch", touch, "forces", [common.median([p["forces"][k] for p in pokes if len(p["forces"]) > k]) for k in range(len(DEPTHS))], flush=True)
    cloud = read_cloud(common.shared_data() / "slab-poke-map/cloud.ply")
    # Of a half space under a ball (Hertz), the median of the fitted pokes.
    start = common.median([0.75 * p["forces"][-1] * (1 - POISSONS_RATIO**2) / (math.sqrt(TIP_RADIUS) * p["depths"][-1]**1.5) for p in pokes if p["fitted"]])
    request = {"cloud": cloud, "table": TABLE, "raise": -1e-3 * touch, "cell": CELL, "tip_radius": TIP_RADIUS, "poisson_ratio": POISSONS_RATIO, "controls": CONTROLS, "terms": 0, "start_modulus": start,
               "force_noise": FORCE_NOISE, "pokes": [{k: p[k] for k in ("point", "normal", "depths", "forces", "fitted")} for p in pokes]}
    out = arguments.work / "slab.json"
    if not out.exists():
        path = arguments.work / "slab-request.json"
        path.write_text(json.dumps(request))
        answer = subprocess.run([program, f"request={path}"], check=True, stdout=subprocess.PIPE, text=True).stdout
        out.write_text(answer)
    answer = common.read(out)
    figures = {"pokes": len(every), "used": len(pokes), "touch": touch, "tip_radius": TIP_RADIUS, "poisson_ratio": POISSONS_RATIO, "depths": DEPTHS, "one_in": FITTED, "hertz_modulus": start,
               **{k: answer[k] for k in ("nodes", "elements", "volume")}, "fits": []}
    for f in answer["fits"]:
        row = {k: f[k] for k in ("controls", "succeeded", "reason", "evaluations", "seconds")}
        if f["succeeded"]:
            row.update(theta=f["theta"], fitted=errors(pokes, f["forces"], True), predicted=errors(pokes, f["forces"], False))
        figures["fits"].append(row)
        print(row, flush=True)
    common.write_results(__file__, figures)
    draw(pokes, [f for f in answer["fits"] if f["succeeded"]])


if __name__ == "__main__":
    main()
