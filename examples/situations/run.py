#!/usr/bin/env python3
"""Recordings, fits and new situations of five objects: a lotus-like leaf, a plant, a dinosaur, a pot holder and a hanger.

    run.py PROGRAM [--work FOLDER] [--only NAME ...]

Each object is an implicit shape; `pliant synth` makes a recording of it with smaller elements and steps than a fit takes, `pliant fit`
finds its material without choices, and `pliant simulate` moves the fitted model in NAME.toml beside this file. Standard library and
ffmpeg; about ten minutes on two cores. What stands in the work folder is not done again."""
import argparse
import json
import math
import pathlib
import subprocess

import shapes
from shapes import box, ellipsoid, rod, union

HERE = pathlib.Path(__file__).resolve().parent


def leaf():
    dish = lambda p: max(math.hypot(p[0], p[2]) - 0.11,
                         abs(p[1] - 0.28 - 1.2 * (p[0] ** 2 + p[2] ** 2) + 0.15 * p[0]) - 0.008)
    return union(dish, rod((0, 0, 0), (0, 0.28, 0), (0.014, 0.010)), blend=0.002), (-0.13, -0.03, -0.13), (0.13, 0.34, 0.13)


def plant():
    parts = [rod((0, 0, 0), (0.01, 0.32, 0), (0.016, 0.010))]
    for height, angle, length in ((0.10, 0.3, 0.12), (0.17, 2.4, 0.13), (0.24, 4.4, 0.11), (0.31, 1.2, 0.10)):
        along = (math.cos(angle) * 0.87, 0.5, math.sin(angle) * 0.87)
        side = (-math.sin(angle), 0.0, math.cos(angle))
        up = (-math.cos(angle) * 0.5, 0.87, -math.sin(angle) * 0.5)
        centre = [c + 0.5 * length * a for c, a in zip((0.0, height, 0.0), along)]
        parts.append(ellipsoid(centre, (0.58 * length, 0.034, 0.011), (along, side, up)))
    return union(*parts, blend=0.003), (-0.16, -0.03, -0.16), (0.16, 0.43, 0.16)


def dinosaur():
    parts = [ellipsoid((0, 0.12, 0), (0.10, 0.055, 0.05)), rod((0.08, 0.14, 0), (0.16, 0.24, 0), (0.030, 0.018)),
             ellipsoid((0.175, 0.25, 0), (0.035, 0.022, 0.022)), rod((-0.08, 0.12, 0), (-0.22, 0.07, 0), (0.035, 0.012))]
    for x in (-0.055, 0.055):
        for z in (-0.035, 0.035):
            parts.append(rod((x, 0.11, z), (x, 0.018, z * 1.15), (0.024, 0.018)))
    return union(*parts, blend=0.004), (-0.26, -0.02, -0.09), (0.24, 0.30, 0.09)


def pot_holder():
    pad = box((0, 0.02, 0), (0.09, 0.011, 0.09), 0.008)
    ring = lambda p: math.hypot(math.hypot(p[0] - 0.105, p[2] - 0.105) - 0.024, p[1] - 0.02) - 0.009
    return union(pad, ring, blend=0.003), (-0.11, 0.0, -0.11), (0.16, 0.045, 0.16)


def hanger():
    bow = lambda p: math.hypot(p[0], p[1] - 0.17)
    hook = lambda p: max(math.hypot(bow(p) - 0.03, p[2]) - 0.011, (-p[0] - 0.01) if p[1] < 0.17 else -1.0)
    return union(rod((-0.16, 0.02, 0), (0.16, 0.02, 0), 0.012), rod((-0.16, 0.02, 0), (0, 0.11, 0), 0.012),
                 rod((0.16, 0.02, 0), (0, 0.11, 0), 0.012), rod((0, 0.11, 0), (0, 0.14, 0), 0.012), hook,
                 blend=0.003), (-0.19, -0.01, -0.04), (0.19, 0.23, 0.04)


