#!/usr/bin/env python3
"""Three bodies under known presses, as in Bickel et al. 2009: a face over a skull on which it slides (figure 10), a heterogeneous pillow that
is pushed and pulled (figures 1, 3 and 9), and a stiffening foam pressed until a linear law turns elements over (figure 8).

--only face, pillow or foam runs one of them and keeps the others' figures; --small: coarse bodies and few presses, figures are printed alone."""
import json
import math
import pathlib
import re
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common
import draw
import plots
import shapes

LIMIT = 1200.0  # [s] after which a fit is asked to stop with the best that it has
IMAGES = common.ROOT / "docs/images"


def scene(name, facts, blocks):
    """Text of a scene of presses: tables by name, then blocks."""
    lines = ['format = "scene/1"', f"name = {common.toml(name)}", "seed = 3", "truth_trajectory = true"]
    for title, table in facts.items():
        lines += [f"[{title}]"] + [f"{key} = {common.toml(value)}" for key, value in table.items()]
    for title, table in blocks:
        lines += [f"[[{title}]]"] + [f"{key} = {common.toml(value)}" for key, value in table.items()]
    return "\n".join(lines) + "\n"


def synthesised(program, folder, text, files=()):
    """A capture of a scene, made once."""
    if not (folder / "capture/capture.toml").exists():
        folder.mkdir(parents=True, exist_ok=True)
        for name, surface in files:
            shapes.write_obj(folder / name, surface)
        (folder / "scene.toml").write_text(text)
        common.run(program, "synth", folder / "scene.toml", "--out", folder / "capture")
    return folder / "capture"


def outwards(surface, direction):
    """The vertex of a star-shaped surface that lies in a direction, and that direction into the body."""
    way = shapes.unit(direction)
    at = max(surface[0], key=lambda p: common.dot(shapes.unit(p), way))
    return list(at), [-d for d in way]


def inward_normal(surface, at):
    """Of a surface at one of its vertices."""
    points, triangles = surface
    here, total = points.index(tuple(at)), [0.0, 0.0, 0.0]
    for a, b, c in (t for t in triangles if here in t):
        u, v = ([y - x for x, y in zip(points[a], points[i])] for i in (b, c))
        total = [t - n for t, n in zip(total, (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]))]
    return list(shapes.unit(total))


