#!/usr/bin/env python3
"""A plant that is scanned as it sags, pulled aside and let go: a stem and three leaves of five moduli, three depth sensors fused to
clouds, 250 frames at 30 Hz (Wang et al. 2015, section 7). Neither its load-free shape nor its material is known.

twin.py makes the recording by other physics (simulator.py: other elements, another material law, another integrator); it needs numpy,
scipy and gmsh, in the interpreter that --python names. Fitted with no choice of ours, with tracking and estimation together, with as many
control points as the evidence supports, and with control points that a user placed at the joints and on the leaves.
truth.json and the true shapes are read for judging only. Standard library only, but for twin.py."""
import csv
import json
import math
import pathlib
import struct
import subprocess
import sys
import time
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

IMAGE = common.ROOT / "docs/images/plant.png"
TITLES = {"auto": "control points by evidence", "placed": "control points placed", "together": "tracking and points"}
REST_MODULUS, REST_CELLS = 4.5e6, (12, 24, 40, 64)
NAMES = ["poisson_ratio", "mass_damping", "stiffness_damping"]
# Where one who looks at the scan would place control points: at the foot, joints and tip of the stem, and on each leaf, a third of its length out.
PLACED = {"foot": [0.0, 0.0, 0.0], "low joint": [0.011, 0.114, 0.002], "middle joint": [0.023, 0.190, 0.004], "top joint": [0.036, 0.260, 0.007],
          "tip": [0.045, 0.300, 0.008], "low leaf": [-0.032, 0.126, 0.023], "middle leaf": [0.056, 0.211, 0.031], "top leaf": [0.044, 0.289, -0.024]}
# Of the stem, which is so thick there: what is farther from the line through its foot and joints is a leaf's.
STEM_RADIUS = 0.014
STEM, LEAVES = ["foot", "low joint", "middle joint", "top joint", "tip"], ["low leaf", "middle leaf", "top leaf"]
LAST_HELD = 4  # frame in which the twin is let go: twin.py's start_frame
# name: (capture, choices)
FITS = {
    "no-choice": ("plant", {}),
    "auto": ("plant", {"control_points": "auto"}),
    "placed": ("placed", {}),
    "together": ("plant", {"tracking": "both"}),
    # Of the first 50 frames: a fifth of the steps.
    "placed-beginning": ("placed", {"span": 0.2}),
    "painted-beginning": ("painted", {"span": 0.2}),
    "internodes-beginning": ("internodes", {"span": 0.2}),
    # Not a user's: the true surface at rest in the place of the scan, to tell what the scan's own errors do.
    "true-scan-beginning": ("true-scan", {"span": 0.2}),
    "loop-auto": ("plant", {"tracking": "loop", "control_points": "auto"}),
}


def make_recording(python, work):
    """Recording of the twin, and the figures of its checks."""
    folder, checks = work / "recording", work / "verify.json"
    if not checks.exists():
        subprocess.run([python, HERE / "simulator_checks.py", checks], check=True)
    if not (folder / "truth.json").exists():
        subprocess.run([python, HERE / "twin.py", "--out", folder], check=True)
    return folder, common.read(checks)


def link_files(recording, folder, scan="rest.ply"):
    """A scan and the clouds of the recording beside another capture.toml."""
    for name, file in (("rest.ply", scan), ("clouds", "clouds")):
        if not (folder / name).is_symlink():
            (folder / name).symlink_to((recording / file).resolve())


def with_placed_points(recording, folder):
    folder.mkdir(parents=True, exist_ok=True)
    text = (recording / "capture.toml").read_text()
    for name, point in PLACED.items():
        text += f'\n[[control]]\nname = "{name}"\npoint = {common.toml(point)}\n'
    (folder / "capture.toml").write_text(text)
    link_files(recording, folder)
    return folder


def from_segment(p, a, b):
    """Distance of a place from a segment."""
    along = [q - o for o, q in zip(a, b)]
    share = sum((c - o) * d for c, o, d in zip(p, a, along)) / sum(d * d for d in along)
    return math.dist(p, [o + min(1.0, max(0.0, share)) * d for o, d in zip(a, along)])


def painted_parts(recording, internodes):
    """The part of each vertex of the scan, as one would paint them who looks at it: leaves, and the stem as a whole, or below, between and above
    its lower joints."""
    stem = [PLACED[name] for name in STEM]
    between = ["low internode", "middle internode", "high internode", "high internode"] if internodes else ["stem"] * (len(stem) - 1)

    def part_of(p):
        off, part = min((from_segment(p, a, b), name) for a, b, name in zip(stem, stem[1:], between))
        return part if off < STEM_RADIUS else min(LEAVES, key=lambda name: math.dist(p, PLACED[name]))

    return [part_of(p) for p in common.read_vertices(recording / "rest.ply")], [*dict.fromkeys(between), *LEAVES]