# shape, spacing of its surface and edge of the recording's elements [m], Young's modulus [Pa], density, how it is recorded
OBJECTS = {
    "leaf": (leaf, 0.005, 0.008, 1.5e6, 120.0, "released"),
    "plant": (plant, 0.006, 0.008, 1.2e6, 200.0, "released"),
    "dinosaur": (dinosaur, 0.006, 0.011, 3.0e4, 120.0, "dropped"),
    "pot_holder": (pot_holder, 0.004, 0.007, 2.0e4, 150.0, "dropped"),
    "hanger": (hanger, 0.005, 0.008, 1.0e5, 200.0, "hung"),
}

SCENE = """format = "scene/1"
name = "{name}"
seed = 7
[object]
surface = "{name}.obj"
density = {density}
translation = [0.0, {height}, 0.0]
[material]
youngs_modulus = {modulus}
poissons_ratio = 0.35
mass_damping = 0.4
stiffness_damping = {damping}
[world]
gravity = [0.0, -9.81, 0.0]
[timing]
frame_rate = 60.0
frame_count = 50
start_frame = 2
[simulation]
cell_size = {cell}
substeps = 12
{held}
[[camera]]
name = "front"
width = 320
height = 240
eye = [0.25, 0.45, 0.75]
target = [0.0, 0.16, 0.0]
vertical_fov_deg = 40.0
sensor = {{ preset = "structured-light" }}
[[camera]]
name = "side"
width = 320
height = 240
eye = [-0.75, 0.4, 0.2]
target = [0.0, 0.16, 0.0]
vertical_fov_deg = 40.0
sensor = {{ preset = "structured-light" }}
"""
GROUND = "[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nfriction = 0.4\nhalf_size = 0.5\n"
HUNG = """[initial]
released = true
release_of = {{ mass = {mass}, at = [{at}] }}
[[fixed]]
half_space = {{ point = [0, 0.185, 0], normal = [0, 1, 0] }}
"""
RELEASED = """[initial]
released = true
release_of = {{ mass = {mass}, at = [{at}] }}
[[fixed]]
half_space = {{ point = [0, 0.02, 0], normal = [0, -1, 0] }}
"""


def run(*words):
    print(" ".join(map(str, words)), flush=True)
    subprocess.run(list(map(str, words)), check=True)


def make(program, work, name):
    shape, spacing, cell, modulus, density, kind = OBJECTS[name]
    folder = work / name
    folder.mkdir(parents=True, exist_ok=True)
    mesh = shapes.surface(*shape(), spacing)
    shapes.write_obj(folder / f"{name}.obj", mesh)
    pulled = {"released": (RELEASED, 0.03 if name == "plant" else 0.05, max(mesh[0], key=lambda v: v[1] + 0.3 * v[0])),
              "hung": (HUNG, 0.02, max(mesh[0], key=lambda v: v[0] - v[1]))}.get(kind)
    held = pulled[0].format(mass=pulled[1], at=", ".join(f"{x:.5f}" for x in pulled[2])) if pulled else GROUND
    scene = folder / "scene.toml"
    scene.write_text(SCENE.format(name=name, density=density, modulus=modulus, cell=cell, held=held, damping=0.003,
                                  height=0.0 if pulled else 0.25))
    if not (folder / "recording/capture.toml").exists():
        run(program, "synth", scene, "--out", folder / "recording")
    if not (folder / "fit/model.toml").exists():
        run(program, "fit", folder / "recording", "--out", folder / "fit")
    result = json.loads((folder / "fit/result.json").read_text())
    E = result["parameters"]["youngs_modulus"]
    print(f"{name}: E {E['value']:.4g} Pa, 90 % {E['interval_90'][0]:.4g} to {E['interval_90'][1]:.4g}; true {modulus:.4g}", flush=True)
    run(program, "simulate", folder / "fit/model.toml", "--situation", HERE / f"{name}.toml", "--out", folder / "situation", "--video",
        folder / f"{name}.mp4")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path("out/situations"))
    parser.add_argument("--only", nargs="+", default=list(OBJECTS))
    arguments = parser.parse_args()
    for name in arguments.only:
        make(arguments.program.resolve(), arguments.work, name)


if __name__ == "__main__":
    main()