def pressed(program, model, out, *words):
    """Runs `pliant press`, once. What it printed last, and the exit code."""
    out.mkdir(parents=True, exist_ok=True)
    if (out / "said.json").exists():
        return common.read(out / "said.json")
    done = subprocess.run([str(program), "press", str(model), *map(str, words), "--out", str(out)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode not in (0, 3):
        raise SystemExit(done.stdout[-2000:])
    said = [done.stdout.strip().splitlines()[-1], done.returncode]
    (out / "said.json").write_text(json.dumps(said))
    return said


def probe_rows(folder):
    lines = (folder / "probes.csv").read_text().strip().splitlines()
    return [dict(zip(lines[0].split(","), map(float, line.split(",")))) for line in lines[1:]]


def surface_error(found, true, rest):
    """Root mean square over what moves by more than a tenth of the most, and the greatest, against the true surface [m]."""
    off, moved = [math.dist(a, b) for a, b in zip(found, true)], [math.dist(a, b) for a, b in zip(rest, true)]
    near = [o for o, m in zip(off, moved) if m > 0.1 * max(moved)]
    return {"rms": common.number(math.sqrt(sum(o * o for o in near) / len(near))), "max": common.number(max(off)), "moved": common.number(max(moved))}


def estimates(fit):
    return {key: [common.number(p["value"]), common.number(p.get("std"), 2)] for key, p in fit["result"]["parameters"].items() if p["estimated"] and not key.startswith("poisson_ratio")}


def judged_presses(program, model, capture):
    """Markers of each press by a model: role, rms [m], rms over the greatest displacement."""
    return common.evaluate(program, model, capture, model.parent / "judged.json")["presses"]


def elements(model):
    return len(next(v for k, v in common.read_vtu(model.parent / "model.vtu").items() if k.startswith("youngs_modulus [")))


def as_truth(model, law, numbers, modulus, ratio):
    """Gives all elements of a model the same law: columns and numbers of material.csv."""
    table = (model.parent / "material.csv").read_text().strip().splitlines()
    rows = [f"{e},{','.join(repr(n) for n in numbers.values())}" for e in range(len(table) - 1)]
    (model.parent / "material.csv").write_text("\n".join(["element," + ",".join(numbers), *rows]) + "\n")
    text = model.read_text()
    for key, value in (("law", f'"{law}"'), ("youngs_modulus", repr(modulus)), ("poissons_ratio", repr(ratio))):
        text = re.sub(rf"(?m)^{key}\s*=\s*\S+", f"{key} = {value}", text)
    model.write_text(text)


def ogden_numbers(modulus, ratio, exponents, shares):
    """Columns of one law: shear moduli mu_i in the shares given, summing to that of small strains."""
    shear = 0.5 * modulus / (1.0 + ratio)
    return {f"{key}_{i + 1}": value for i, (a, s) in enumerate(zip(exponents, shares)) for key, value in (("mu", shear * s / sum(shares)), ("exponent", a), ("poissons_ratio", ratio))}


# ---- a face on its skull

FACE = {"modulus": 12000.0, "ratio": 0.35, "exponent": 6.0}


def face_scene(presses, small):
    skin = shapes.surface(shapes.head, 4)
    facts = {"object": {"surface": "skin.obj", "density": 1000.0}, "material": {"law": "ogden", "youngs_modulus": FACE["modulus"], "poissons_ratio": FACE["ratio"], "exponents": [FACE["exponent"]]},
             "world": {"gravity": [0.0, 0.0, 0.0], "up": [0.0, 1.0, 0.0]}, "simulation": {"cell_size": 0.024 if small else 0.015},
             "markers": {"count": 160, "sphere": {"centre": [0.05, -0.02, 0.07], "radius": 0.06}, "noise": 5e-5}}
    blocks = [("inner", {"surface": "skull.obj", "contact": "sliding"}), ("fixed", {"half_space": {"point": [0, -0.07, 0], "normal": [0, -1, 0]}})]
    for direction, depth, role in presses:
        at, inwards = outwards(skin, direction)
        blocks.append(("press", {"at": at, "axis": inwards, "radius": 0.011, "depth": depth, "force_noise": 0.005, "role": role}))
    return scene("face", facts, blocks)


def skin_of(body):
    """Numbers of the nodes on the outer skin of a body of quadratic tetrahedra, and the surface that they make, four triangles a face."""
    cells = [body["connectivity"][i:i + 10] for i in range(0, len(body["connectivity"]), 10)]
    place = lambda n: tuple(body["points"][3 * n:3 * n + 3])
    middles = {frozenset(edge): 4 + k for k, edge in enumerate(((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)))}  # in VTK's order
    faces = {}
    for cell in cells:
        for corners in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)):
            a, b, c = (cell[i] for i in corners)
            key = frozenset((a, b, c))
            faces[key] = None if key in faces else (a, b, c, *(cell[middles[frozenset((corners[i], corners[(i + 1) % 3]))]] for i in range(3)))
    numbers, triangles = {}, []
    for face in filter(None, faces.values()):
        p, q, r = map(place, face[:3])
        u, v = [y - x for x, y in zip(p, q)], [y - x for x, y in zip(p, r)]
        if common.dot((u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]), p) <= 0.0:
            continue  # of the cavity
        a, b, c, ab, bc, ca = (numbers.setdefault(n, len(numbers)) for n in face)
        triangles += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return list(numbers), ([place(n) for n in numbers], triangles)