def with_painted_parts(recording, folder, internodes, scan="rest.ply"):
    """Each painted part has a modulus of its own, by vertex."""
    folder.mkdir(parents=True, exist_ok=True)
    painted, parts = painted_parts(recording, internodes)
    text = (recording / "capture.toml").read_text()
    for part in parts:
        file = part.replace(" ", "-") + ".txt"
        (folder / file).write_text("".join(f"{int(o == part)}\n" for o in painted))
        text += f'\n[[control]]\nname = "{part}"\nweights = "{file}"\n'
    if scan != "rest.ply":
        text = text.replace(next(line for line in text.splitlines(True) if line.startswith("surface_noise")), "")
    (folder / "capture.toml").write_text(text)
    link_files(recording, folder, scan)
    return folder


def scan_errors(recording):
    """By how much the scan lies outside the true surface at rest, along its normals: mean and rms over each part [m]."""
    scan, true = (common.read_vertices(recording / file) for file in ("rest.ply", "truth/static.ply"))
    normals = [[0.0, 0.0, 0.0] for _ in true]
    for face in faces_of(recording / "truth/static.ply"):
        a, b, c = (true[k] for k in face)
        u, v = ([q - o for o, q in zip(a, to)] for to in (b, c))
        area = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        for k in face:
            normals[k] = [n + d for n, d in zip(normals[k], area)]
    off = [sum((p - q) * d for p, q, d in zip(*row)) / math.hypot(*row[2]) for row in zip(scan, true, normals)]
    painted, parts = painted_parts(recording, internodes=True)
    of = {part: [o for o, name in zip(off, painted) if name == part] for part in parts}
    return {part: {"mean": common.number(sum(o) / len(o), 3), "rms": common.number(math.sqrt(sum(d * d for d in o) / len(o)), 3)} for part, o in of.items()}


class Nearest:
    """The nearest of many places, by cells of a grid."""

    def __init__(self, step):
        self.step, self.cells = step, {}

    def key(self, p):
        return tuple(math.floor(c / self.step) for c in p)

    def add(self, p, value):
        self.cells.setdefault(self.key(p), []).append((p, value))

    def at(self, p):
        k = self.key(p)
        for reach in (1, 2, 4, 8):
            around = [range(c - reach, c + reach + 1) for c in k]
            near = [e for x in around[0] for y in around[1] for z in around[2] for e in self.cells.get((x, y, z), ())]
            if near:
                return min(near, key=lambda e: math.dist(p, e[0]))[1]
        raise ValueError(f"nothing near {p}")


def true_cells(recording):
    """Zone and true modulus of the twin's cells."""
    cells = Nearest(0.01)
    with open(recording / "truth/cells.csv", newline="") as file:
        for row in csv.DictReader(file):
            cells.add(tuple(float(row[c]) for c in "xyz"), (int(row["zone"]), float(row["youngs_modulus"])))
    return cells


def volume_of(corners):
    u, v, w = ([c - o for c, o in zip(corner, corners[0])] for corner in corners[1:])
    return abs(u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) + u[2] * (v[0] * w[1] - v[1] * w[0])) / 6


def zones_of(model, zones, truth):
    """Mean of Young's modulus over each zone's elements, by volume, and beside it the zone's truth."""
    a = common.read_vtu(model)
    points, nodes, ends = a["points"], a["connectivity"], a["offsets"]
    place = lambda n: points[3 * int(n):3 * int(n) + 3]
    sums, begin, logs = [[0.0, 0.0, 0.0] for _ in truth], 0, [0.0, 0.0]
    for end, modulus in zip(ends, a["youngs_modulus [Pa]"]):
        corners = [place(n) for n in nodes[begin:begin + 4]]
        begin = int(end)
        volume = volume_of(corners)
        zone, true = zones.at(common.mean(corners))
        sums[zone][0] += volume
        sums[zone][1] += volume * modulus
        sums[zone][2] += volume * math.log(modulus)
        logs[0] += volume
        logs[1] += volume * abs(math.log(modulus / true))
    found = [{"name": t["name"], "mean": common.number(E / v), "mean_of_log": common.number(math.exp(l / v)), "truth": common.number(t["mean"]),
              "truth_of_log": common.number(t["mean_of_log"]), "elements_volume": common.number(v / t["volume"], 3)} for (v, E, l), t in zip(sums, truth)]
    return found, common.number(math.exp(logs[1] / logs[0]) - 1, 3), len(ends)


