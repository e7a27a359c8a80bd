#!/usr/bin/env python3
"""From photographs to a prediction, end to end: a scene's presses are painted, photographed, measured, fitted, and another probe's surface is predicted and compared with the truth."""
import json
import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

OBJECT = """format = "scene/1"
name = "stiffening ball"
seed = 4
truth_trajectory = true
[object]
sphere = { radius = 0.08, subdivisions = 5 }
density = 60.0
[material]
law = "ogden"
youngs_modulus = 15000.0
poissons_ratio = 0.25
exponents = [6.0]
[world]
gravity = [0.0, -9.81, 0.0]
[simulation]
cell_size = 0.014
[[fixed]]
half_space = { point = [0, -0.03, 0], normal = [0, -1, 0] }
[markers]
count = 120
half_space = { point = [0, 0.0, 0], normal = [0, 1, 0.5] }
"""
PLACES = [(0.25, 1.0, 0.35), (-0.45, 1.0, 0.3), (0.05, 1.0, 0.9)]  # directions from the middle
FORCES = [1.0, 2.5, 4.0]  # N
OTHER = {"radius": 0.022, "place": (0.1, 1.0, 0.5), "depths": [0.008, 0.016]}  # m: a wider disc, elsewhere
CHOICES = {"material": "ogden", "cells": 9, "law_zones": 1, "law_terms": 1, "control_points": 1}


def on_ball(direction, radius=0.08):
    length = math.sqrt(sum(d * d for d in direction))
    return [radius * d / length for d in direction]


def press(place, radius, role="fit", **led):
    block = {"at": on_ball(place), "radius": radius, "axis": [-d for d in on_ball(place, 1.0)], "role": role, **led}
    return "[[press]]\n" + "".join(f"{key} = {common.toml(value)}\n" for key, value in block.items())


def predict(program, model, surface, folder, truth):
    """The other probe pressed into a model, against the true surface and force."""
    rows = []
    at, inwards = on_ball(OTHER["place"]), [-d for d in on_ball(OTHER["place"], 1.0)]
    rest = common.read_vertices(surface)
    for i, depth in enumerate(OTHER["depths"]):
        out = folder / str(i)
        text = lambda vector: ",".join(repr(v) for v in vector)
        common.run(program, "press", model, "--contact=" + text(at), "--move=" + text([depth * d for d in inwards]), "--radius", OTHER["radius"],
                   "--steps", 2, "--surface", surface, "--out", out)
        found = common.read_vertices(sorted((out / "frames").glob("*.ply"))[-1])
        true = common.read_vertices(truth / f"truth/press/{i:03}.ply")
        off, moved = [math.dist(a, b) for a, b in zip(found, true)], [math.dist(a, b) for a, b in zip(rest, true)]
        force = [float(v) for v in (out / "probes.csv").read_text().strip().splitlines()[-1].split(",")[6:9]]
        exact = common.read(truth / "truth.json")["presses"][i]["force"]
        near = [o for o, m in zip(off, moved) if m > 0.1 * max(moved)]
        rows.append({"depth": depth, "rms": common.number(math.sqrt(sum(o * o for o in near) / len(near))), "max": common.number(max(off)), "moved": common.number(max(moved)),
                     "force": common.number(common.dot(force, inwards)), "true_force": common.number(common.dot(exact, inwards))})
    return rows


def main():
    arguments = common.arguments(__doc__)
    work, program = arguments.work, arguments.program
    scene, other = work / "scene.toml", work / "other.toml"
    scene.write_text(OBJECT + "".join(press(place, 0.012, push=force) for place in PLACES for force in FORCES))
    other.write_text(OBJECT + "".join(press(OTHER["place"], OTHER["radius"], depth=depth) for depth in OTHER["depths"]))
    if not (work / "measured/capture.toml").exists():
        common.run(program, "synth", other, "--out", work / "other")
        common.run(program, "synth", scene, "--out", work / "markers")  # the same presses, their markers known exactly
        common.run(program, "markers", "--example", work / "photos", "--scene", scene)
        common.run(program, "markers", work / "photos", "--out", work / "measured", allowed=(0, 3))
    measured = common.read(work / "measured/markers.json")
    figures = {"markers": measured["markers"], "rms_pixels": [common.number(p["rms_pixels"], 2) for p in measured["presses"]],
               "seen": [p["seen"] for p in measured["presses"]], "forces": [[force, common.number(p["force"])] for force, p in zip(FORCES * len(PLACES), measured["presses"])],
               "fits": {}}
    for name, capture in (("photographs", "measured"), ("exact markers", "markers")):
        fitted = common.fit(program, work / capture, work / f"{capture}-fit", CHOICES)
        parameters = fitted["result"]["parameters"]
        figures["fits"][name] = {
            "seconds": fitted["wall_seconds"],
            "parameters": {key: [common.number(p["value"]), common.number(p.get("std"), 2)] for key, p in parameters.items() if p["estimated"]},
            "predicted": predict(program, work / f"{capture}-fit/model.toml", work / "other/rest.ply", work / f"{capture}-pressed", work / "other")}
        print(name, json.dumps(figures["fits"][name]), flush=True)
    figures["truth"] = {key: p["value"] for key, p in common.read(work / "markers/truth.json")["parameters"].items() if key in ("youngs_modulus", "poissons_ratio", "exponent_1")}
    common.write_results(__file__, figures)


if __name__ == "__main__":
    main()