def face(program, work, small):
    files = (("skin.obj", shapes.surface(shapes.head, 4)), ("skull.obj", shapes.surface(shapes.skull, 4)))
    places = [(0.6, -0.15, 0.75), (0.75, 0.05, 0.6), (0.5, -0.4, 0.75), (0.8, -0.3, 0.45)]
    presses = [(p, d, "fit") for p in places[:2 if small else 4] for d in ((0.004,) if small else (0.004, -0.002))] + [((0.7, -0.2, 0.65), 0.006, "test")]
    capture = synthesised(program, work / "face", face_scene(presses, small), files)
    fit = common.fit(program, capture, work / "face/fit", {"cells": 10 if small else FACE_CELLS}, limit=LIMIT)
    model = work / "face/fit/model.toml"
    # The truth's own body, quadratic and elsewhere cut: a fit of one press makes it, and gets the true law.
    exact = work / "face/truth/model.toml"
    if not exact.exists():
        one = synthesised(program, work / "face-one", face_scene(presses[:1], small), files)
        common.fit(program, one, exact.parent, {"cells": 9 if small else 13, "element": "quadratic_tetrahedra", "material": "ogden", "law_terms": 1, "law_zones": 1, "max_iterations": 1})
        as_truth(exact, "ogden", ogden_numbers(FACE["modulus"], FACE["ratio"], [FACE["exponent"]], [1.0]), FACE["modulus"], FACE["ratio"])
    # The true law on the fit's own elements: what these alone are wrong by.
    own = work / "face/own/model.toml"
    if not own.exists():
        shutil.copytree(model.parent, own.parent, ignore=shutil.ignore_patterns("presses*", "*.html", "*.json"))
        as_truth(own, "ogden", ogden_numbers(FACE["modulus"], FACE["ratio"], [FACE["exponent"]], [1.0]), FACE["modulus"], FACE["ratio"])
    # A cylinder with round ends is pressed into the cheek and drawn along it.
    at, _ = outwards(files[0][1], (0.68, -0.2, 0.7))
    inwards = inward_normal(files[0][1], at)
    rod = [0.026 * d for d in shapes.unit((inwards[2], 0.0, -inwards[0]))]  # level, along the cheek
    path = [{"time": 0, "shift": [0.0, 0.0, 0.0]}, {"time": 1, "shift": [0.005 * d for d in inwards]}, {"time": 2, "shift": [0.005 * inwards[0], 0.005 * inwards[1] + 0.008, 0.005 * inwards[2]]}]
    (work / "face/probing.toml").write_text('format = "situation/1"\nduration = 2\nframe_rate = 5\n[[probe]]\nkind = "capsule"\nradius = 0.008\n' +
                                            "".join(f"{k} = {common.toml(v)}\n" for k, v in {"at": at, "axis": inwards, "rod": rod, "path": path}.items()))
    fine, nodes = work / "face/fine.obj", work / "face/nodes.obj"
    rest = shapes.surface(shapes.head, 4 if small else 6)
    shapes.write_obj(fine, rest)
    numbers, true_rest = skin_of(common.read_vtu(exact.parent / "model.vtu"))
    shapes.write_obj(nodes, true_rest)
    said = {}
    for name, of, follows in (("fine", model, fine), ("found", model, nodes), ("own", own, nodes), ("truth", exact, nodes)):
        said[name], code = pressed(program, of, work / f"face/{name}-pressed", "--path", work / "face/probing.toml", "--surface", follows)
        assert code == 0, said[name]

    def true_skin(frame):
        points = common.read_vtu(work / f"face/truth-pressed/frames/{frame:06}.vtu")["points"]
        return [tuple(points[3 * n:3 * n + 3]) for n in numbers]

    rows = []
    force = lambda row: math.sqrt(sum(row[k]**2 for k in ("fx", "fy", "fz")))
    table = {name: probe_rows(work / f"face/{name}-pressed") for name in said}
    for name in ("found", "own"):
        for frame, what in ((5, "pressed in"), (10, "drawn along")):
            found = common.read_vertices(work / f"face/{name}-pressed/frames/{frame:06}.ply")
            rows.append({"model": name, "what": what, **surface_error(found, true_skin(frame), true_rest[0]), "force": common.number(force(table[name][frame])), "true_force": common.number(force(table["truth"][frame]))})
    if not small:
        view = ((0.72, 0.0, -0.694), (0.0, 1.0, 0.0), (0.694, 0.0, 0.72))
        found, true = common.read_vertices(work / "face/fine-pressed/frames/000010.ply"), true_skin(10)
        most = max(math.dist(a, b) for a, b in zip(true, true_rest[0]))

        def coloured(now, before, triangles):
            moved = [math.dist(a, b) for a, b in zip(now, before)]
            return [tuple(int(plots.shade(min(1.0, sum(moved[i] for i in t) / 3 / most))[k:k + 2], 16) for k in (1, 3, 5)) for t in triangles]

        draw.write(IMAGES / "pressed-face.png", draw.beside([draw.surface(None, rest[0], rest[1], [(225, 190, 170)] * len(rest[1]), view), draw.surface(None, found, rest[1], coloured(found, rest[0], rest[1]), view),
                                                              draw.surface(None, true, true_rest[1], coloured(true, true_rest[0], true_rest[1]), view)]))
    milliseconds = float(re.search(r"([\d.e+]+) ms each", said["fine"]).group(1))
    tests = [p for p in judged_presses(program, model, capture) if p["role"] == "test"]
    return {"elements": elements(model), "true_elements": elements(exact), "truth": FACE, "estimates": estimates(fit), "seconds": fit["wall_seconds"], "was_stopped": fit["exit_code"] == common.INTERRUPTED, "milliseconds": common.number(milliseconds, 3),
            "surface_vertices": len(rest[0]), "true_vertices": len(numbers), "cylinder": rows, "test_press": common.number(tests[0]["relative_error"], 3), "presses": len(presses)}