def sagged(program, fit, places):
    """Where places of a fit's load-free surface come to rest under gravity: as the nearest nodes of its volume do."""
    places_at_rest, moved = common.at_rest(program, fit)
    nodes = Nearest(0.008)
    for n, place in enumerate(places_at_rest):
        nodes.add(place, n)
    return [tuple(p[d] + moved[3 * nodes.at(p) + d] for d in range(3)) for p in places]


def shape(program, fit, recording):
    """The load-free shape, and what it sags into, against the true ones, vertex by vertex."""
    reference, static = (common.read_vertices(recording / f"truth/{name}.ply") for name in ("reference", "static"))
    found = common.read_vertices(fit / "surface.ply")
    size = max(max(p[d] for p in reference) - min(p[d] for p in reference) for d in range(3))
    rms = lambda values: math.sqrt(sum(v * v for v in values) / len(values))
    off = [math.dist(p, q) for p, q in zip(found, reference)]
    sag = [math.dist(p, q) for p, q in zip(static, reference)]
    rest = sagged(program, fit, found)
    own = [math.dist([s - f for s, f in zip(p, q)], [s - r for s, r in zip(o, t)]) for p, q, o, t in zip(rest, found, static, reference)]
    return {"size": common.number(size), "true_sag_rms": common.number(rms(sag)), "true_sag_greatest": common.number(max(sag)), "load_free_rms": common.number(rms(off) / size, 3),
            "load_free_greatest": common.number(max(off) / size, 3), "sag_error": common.number(rms(own) / rms(sag), 3),
            "static_rms": common.number(rms([math.dist(p, q) for p, q in zip(rest, static)]) / size, 3)}


def meshes(program, recording, work, truth):
    """What meshes of several sizes make of the scan: the load-free shape of one even material, by `pliant rest`."""
    rows, whole = [], sum(z["volume"] for z in truth["zones"])
    for cells in REST_CELLS:
        out = work / f"rest-{cells}"
        if not (out / "rest.json").exists():
            common.run(program, "rest", recording, "--out", out, "--set", f"youngs_modulus={REST_MODULUS}", "--set", f"cells={cells}", allowed=(0, 3))
        rest = common.read(out / "rest.json")
        row = {"cells": cells, "elements": rest["elements"], "nodes": rest["nodes"], "found": rest["found"], "seconds": common.number(rest["seconds"], 3)}
        if rest["found"]:
            a, volume, begin = common.read_vtu(out / "model.vtu"), 0.0, 0
            for end in a["offsets"]:
                volume += volume_of([a["points"][3 * int(n):3 * int(n) + 3] for n in a["connectivity"][begin:begin + 4]])
                begin = int(end)
            row |= {"volume": common.number(volume / whole, 4), "sag": common.number(rest["sag"], 4)}
        else:
            row["reason"] = rest["reason"]
        rows.append(row)
    return {"youngs_modulus": REST_MODULUS, "rows": rows}


