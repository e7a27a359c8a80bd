#!/usr/bin/env python3
"""A silicone pot holder in two mountings: its material from a release in one, weights predicted in both (Wang et al. 2015, figure 10 and table 3).

The truth is simulated with another law, other elements and other steps than a fit has. Fitted with no choice of ours. Standard library only."""
import csv
import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

OBJECT = """format = "scene/1"
seed = 5
[object]
box = { size = [0.18, 0.008, 0.18], facet = 0.01 }
density = 1100.0
[material]
law = "ogden"
youngs_modulus = 7.0e6
poissons_ratio = 0.45
exponents = [4.0]
mass_damping = 0.4
stiffness_damping = 0.002
[simulation]
cell_size = 0.018
substeps = 6
"""
# Where it is held, and gravity in the sheet's own frame: lying, and hanging by the next edge 30 degrees off the vertical.
MOUNTINGS = {"horizontal": ('name = "pot holder, held by its left edge"\n', "[world]\ngravity = [0.0, -9.81, 0.0]\n[[fixed]]\nbox = { min = [-1, -1, -1], max = [-0.072, 1, 1] }\n"),
             "vertical": ('name = "pot holder, held by its back edge"\n', "[world]\ngravity = [0.0, -4.905, 8.4957]\n[[fixed]]\nbox = { min = [-1, -1, -1], max = [1, 1, -0.072] }\n")}
# Weights [kg] and where they hang.
LOADS = {"horizontal": [(0.02, (0.085, -0.004, 0.0)), (0.05, (0.085, -0.004, 0.0)), (0.05, (0.085, -0.004, 0.08))],
         "vertical": [(0.02, (0.0, -0.004, 0.085)), (0.1, (0.0, -0.004, 0.085)), (0.1, (0.08, -0.004, 0.085))]}
RELEASE = """[timing]
frame_rate = 30.0
frame_count = 45
start_frame = 3
[initial]
released = true
release_of = { mass = 0.05, at = [0.085, -0.004, 0.0] }
[cloud]
"""
EYES = [(0.5, 0.25, 0.35), (-0.35, 0.35, 0.5), (0.2, -0.4, -0.45)]


def camera(number, eye):
    return (f'[[camera]]\nname = "{number}"\nwidth = 160\nheight = 120\neye = {common.toml(list(eye))}\ntarget = [0.02, -0.02, 0.0]\nvertical_fov_deg = 30.0\n'
            'sensor = { preset = "structured-light", noise_base = 0.0012 }\n')


def scenes(mounting):
    """The release before three sensors, and every weight with true positions of points all over the sheet."""
    name, held = MOUNTINGS[mounting]
    head, body = OBJECT.split("\n", 1)
    scene = head + "\n" + name + body + held
    loads = "".join(f"[[load]]\nmass = {mass}\nat = {common.toml(list(at))}\nrole = \"test\"\n" for mass, at in LOADS[mounting])
    return {"release": scene + RELEASE + "".join(camera(i, eye) for i, eye in enumerate(EYES)), "loads": scene + loads + "[markers]\ncount = 300\nnoise = 0.0\n"}


def farthest(capture, load):
    """How far a weight and gravity move the sheet, at most [m]."""
    def places(name):
        with open(capture / name, newline="") as file:
            return {row["id"]: [float(row[axis]) for axis in "xyz"] for row in csv.DictReader(file)}

    rest, there = places("markers_rest.csv"), places(f"load/{load:03}.csv")
    return max(math.dist(rest[i], there[i]) for i in there)


def main():
    arguments = common.arguments(__doc__)
    work, program = arguments.work, arguments.program
    figures = {"fits": {}, "loads": {}}
    for mounting in MOUNTINGS:
        for kind, text in scenes(mounting).items():
            scene = work / f"{mounting}-{kind}.toml"
            scene.write_text(text if kind == "loads" or mounting == "horizontal" else text.replace("at = [0.085, -0.004, 0.0] }", "at = [0.0, -0.004, 0.085] }"))
            if not (work / f"{mounting}-{kind}/capture.toml").exists():
                common.run(program, "synth", scene, "--out", work / f"{mounting}-{kind}")
    for mounting in MOUNTINGS:
        fitted = common.fit(program, work / f"{mounting}-release", work / f"{mounting}-fit")
        parameters = fitted["result"]["parameters"]
        figures["fits"][mounting] = {"seconds": fitted["wall_seconds"], "verdict": fitted["result"]["verdict"],
                                     "parameters": {key: {"value": common.number(p["value"]), "interval": [common.number(v) for v in p["interval_90"]]} for key, p in parameters.items()
                                                    if p.get("estimated") and p.get("interval_90") and key != "poisson_ratio"}}
        figures["loads"][mounting] = {}
        for other in MOUNTINGS:
            loads = common.evaluate(program, work / f"{mounting}-fit/model.toml", work / f"{other}-loads", work / f"{mounting}-{other}.json")["loads"]
            figures["loads"][mounting][other] = [{"mass": mass, "moved": common.number(farthest(work / f"{other}-loads", i), 3), "mean": common.number(l["relative_mean"], 3), "greatest": common.number(l["relative_max"], 3)}
                                                 for i, ((mass, _), l) in enumerate(zip(LOADS[other], loads))]
        print(mounting, figures["fits"][mounting], figures["loads"][mounting], flush=True)
    truth = common.read(work / "horizontal-release/truth.json")["parameters"]
    figures["truth"] = {key: truth[key]["value"] for key in ("youngs_modulus", "poissons_ratio", "mass_damping", "stiffness_damping")}
    common.write_results(__file__, figures)


if __name__ == "__main__":
    main()