# ---- a pillow with a hard part

PILLOW = {"modulus": 5000.0, "hard": 20000.0, "ratio": 0.25, "exponent": 5.0}
HARD = {"centre": [0.06, 0.0, 0.02], "radius": 0.055}  # the hard part of the truth [m]
PROBE = 0.016  # radius of the disc of the fit's presses [m]


def pillow_scene(name, presses, small):
    """Presses: direction from the middle, radius of the disc [m], depth [m] (negative: pulled), role."""
    body = shapes.surface(shapes.pillow, 4)
    law = {"law": "ogden", "youngs_modulus": PILLOW["modulus"], "poissons_ratio": PILLOW["ratio"], "exponents": [PILLOW["exponent"]]}
    facts = {"object": {"surface": "pillow.obj", "density": 40.0}, "material": law, "world": {"gravity": [0.0, 0.0, 0.0], "up": [0.0, 1.0, 0.0]},
             "simulation": {"cell_size": 0.04 if small else 0.021}, "markers": {"count": 200, "half_space": {"point": [0, -0.01, 0], "normal": [0, 1, 0]}, "noise": 2e-4}}
    blocks = [("fixed", {"half_space": {"point": [0, -0.032, 0], "normal": [0, -1, 0]}}), ("region", {"name": "hard", "sphere": HARD, "youngs_modulus": PILLOW["hard"]})]
    for direction, radius, depth, role in presses:
        at, inwards = outwards(body, direction)
        blocks.append(("press", {"at": at, "axis": inwards, "radius": radius, "depth": depth, "force_noise": 0.01, "role": role}))
    return scene(name, facts, blocks)


def without_parts(capture):
    """The fit knows nothing of the hard part."""
    text = (capture / "capture.toml").read_text()
    (capture / "capture.toml").write_text(re.sub(r"\[\[region\]\]\n(.+\n)*", "", text))


def modulus_colours(model, frame, triangles_of, low, high):
    """Boundary faces of a body of tetrahedra with the modulus of each element in colour, by its logarithm."""
    faces = {}
    cells = [frame["connectivity"][i:i + triangles_of] for i in range(0, len(frame["connectivity"]), triangles_of)]
    for e, cell in enumerate(cells):
        for face in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)):
            nodes = tuple(cell[i] for i in face)
            key = tuple(sorted(nodes))
            faces[key] = None if key in faces else (e, nodes)
    modulus = next(v for k, v in model.items() if k.startswith("youngs_modulus ["))
    found = [f for f in faces.values() if f]
    share = lambda e: min(1.0, max(0.0, math.log(modulus[e] / low) / math.log(high / low)))
    colour = lambda s: tuple(int(plots.shade(s)[k:k + 2], 16) for k in (1, 3, 5))
    return [nodes for _, nodes in found], [colour(share(e)) for e, _ in found]