def registered(program, recording, work):
    """How far the tracker registers the plant from the truth in the last frame in which it was held, with no choices: every twentieth vertex of the scan."""
    capture, out = work / "captures/held", work / "held"
    capture.mkdir(parents=True, exist_ok=True)
    (capture / "capture.toml").write_text((recording / "capture.toml").read_text().replace("frame_count = 250", "frame_count = 6"))
    link_files(recording, capture)
    scan, pulled = (common.read_vertices(recording / file) for file in ("rest.ply", "truth/pulled.ply"))
    followed = range(0, len(scan), 20)
    points = work / "followed.csv"
    points.write_text("id,x,y,z\n" + "".join(f"{i},{','.join(map(str, scan[i]))}\n" for i in followed))
    if not (out / "points.csv").exists():
        common.run(program, "track", capture, "--out", out, "--points", points, "--no-pictures")
    with open(out / "points.csv", newline="") as file:
        there = {int(row["id"]): tuple(float(row[c]) for c in "xyz") for row in csv.DictReader(file) if row["frame"] == str(LAST_HELD)}
    off, way = sorted(math.dist(there[i], pulled[i]) for i in followed), [math.dist(scan[i], pulled[i]) for i in followed]
    rms = lambda values: math.sqrt(sum(v * v for v in values) / len(values))
    return {"points": len(off), "rms": common.number(rms(off), 3), "median": common.number(off[len(off) // 2], 3), "greatest": common.number(off[-1], 3),
            "way_rms": common.number(rms(way), 3), "way_greatest": common.number(max(way), 3)}


def judged_fit(program, recording, captures, name, work, zones, truth, threads, limit):
    capture, choices = FITS[name]
    refusal = work / name / "refused.json"
    if refusal.exists():
        return common.read(refusal)
    begin = time.monotonic()
    try:
        figures = common.fit(program, captures[capture], work / name, choices, threads, limit)
    except SystemExit as told:  # the program says why
        version = subprocess.run([program, "--version"], capture_output=True, text=True).stdout.strip()
        refused = {"choices": choices, "capture": capture, "threads": threads, "refused": str(told).strip().splitlines()[-1], "wall_seconds": round(time.monotonic() - begin, 1), "version": version}
        refusal.write_text(json.dumps(refused))
        return refused
    result = figures.pop("result")
    parameters = {key: {"value": common.number(p["value"]), "std": common.number(p.get("std"), 2), "interval_90": p.get("interval_90"), "unit": p["unit"],
                        "truth": truth["parameters"][key]["value"]} for key, p in result["parameters"].items() if key in NAMES}
    field = result.get("fields", {}).get("youngs_modulus", {})
    moduli = {key: common.number(p["value"]) for key, p in result["parameters"].items() if key.startswith("youngs_modulus")}
    found, off, elements = zones_of((work / name / "model.toml").with_suffix(".vtu"), zones, truth["zones"])
    tracking = result.get("tracking")
    pulled_at = tomllib.loads((work / name / "model.toml").read_text())["initial"].get("pulled_at", [])
    return {"choices": choices, "capture": capture, "threads": threads, "parameters": parameters, "moduli": moduli,
            "field": [{"point": [common.number(v, 4) for v in c[:3]], "value": common.number(c[3]), "std": common.number(c[4], 2)} for c in field.get("control_points", [])],
            "tried": field.get("tried"), "zones": found, "mean_factor_off": off, "elements": elements, "surface_rms": common.number(result["error"]["surface_rms"], 4),
            "cost": common.number(result["cost"]["final"]), "verdict": result.get("verdict"), "pulled_at": pulled_at, "reasons": result.get("reasons"),
            "tracking": tracking and {"kept": tracking.get("kept"), "why": tracking.get("why"), "rounds": len(tracking.get("rounds", []))},
            "forward_steps": result["time"].get("forward_steps"), "converged": figures["exit_code"] == 0, "commit": result["software"]["commit"], "limit": limit, **figures,
            **shape(program, work / name, recording)}


def faces_of(path):
    """Triangles of a PLY mesh of triangles: binary, places in double precision."""
    data = path.read_bytes()
    begin = data.index(b"end_header\n") + 11
    head = data[:begin].decode().splitlines()
    count = lambda what: int(next(line for line in head if line.startswith(f"element {what}")).split()[2])
    width = 24 if "property double x" in head else 12
    return [struct.unpack_from("<iii", data, begin + width * count("vertex") + 13 * t + 1) for t in range(count("face"))]


def moduli_of_elements(model):
    """Young's modulus of the nearest element of a fit, at places of its load-free shape."""
    a, near, begin = common.read_vtu(model), Nearest(0.01), 0
    for end, modulus in zip(a["offsets"], a["youngs_modulus [Pa]"]):
        near.add(common.mean([a["points"][3 * int(n):3 * int(n) + 3] for n in a["connectivity"][begin:begin + 4]]), modulus)
        begin = int(end)
    return near


def picture(recording, fits, work, cells):
    """The plant's shapes; the true moduli, and those of fits, on its surface."""
    plt = common.pyplot()
    if not plt:
        return
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import LogNorm
    faces = faces_of(recording / "truth/reference.ply")
    shapes = {name: common.read_vertices(recording / f"truth/{name}.ply") for name in ("reference", "static", "pulled")}
    turn = math.radians(30.0)  # seen from aside and a little from above

    def seen(p):
        x, z = math.cos(turn) * p[0] - math.sin(turn) * p[2], math.sin(turn) * p[0] + math.cos(turn) * p[2]
        return 1e3 * x, 1e3 * (p[1] - 0.2 * z), z + 0.2 * p[1]

    def draw(panel, points, colour_of, alpha=1.0):
        flat, parts = [seen(p) for p in points], []
        for a, b, c in faces:
            pa, pb, pc = flat[a], flat[b], flat[c]
            facing = (pb[0] - pa[0]) * (pc[1] - pa[1]) - (pb[1] - pa[1]) * (pc[0] - pa[0])
            if facing > 0:
                parts.append((pa[2] + pb[2] + pc[2], [pa[:2], pb[:2], pc[:2]], colour_of(common.mean([points[k] for k in (a, b, c)]))))
        parts.sort(key=lambda part: part[0])
        panel.add_collection(PolyCollection([part[1] for part in parts], facecolors=[part[2] for part in parts], edgecolors="none", alpha=alpha, antialiased=False))

    scale, colours = LogNorm(1.5e6, 1.0e7), plt.get_cmap("viridis")
    shown = [name for name in ("auto", "placed", "together") if "zones" in fits.get(name, {})][:2]
    figure, panels = plt.subplots(1, 2 + len(shown), figsize=(4.2 * (2 + len(shown)), 6), sharex=True, sharey=True)
    for name, colour in (("pulled", "#d9a35f"), ("static", "#5a9c5a"), ("reference", "#9a9a9a")):
        draw(panels[0], shapes[name], lambda p: colour, 0.8)
    panels[0].set_title("free of load: grey; scanned: green;\npulled aside: brown", fontsize=8)
    draw(panels[1], shapes["reference"], lambda p: colours(scale(cells.at(p)[1])))
    panels[1].set_title("Young's modulus:\nthe truth", fontsize=8)
    for panel, name in zip(panels[2:], shown):
        near = moduli_of_elements(work / name / "model.vtu")
        draw(panel, common.read_vertices(work / name / "surface.ply"), lambda p: colours(scale(near.at(p))))
        panel.set_title(f"fitted:\n{TITLES[name]}", fontsize=8)
    for panel in panels:
        panel.set_aspect("equal")
        panel.autoscale_view()
        panel.set_xlabel("mm", fontsize=8)
    bar = figure.colorbar(plt.cm.ScalarMappable(norm=scale, cmap=colours), ax=list(panels), shrink=0.6, pad=0.01, ticks=[2e6, 4e6, 8e6], format=lambda v, _: f"{1e-6 * v:g} MPa")
    bar.ax.minorticks_off()
    figure.savefig(IMAGE, dpi=75, bbox_inches="tight")


def main():
    arguments = common.arguments(__doc__, gather={"action": "store_true", "help": "no new fits: gather those that are in --work; a refusal (refused.json) is not tried again"},
                                 threads={"type": int, "help": "most threads of a fit"}, limit={"type": float, "help": "seconds after which a fit is asked to stop with the best that it has"}, only={"help": "run or gather only this fit, with those that are done"},
                                 python={"default": sys.executable, "help": "interpreter with numpy, scipy and gmsh, for twin.py"})
    recording, checks = make_recording(arguments.python, arguments.work)
    truth = common.read(recording / "truth.json")
    common.run(arguments.program, "check", recording)
    captures = {"plant": recording, "placed": with_placed_points(recording, arguments.work / "captures/placed"),
                "painted": with_painted_parts(recording, arguments.work / "captures/painted", internodes=False),
                "internodes": with_painted_parts(recording, arguments.work / "captures/internodes", internodes=True),
                "true-scan": with_painted_parts(recording, arguments.work / "captures/true-scan", internodes=True, scan="truth/static.ply")}
    zones, fits = true_cells(recording), {}
    before = common.read(HERE / "results.json")["fits"] if (HERE / "results.json").exists() else {}
    for name in FITS:
        is_done = any((arguments.work / name / file).exists() for file in ("figures.json", "refused.json"))
        if not is_done and (arguments.gather or (arguments.only and name != arguments.only)):
            if name in before:  # of the program that it names
                fits[name] = before[name]
            continue
        f = fits[name] = judged_fit(arguments.program, recording, captures, name, arguments.work, zones, truth, arguments.threads, arguments.limit)
        if "refused" in f:
            print(f"{name}: refused after {f['wall_seconds']} s: {f['refused']}", flush=True)
            continue
        print(f"{name}: {f['wall_seconds']} s, zones [MPa] " + ", ".join(f"{1e-6 * z['mean']:.2f} ({1e-6 * z['truth']:.2f})" for z in f["zones"]) +
              f", load-free {f['load_free_rms']} / {f['load_free_greatest']}, " + ", ".join(f"{k} {p['value']} ({p['truth']})" for k, p in f["parameters"].items()) +
              f", cost {f['cost']}, {f['verdict']}", flush=True)
    picture(recording, fits, arguments.work, zones)
    common.write_results(__file__, {"checks": checks, "recording": {key: truth[key] for key in ("size", "tips", "mesh", "points_a_frame", "energy_J", "pull_N", "seconds")} | {"pull_height": truth["truth"]["pull"]["y"]},
                                    "zones": truth["zones"], "scan_errors": scan_errors(recording), "placed": PLACED, "registered": registered(arguments.program, recording, arguments.work), "meshes": meshes(arguments.program, recording, arguments.work, truth), "fits": fits})


if __name__ == "__main__":
    main()