def pillow(program, work, small):
    files = (("pillow.obj", shapes.surface(shapes.pillow, 4)),)
    places = [(0.0, 1.0, 0.0), (0.6, 1.0, 0.25), (-0.6, 1.0, 0.0), (0.35, 1.0, -0.4), (-0.3, 1.0, 0.5), (0.9, 0.9, 0.0)]
    fitted = [(p, PROBE, d, "fit") for p in places[:2 if small else 4] for d in ((0.01,) if small else (0.012, -0.007))]
    other = [(p, 0.024, d, "test") for p in ((0.45, 1.0, 0.1), (-0.4, 1.0, 0.2))[:1 if small else 2] for d in (0.015, -0.009)]
    capture = synthesised(program, work / "pillow", pillow_scene("pillow", fitted, small), files)
    judge = synthesised(program, work / "pillow-other", pillow_scene("pillow, another probe", other, small), files)
    without_parts(capture)
    rest = common.read_vertices(capture / "rest.ply")
    exact = common.read(judge / "truth.json")["presses"]
    fits = {}
    for name, choices in (("default", {}), ("one modulus", {"law_zones": 1, "control_points": 1})):
        out = work / f"pillow/{name.replace(' ', '-')}"
        fit = common.fit(program, capture, out, {**choices, **({"cells": 6} if small else {})}, limit=LIMIT)
        model, rows = out / "model.toml", []
        for i, (direction, radius, depth, _) in enumerate(other):
            at, inwards = outwards(files[0][1], direction)
            text = lambda vector: ",".join(repr(v) for v in vector)
            _, code = pressed(program, model, work / f"{out.name}-pressed/{i}", "--contact=" + text(at), "--move=" + text([depth * d for d in inwards]), "--axis=" + text(inwards), "--radius", radius,
                              "--steps", 3, "--surface", capture / "rest.ply")
            last = probe_rows(work / f"{out.name}-pressed/{i}")[-1]
            found, true = common.read_vertices(sorted((work / f"{out.name}-pressed/{i}/frames").glob("*.ply"))[-1]), common.read_vertices(judge / f"truth/press/{i:03}.ply")
            rows.append({"depth": depth, **surface_error(found, true, rest), "force": common.number(common.dot([last[k] for k in ("fx", "fy", "fz")], inwards)),
                         "true_force": common.number(common.dot(exact[i]["force"], inwards)), "complete": code == 0})
        volume = common.read_vtu(out / "model.vtu")
        fits[name] = {"elements": elements(model), "seconds": fit["wall_seconds"], "was_stopped": fit["exit_code"] == common.INTERRUPTED, "estimates": estimates(fit), "predicted": rows, "zones": part_moduli(volume),
                      "marker_rms": common.number(math.sqrt(sum(p["marker_rms"]**2 for p in judged_presses(program, out / "model.toml", capture)) / len(fitted)))}
        if not small and name == "default":
            view = ((1.0, 0.0, 0.0), (0.0, 0.77, -0.64), (0.0, 0.64, 0.77))
            pictures = []
            for i in (2, 3):
                frame = common.read_vtu(sorted((work / f"{out.name}-pressed/{i}/frames").glob("*.vtu"))[-1])
                points = [tuple(frame["points"][3 * n:3 * n + 3]) for n in range(len(frame["points"]) // 3)]
                triangles, colours = modulus_colours(volume, frame, 4, PILLOW["modulus"], PILLOW["hard"])
                pictures.append(draw.surface(None, points, triangles, colours, view, 480, 360, [(-0.145, -0.115), (0.145, 0.115)]))
            draw.write(IMAGES / "pressed-pillow.png", draw.beside(pictures))
    return {"truth": PILLOW, "presses": len(fitted), "fits": fits}


def part_moduli(volume):
    """Median modulus of the elements in the middle of the hard part, and far from it [Pa]."""
    points, nodes = volume["points"], volume["connectivity"]
    values = next(v for k, v in volume.items() if k.startswith("youngs_modulus ["))
    inside, outside = [], []
    for e, value in enumerate(values):
        middle = [sum(points[3 * n + d] for n in nodes[4 * e:4 * e + 4]) / 4 for d in range(3)]
        off = math.dist(middle, HARD["centre"]) / HARD["radius"]
        if off < 0.7:
            inside.append(value)
        elif off > 1.5:
            outside.append(value)
    return {"hard": common.number(common.median(inside)), "soft": common.number(common.median(outside))}


# ---- a foam, pressed on

FOAM = {"modulus": 8000.0, "ratio": 0.1, "exponents": [18.0, -4.0], "stiffness_ratios": [0.6]}
FOAM_SIZE = [0.2, 0.1, 0.2]  # [m]
PUNCH = 0.03  # radius of the disc [m]


def foam_scene(name, presses, small):
    facts = {"object": {"box": {"size": FOAM_SIZE}, "density": 30.0},
             "material": {"law": "ogden", "youngs_modulus": FOAM["modulus"], "poissons_ratio": FOAM["ratio"], "exponents": FOAM["exponents"], "stiffness_ratios": FOAM["stiffness_ratios"]},
             "world": {"gravity": [0.0, 0.0, 0.0], "up": [0.0, 1.0, 0.0]}, "simulation": {"cell_size": 0.05 if small else 0.024},
             "markers": {"count": 150, "half_space": {"point": [0, -0.04, 0], "normal": [0, 1, 0]}, "noise": 2e-4}}
    blocks = [("fixed", {"half_space": {"point": [0, -0.0499, 0], "normal": [0, -1, 0]}})]
    blocks += [("press", {"at": at, "axis": [0, -1, 0], "radius": PUNCH, "depth": depth, "force_noise": 0.02, "role": role}) for at, depth, role in presses]
    return scene(name, facts, blocks)


def least_volume_ratio(rest, frame):
    """The least det F of linear tetrahedra."""
    def volumes(points):
        for i in range(0, len(rest["connectivity"]), 4):
            a, b, c, d = (points[3 * n:3 * n + 3] for n in rest["connectivity"][i:i + 4])
            u, v, w = ([x - y for x, y in zip(p, a)] for p in (b, c, d))
            yield u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) + u[2] * (v[0] * w[1] - v[1] * w[0])
    return min(now / before for before, now in zip(volumes(rest["points"]), volumes(frame["points"])))


def foam(program, work, small):
    places = [(0.0, 0.0), (0.05, 0.05), (-0.05, 0.04), (-0.04, -0.05)]
    fitted = [([x, 0.05, z], d, "fit") for x, z in places[:2 if small else 4] for d in ((0.01,) if small else (0.008, 0.016, 0.028))]
    depths = [0.005 * k for k in range(1, 4 if small else 10)]
    place = [0.02, 0.05, -0.02]  # between those of the fit
    capture = synthesised(program, work / "foam", foam_scene("foam", fitted, small))
    judge = synthesised(program, work / "foam-curve", foam_scene("foam, one place", [(place, d, "test") for d in depths], small))
    exact = [{"depth": d, "force": common.number(-p["force"][1])} for d, p in zip(depths, common.read(judge / "truth.json")["presses"])]
    curves, fits = {}, {}
    even = {"law_zones": 1, "control_points": 1}  # one material everywhere, as the paper takes its foam
    for name, choices in (("ogden", even), ("linear", {"material": "linear", **even})):
        out = work / f"foam/{name}"
        fit = common.fit(program, capture, out, {**choices, "cells": 6 if small else FOAM_CELLS}, limit=LIMIT)
        steps = 12 if small else 40
        text = ",".join(repr(v) for v in place)
        said, code = pressed(program, out / "model.toml", work / f"foam-{name}", f"--contact={text}", f"--move=0,{-0.06 if not small else -0.02},0", "--axis=0,-1,0", "--radius", PUNCH, "--steps", steps)
        rest, rows = common.read_vtu(out / "model.vtu"), []
        for row, path in zip(probe_rows(work / f"foam-{name}"), sorted((work / f"foam-{name}/frames").glob("*.vtu"))):
            rows.append({"depth": common.number(-row["y"]), "force": common.number(-row["fy"]), "least_volume_ratio": common.number(least_volume_ratio(rest, common.read_vtu(path)), 4)})
        curves[name] = rows
        fits[name] = {"elements": elements(out / "model.toml"), "seconds": fit["wall_seconds"], "was_stopped": fit["exit_code"] == common.INTERRUPTED, "estimates": estimates(fit), "complete": code == 0, "said": said if code else "",
                      "marker_rms": common.number(math.sqrt(sum(p["marker_rms"]**2 for p in judged_presses(program, out / "model.toml", capture)) / len(fitted)))}
    return {"truth": FOAM, "presses": len(fitted), "deepest_fitted": max(d for _, d, _ in fitted), "fits": fits, "curve": exact, "curves": curves}


FACE_CELLS, FOAM_CELLS = 19, 7.4


def main():
    arguments = common.arguments(__doc__, only={"choices": ("face", "pillow", "foam"), "help": "one body alone"}, small={"action": "store_true", "help": "a quick run, as in tests"})
    bodies = {"face": face, "pillow": pillow, "foam": foam}
    results = HERE / "results.json"
    for name, body in bodies.items():
        if arguments.only not in (None, name):
            continue
        found = {name: body(arguments.program, arguments.work, arguments.small)}
        print(json.dumps(found), flush=True)
        if not arguments.small:  # beside what others are there by then
            common.write_results(__file__, {**({k: v for k, v in common.read(results).items() if k != "machine"} if results.exists() else {}), **found})


if __name__ == "__main__":
    main()
