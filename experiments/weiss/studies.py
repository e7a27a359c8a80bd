"""The recordings and studies of the evaluation of Weiss et al. 2020: what `run.py` runs. Standard library only."""
import math
import pathlib
import random
import re
import subprocess

import common

SEED = 1
TORUS_CELL = 0.28 / 15.4  # [m], about the paper's 690 elements
PAPER_BAND = 5.0          # cells, the paper's phi_max on the torus
SHARED_MESHES = ("spot.obj", "bunny_watertight_simplified.obj")


class Study:
    """Programs, where files go, and how much is run: `small` is for tests."""

    def __init__(self, program, work, small=False):
        self.pliant, self.work, self.small = pathlib.Path(program), pathlib.Path(work), small
        self.weiss = self.pliant.parent.parent / "experiments/pliant_weiss"

    def count(self, full):
        return 1 if self.small else full

    def ask(self, name, request):
        """One run of pliant_weiss, or its output where it has run already."""
        out, question = self.work / f"{name}.json", self.work / f"{name}.request.json"
        if not out.exists():
            question.write_text(common.json.dumps(request, indent=1))
            part = out.with_suffix(".part")
            with open(part, "w") as file, open(out.with_suffix(".log"), "w") as messages:
                subprocess.run([self.weiss, f"request={question}"], check=True, stdout=file, stderr=messages)
            part.rename(out)
        return common.read(out)

    def record(self, name, scene, change=None):
        """A synthetic recording. `change` edits the text of its capture.toml: what a user would not know."""
        folder = self.work / name
        if not (folder / "capture.toml").exists():
            path = self.work / f"{name}.toml"
            path.write_text(scene)
            made = folder if change is None else self.work / f"{name}.made"
            common.run(self.pliant, "synth", path, "--out", made)
            if change is not None:
                text = change((made / "capture.toml").read_text())
                (made / "capture.toml").write_text(text)
                made.rename(folder)
        return folder

    def minimise(self, name, capture, starts, settings, estimated, **more):
        answer = self.ask(name, {"task": "minimise", "capture": str(capture), "set": settings, "estimated": estimated, "starts": starts, **more})
        return answer["rows"]

    def sweep(self, name, capture, values, settings, **more):
        answer = self.ask(name, {"task": "sweep", "capture": str(capture), "set": settings, "estimated": ["youngs_modulus"], "over": "youngs_modulus",
                                 "values": values, **more})
        return answer["rows"]


# Scenes -----------------------------------------------------------------------------------------------------------------

def scene_text(name, shape, placed, density, material, frames, cell, cameras, planes="", world="gravity = [0.0, -9.81, 0.0]", more="", start_frame=0, trajectory=False, finer=0.69):
    """A scene that is simulated on cells `finer` times those of the fit and with shorter steps. `material`: E, nu, mass and
    stiffness damping."""
    E, nu, mass_damping, stiffness_damping = material
    return f"""format = "scene/1"
name = "{name}"
seed = {SEED}
truth_trajectory = {str(trajectory).lower()}

[object]
{shape}
{placed}
{density}

[material]
youngs_modulus = {E!r}
poissons_ratio = {nu!r}
mass_damping = {mass_damping!r}
stiffness_damping = {stiffness_damping!r}

[world]
{world}

[timing]
frame_rate = 60.0
frame_count = {frames + 1 + start_frame}
start_frame = {start_frame}

[simulation]
cell_size = {finer * cell!r}
substeps = 12
newmark_theta = 0.5

{more}
{planes}
{cameras}
"""


def camera(name, eye, target, pixels, noise, angle=40.0):
    return f"""[[camera]]
name = "{name}"
width = {pixels}
height = {pixels}
eye = {common.toml(list(eye))}
target = {common.toml(list(target))}
vertical_fov_deg = {angle!r}
sensor = {{ preset = "ideal", noise_base = {noise!r}, step = 0.0 }}
"""


def plane(point=(0.0, 0.0, 0.0), normal=(0.0, 1.0, 0.0), half_size=1.0):
    return f"""[[plane]]
point = {common.toml(list(point))}
normal = {common.toml(list(normal))}
known = true
half_size = {half_size!r}
"""


TORUS = (5000.0, 0.3, 0.1, 0.004)
TORUS_KNOWN = {"poissons_ratio": 0.3, "mass_damping": 0.1, "stiffness_damping": 0.004, "friction": 0.0}


def torus_cells(study):
    """Along its longest extent; few where a study is only seen to run."""
    return 8.0 if study.small else 15.4


def torus_known(study):
    return TORUS_KNOWN | {"cells": torus_cells(study)}


def torus(study, name, cameras, frames=40, trajectory=False, finer=0.69):
    text = scene_text("torus bouncing off the floor", "torus = { ring_radius = 0.1, tube_radius = 0.04, ring_segments = 96, tube_segments = 48 }",
                      "translation = [0.0, 0.22, 0.0]\naxis = [1.0, 0.0, 0.4]\nangle_deg = 25.0", "density = 100.0", TORUS, frames, 0.28 / torus_cells(study), "\n".join(cameras),
                      plane(), trajectory=trajectory, finer=finer)
    return study.record(name, text)


def torus_camera(pixels=50, noise=0.1, name="camera", eye=(0.0, 0.4, 0.6)):
    return camera(name, eye, (0.0, 0.12, 0.0), pixels, noise * TORUS_CELL)


def on_hemisphere(generator, distance):
    """Where a camera is that looks at the torus from anywhere above the floor."""
    height, turn = generator.uniform(0.15, 1.0), generator.uniform(0.0, 2.0 * math.pi)
    across = math.sqrt(1.0 - height * height)
    return (distance * across * math.cos(turn), 0.12 + distance * height, distance * across * math.sin(turn))


def band(cells_wide, cells):
    return min(cells_wide / cells, 0.499)


def log_uniform_starts(count, truth, seed, factor=10.0):
    generator = random.Random(seed)
    return [{"youngs_modulus": common.log_uniform(generator, truth / factor, truth * factor)} for _ in range(count)]


# What is kept of a run --------------------------------------------------------------------------------------------------

def judged(rows, truth, kept_way=True):
    """Rows of results.json: of each start what it found, and how far off."""
    kept = []
    for row in rows:
        found = row["found"]["youngs_modulus"]
        kept.append({"start": common.number(row["start"]["youngs_modulus"]), "found": common.number(found), "error": common.number(found / truth - 1.0, 3),
                     "cost": common.number(row["cost"]), "start_cost": common.number(row["start_cost"]), "converged": row["converged"], "iterations": row["iterations"],
                     "evaluations": row["evaluations"], "steps": row["steps"]})
        if kept_way:
            kept[-1]["way"] = [common.number(w[1]["youngs_modulus"], 4) for w in row["way"]]
    return kept


HORIZONS = [0.6, 1.0]  # parts of the frames, as `pliant fit` follows its starts
REACHED = 0.25  # of the truth: what counts as converged to it


def summary(rows):
    good = [r for r in rows if abs(r["error"]) < REACHED]
    return {"starts": len(rows), "reached": len(good), "mean_error": common.number(sum(abs(r["error"]) for r in good) / len(good), 3) if good else None,
            "worst_error": common.number(max(abs(r["error"]) for r in rows), 3), "evaluations": common.median([r["evaluations"] for r in rows])}


def study_rows(study, name, capture, starts, truth, settings, estimated=("youngs_modulus",), **more):
    rows = judged(study.minimise(name, capture, starts, settings, list(estimated), **({"horizons": HORIZONS} | more)), truth)
    told = summary(rows)
    print(f"{name}: {told['reached']} of {told['starts']} reach the truth, mean error {told['mean_error']}, {told['evaluations']} evaluations", flush=True)
    return {**told, "rows": rows}


# Studies ----------------------------------------------------------------------------------------------------------------

def views(study):
    """Figures 10a and 21: cameras at random places above the floor."""
    generator = random.Random(SEED)
    places = [on_hemisphere(generator, 0.75) for _ in range(8)]
    found = {}
    for count in (2,) if study.small else (1, 2, 4, 8):
        capture = torus(study, f"torus-views-{count}", [torus_camera(name=f"camera_{i + 1}", eye=places[i]) for i in range(count)])
        starts = log_uniform_starts(study.count(20), TORUS[0], SEED)
        found[str(count)] = study_rows(study, f"views-{count}", capture, starts, TORUS[0], torus_known(study) | {"wide_band": band(PAPER_BAND, 15.4)})
    return found


def same_cells(study):
    """One camera as of `views`, of a recording that is simulated on the fit's own cells: what of an error is the mesh's, and what the steps'."""
    place = on_hemisphere(random.Random(SEED), 0.75)
    capture = torus(study, "torus-same-cells", [torus_camera(name="camera_1", eye=place)], finer=1.0)
    starts = log_uniform_starts(study.count(5), TORUS[0], SEED)
    settings = torus_known(study) | {"wide_band": band(PAPER_BAND, 15.4)}
    found = {"1": study_rows(study, "same-cells", capture, starts, TORUS[0], settings)}
    if not study.small:
        found["third"] = study_rows(study, "same-cells-short-steps", capture, starts[:2], TORUS[0], settings | {"steps": 3})
    return found


def resolutions(study):
    """Figures 10b and 22: pixels of one camera."""
    found = {}
    for pixels in (20,) if study.small else (20, 50, 100, 200):
        capture = torus(study, f"torus-pixels-{pixels}", [torus_camera(pixels)])
        starts = log_uniform_starts(study.count(20), TORUS[0], SEED)
        found[str(pixels)] = study_rows(study, f"pixels-{pixels}", capture, starts, TORUS[0], torus_known(study) | {"wide_band": band(PAPER_BAND, 15.4)}, points_per_frame=1000)
    return found


def bands(study):
    """Figure 23: phi_max and the sensor's noise, 14 starts."""
    found = {}
    for wide in (1.0,) if study.small else (1.0, 5.0):
        for noise in (0.1,) if study.small else (0.1, 1.0):
            capture = torus(study, f"torus-noise-{noise:g}", [torus_camera(noise=noise)])
            starts = log_uniform_starts(study.count(14), TORUS[0], SEED + 1)
            found[f"{wide:g}, {noise:g}"] = study_rows(study, f"band-{wide:g}-{noise:g}", capture, starts, TORUS[0], torus_known(study) | {"wide_band": band(wide, 15.4)})
    return found


def differences(study):
    """Figure 24: forward differences in place of the adjoint, with Rprop, seven starts."""
    capture = torus(study, "torus-pixels-50", [torus_camera(50)])
    starts = log_uniform_starts(study.count(7), TORUS[0], SEED + 2)
    settings = torus_known(study) | {"wide_band": band(PAPER_BAND, 15.4)}
    found = {}
    for width in (100.0,) if study.small else (0.0, 5.0, 100.0):
        found[f"{width:g}"] = study_rows(study, f"difference-{width:g}", capture, starts, TORUS[0], settings, optimiser="rprop", horizons=[1.0], max_iterations=5 if study.small else 40,
                                         difference=width)
    return found


def swept(truth, study, decades=1.0):
    half = 2 if study.small else 12
    return [truth * 10.0**(decades * i / half) for i in range(-half, half + 1)]


def curve(rows, truth):
    """Value, cost and E dJ/dE of a sweep, and where the derivative points away from the truth."""
    good = [r for r in rows if r["succeeded"]]
    lowest = min(good, key=lambda r: r["cost"])["value"] if good else None
    wrong = [r["value"] for r in good if abs(r["value"] / truth - 1.0) > 0.05 and (r["gradient"] > 0.0) != (r["value"] > truth)]
    return {"values": [common.number(r["value"]) for r in good], "costs": [common.number(r["cost"]) for r in good],
            "slopes": [common.number(r["value"] * r["gradient"]) for r in good], "lowest_at": common.number(lowest), "wrong_signs": [common.number(w) for w in wrong],
            "failed": len(rows) - len(good)}


def told_curve(name, found):
    print(f"{name}: lowest at {found['lowest_at']}, wrong signs at {found['wrong_signs']}", flush=True)
    return found


def steps(study):
    """Figure 18: gradients over Young's modulus for growing numbers of frames and noises."""
    found = {}
    for noise in (0.1,) if study.small else (0.0, 0.1, 1.0):
        capture = torus(study, f"torus-noise-{noise:g}", [torus_camera(noise=noise)])
        for frames in (20,) if study.small else (10, 20, 30, 40):
            name = f"steps-{frames}-{noise:g}"
            rows = study.sweep(name, capture, swept(TORUS[0], study), torus_known(study) | {"wide_band": band(PAPER_BAND, 15.4)}, frames=frames)
            found[f"{frames}, {noise:g}"] = told_curve(name, curve(rows, TORUS[0]))
    return found


def widths(study):
    """Figure 20: gradients for several phi_max."""
    capture = torus(study, "torus-noise-0.1", [torus_camera(noise=0.1)])
    found = {}
    for wide in (1.0,) if study.small else (0.25, 0.5, 1.0, 2.0, 3.5, 5.0, 7.5):
        name = f"width-{wide:g}"
        found[f"{wide:g}"] = told_curve(name, curve(study.sweep(name, capture, swept(TORUS[0], study), torus_known(study) | {"wide_band": band(wide, 15.4)}), TORUS[0]))
    return found


def difference_gradients(study):
    """Figure 19: forward differences of 5 and 100 Pa beside the adjoint."""
    capture = torus(study, "torus-pixels-50", [torus_camera(50)])
    found = {}
    for width in (0.0,) if study.small else (0.0, 5.0, 100.0):
        name = f"gradient-difference-{width:g}"
        rows = study.sweep(name, capture, swept(TORUS[0], study, 0.7), torus_known(study) | {"wide_band": band(PAPER_BAND, 15.4)}, difference=width)
        found[f"{width:g}"] = told_curve(name, curve(rows, TORUS[0]))
    return found


def block(study):
    """A block that hangs from its left end (figure 3)."""
    E = 1000.0
    text = scene_text("block under gravity", "box = { size = [0.3, 0.1, 0.1], facet = 0.02 }", "translation = [0.0, 0.5, 0.0]", "density = 50.0", (E, 0.3, 0.1, 0.01),
                      10 if study.small else 40, 0.025, camera("camera", (0.1, 0.6, 0.8), (0.0, 0.42, 0.0), 50, 0.0),
                      more="[[fixed]]\nhalf_space = { point = [-0.125, 0.5, 0.0], normal = [-1.0, 0.0, 0.0] }\n", trajectory=True)
    return study.record("block", text), E, {"cells": 12, "poissons_ratio": 0.3, "mass_damping": 0.1, "stiffness_damping": 0.01, "wide_band": 0.3}


def shape(study, name, spacing):
    path = study.work / f"{name}.ply"
    study.ask(f"shape-{name}", {"task": "shape", "shape": name, "spacing": spacing, "out": str(path)})
    return path


def tree(study, noise=0.0, every=1):
    """A tree that bends under its weight; its foot is held (figure 7)."""
    E, cell = 4000.0, 0.022
    path = shape(study, "tree", 0.011)
    view = camera("camera", (0.1, 0.5, 1.3), (0.0, 0.22, 0.0), 50, noise).replace("vertical_fov_deg", f"every = {every}\nvertical_fov_deg")
    text = scene_text("tree that bends", f'surface = "{path.name}"', "", "density = 60.0", (E, 0.3, 0.1, 0.01), 10 if study.small else 70, cell, view,
                      more="[[fixed]]\nhalf_space = { point = [0.0, 0.03, 0.0], normal = [0.0, -1.0, 0.0] }\n", trajectory=True)
    capture = study.record(f"tree-{noise:g}-{every}", text)
    return capture, E, {"cells": 20, "poissons_ratio": 0.3, "mass_damping": 0.1, "stiffness_damping": 0.01, "wide_band": 0.15}


def costs(study):
    """Figures 3 and 7: the costs of known displacements, of distance fields, and of points on the surface."""
    found = {}
    capture, E, settings = block(study)
    for cost in ("displacement", "field", "surface"):
        found[f"block, {cost}"] = told_curve(f"block, {cost}", curve(study.sweep(f"cost-block-{cost}", capture, swept(E, study), settings, cost=cost), E))
    capture, E, settings = tree(study)
    for cost in ("displacement", "surface"):
        found[f"tree, {cost}"] = told_curve(f"tree, {cost}", curve(study.sweep(f"cost-tree-{cost}", capture, swept(E, study), settings, cost=cost), E))
    capture, E, settings = tree(study, noise=0.022 * math.sqrt(3.0), every=10)
    found["tree, every 10th frame with noise"] = told_curve("tree, noise", curve(study.sweep("cost-tree-noise", capture, swept(E, study), settings), E))
    return found


BALL = (2000.0, 0.3, 0.1, 0.004)
BALL_KNOWN = {"cells": 10, "poissons_ratio": 0.3, "mass_damping": 0.1, "stiffness_damping": 0.004, "friction": 0.0}


def ball(study, name, tilt=(0.0, 0.0), height=0.0, velocity=(0.0, 0.0, 0.0), change=None):
    """A ball thrown on the ground, 20 frames."""
    cell = 0.02
    normal = (math.sin(tilt[0]), math.cos(tilt[0]) * math.cos(tilt[1]), math.sin(tilt[1]) * math.cos(tilt[0]))
    text = scene_text("ball on the ground", "sphere = { radius = 0.1, subdivisions = 4 }", "translation = [0.0, 0.16, 0.0]", "density = 100.0", BALL, 20, cell,
                      camera("camera", (0.0, 0.35, 0.75), (0.0, 0.1, 0.0), 50, 0.07 * cell), plane((0.0, height, 0.0), normal, 0.0),  # a steep one would stand before the camera
                      more=f"[initial]\nlinear_velocity = {common.toml(list(velocity))}\nangular_velocity = [0.0, 0.0, 0.0]\nknown = true\n")
    return study.record(name, text, change)


def error_of_fit(study, name, capture):
    """Of `pliant fit`, which is given no start."""
    known = {f"{key}.estimate": False for key in BALL_KNOWN if key != "cells"} | {"contact_stiffness.estimate": False}
    figures = common.fit(study.pliant, capture, study.work / f"fit-{name}", BALL_KNOWN | known | {"alternatives": False})
    return common.number(figures["result"]["parameters"]["youngs_modulus"]["value"] / BALL[0] - 1.0, 3)


def random_ground(generator):
    return {"tilt": (generator.uniform(-0.5, 0.5), generator.uniform(-0.5, 0.5)), "height": generator.uniform(-0.03, 0.02),
            "velocity": (generator.uniform(-1.0, 1.0), generator.uniform(-1.5, 0.5), generator.uniform(-0.5, 0.5))}


def grounds(study):
    """Figures 25 and 26: six grounds and throws, the same 20 starts on each."""
    generator, found = random.Random(SEED), {}
    for i in range(1 if study.small else 6):
        capture = ball(study, f"ball-{i + 1}", **random_ground(generator))
        starts = log_uniform_starts(study.count(20), BALL[0], SEED)
        found[str(i + 1)] = study_rows(study, f"ground-{i + 1}", capture, starts, BALL[0], BALL_KNOWN | {"wide_band": band(1.0, 10)})
        if not study.small:
            found[str(i + 1)]["fit_error"] = error_of_fit(study, f"ground-{i + 1}", capture)
    return found


def without_gravity(text):
    """The capture of someone who knows which way is up, and no more."""
    return re.sub(r"gravity = \[.*", "up = [0.0, 1.0, 0.0]", text)


def joint(study):
    """Figures 11, 27 and 28: gravity, Young's modulus and stiffness damping together, 60 starts."""
    capture = ball(study, "ball-joint", velocity=(0.3, 0.0, 0.0), change=without_gravity)
    generator = random.Random(SEED)
    starts = [{"youngs_modulus": common.log_uniform(generator, 200.0, 20000.0), "stiffness_damping": common.log_uniform(generator, 0.0004, 0.04),
               "gravity": [0.0, -common.log_uniform(generator, 5.0, 20.0), 0.0]} for _ in range(study.count(60))]
    rows = study.minimise("joint", capture, starts, BALL_KNOWN | {"wide_band": band(2.0, 10)}, ["youngs_modulus", "stiffness_damping", "gravity"],
                          max_iterations=3 if study.small else 40)
    kept = []
    for row in rows:
        found, start = row["found"], row["start"]
        length = math.sqrt(common.dot(found["gravity"], found["gravity"]))
        kept.append({"start": {"youngs_modulus": common.number(start["youngs_modulus"]), "stiffness_damping": common.number(start["stiffness_damping"]),
                               "gravity": common.number(-start["gravity"][1])},
                     "youngs_modulus": common.number(found["youngs_modulus"]), "stiffness_damping": common.number(found["stiffness_damping"]), "gravity": common.number(length),
                     "tilt_deg": common.number(math.degrees(math.acos(min(1.0, -found["gravity"][1] / length))), 3), "cost": common.number(row["cost"]),
                     "start_cost": common.number(row["start_cost"]), "converged": row["converged"], "evaluations": row["evaluations"]})
    print("joint:", [(r["youngs_modulus"], r["stiffness_damping"], r["gravity"]) for r in kept], flush=True)
    return {"truth": {"youngs_modulus": BALL[0], "stiffness_damping": BALL[3], "gravity": 9.81}, "rows": kept, "ridge": ridge(study, capture)}


def ridge(study, capture):
    """The lowest cost over stiffness damping at each Young's modulus: how flat the valley is."""
    found = []
    for factor in (0.8, 1.25) if study.small else (0.5, 0.63, 0.8, 0.9, 1.0, 1.11, 1.25, 1.6, 2.0):
        settings = BALL_KNOWN | {"wide_band": band(2.0, 10), "youngs_modulus": factor * BALL[0]}
        row, = study.minimise(f"ridge-{factor:g}", capture, [{"stiffness_damping": BALL[3]}], settings, ["stiffness_damping", "gravity"],
                              max_iterations=3 if study.small else 25)
        found.append({"youngs_modulus": factor * BALL[0], "stiffness_damping": common.number(row["found"]["stiffness_damping"]), "cost": common.number(row["cost"])})
    return found


def scaled_mesh(study, name, longest):
    """A shared mesh whose longest edge of the box is so long, the box's middle at the origin; None where it is not there."""
    source = common.shared_data() / "rest-meshes" / name
    if not source.exists():
        print(f"{name}: no {source}; left out", flush=True)
        return None
    vertices, faces = [], []
    for line in source.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(w) for w in words[1:4]])
        elif words[:1] == ["f"]:
            faces.append([w.split("/")[0] for w in words[1:]])
    low, high = ([pick(v[d] for v in vertices) for d in range(3)] for pick in (min, max))
    scale = longest / max(h - l for l, h in zip(low, high))
    path = study.work / f"scaled-{name}"
    with open(path, "w") as file:
        for v in vertices:
            file.write("v " + " ".join(f"{scale * (x - 0.5 * (l + h)):.9g}" for x, l, h in zip(v, low, high)) + "\n")
        for face in faces:
            file.write("f " + " ".join(face) + "\n")
    half = [0.5 * scale * (h - l) for l, h in zip(low, high)]
    return path, half


COMPLEX_KNOWN = {"cells": 20, "poissons_ratio": 0.3, "mass_damping": 0.1, "stiffness_damping": 0.01, "wide_band": 0.15}
COMPLEX = (3000.0, 0.3, 0.1, 0.01)


def complex_body(study, name):
    """A body of many parts held at its hind end, let go under its weight: 10 frames."""
    made = scaled_mesh(study, name, 0.3)
    if not made:
        return None
    path, half = made
    text = scene_text(f"{name} held at one end", f'surface = "{path.name}"', "", "density = 100.0", COMPLEX, 10, 0.3 / 20, camera("camera", (0.6, 0.25, 0.35), (0.0, 0.0, 0.0), 50, 0.0015),
                      more=f"[[fixed]]\nhalf_space = {{ point = [0.0, 0.0, {0.7 * half[2]!r}], normal = [0.0, 0.0, 1.0] }}\n")
    return study.record(f"complex-{path.stem}", text)


def bodies(study):
    """Figures 9 and 29, with other bodies in the dragon's place."""
    found = {}
    for name in SHARED_MESHES[:1] if study.small else SHARED_MESHES:
        capture = complex_body(study, name)
        if capture:
            starts = log_uniform_starts(study.count(20), COMPLEX[0], SEED)
            found[name] = study_rows(study, f"complex-{name}", capture, starts, COMPLEX[0], COMPLEX_KNOWN)
    return found


RAMP = (3430.0, 0.3, 0.2, 0.01)
RAMP_UNKNOWN = ["youngs_modulus", "mass_damping", "stiffness_damping", "gravity", "plane"]


def with_wrong_ramp(text):
    """Gravity's strength is not given, and the ramp is 8 degrees and 30 mm off where it is said to be."""
    text = without_gravity(text)
    angle = math.radians(22.0 - 8.0)
    normal = [math.sin(angle), math.cos(angle), 0.0]
    point = [-0.03 * n for n in normal]
    head, tail = text.split("[[plane]]", 1)
    tail = re.sub(r"point = \[.*?\]", f"point = {common.toml(point)}", tail, count=1)
    tail = re.sub(r"normal = \[.*?\]", f"normal = {common.toml(normal)}", tail, count=1)
    return head + "[[plane]]" + tail.replace("known = true", "known = false", 1)


def ramp(study):
    """A pillow that falls on a ramp that the camera does not see (figures 14 and 31)."""
    path, angle = shape(study, "pillow", 0.016), math.radians(22.0)
    text = scene_text("pillow on a ramp", f'surface = "{path.name}"', "translation = [0.0, 0.3, 0.0]\naxis = [0.0, 0.0, 1.0]\nangle_deg = 15.0", "mass = 0.34", RAMP,
                      10 if study.small else 36, 0.46 / 12, camera("camera", (0.2, 0.8, 1.4), (0.05, 0.2, 0.0), 120, 0.002, 45.0),
                      plane((0.0, 0.0, 0.0), (math.sin(angle), math.cos(angle), 0.0), 0.0))
    return study.record("ramp", text, with_wrong_ramp)


OPTIMISERS = ("levenberg_marquardt", "rprop", "lbfgs", "gradient_descent")


def optimisers(study):
    """Figures 30 and 31: four optimisers from the same starts, one thread each."""
    cases = {}
    cases["torus"] = (torus(study, "torus-pixels-50", [torus_camera(50)]), TORUS, torus_known(study) | {"wide_band": band(PAPER_BAND, 15.4)}, ["youngs_modulus"],
                      log_uniform_starts(study.count(2), TORUS[0], SEED))
    generator = random.Random(SEED)
    cases["ball"] = (ball(study, "ball-1", **random_ground(generator)), BALL, BALL_KNOWN | {"wide_band": band(1.0, 10)}, ["youngs_modulus"],
                     log_uniform_starts(study.count(2), BALL[0], SEED))
    body = complex_body(study, SHARED_MESHES[0])
    if body:
        cases["spot"] = (body, COMPLEX, COMPLEX_KNOWN, ["youngs_modulus"], log_uniform_starts(study.count(2), COMPLEX[0], SEED))
    generator = random.Random(SEED)
    cases["ramp"] = (ramp(study), RAMP, {"cells": 12, "poissons_ratio": 0.3, "wide_band": 0.15}, RAMP_UNKNOWN,
                     [{"youngs_modulus": common.log_uniform(generator, RAMP[0] / 5, 5 * RAMP[0]), "mass_damping": common.log_uniform(generator, 0.04, 1.0),
                       "stiffness_damping": common.log_uniform(generator, 0.002, 0.05), "gravity": [0.0, -common.log_uniform(generator, 7.0, 14.0), 0.0]}
                      for _ in range(study.count(2))])
    found = {}
    for case, (capture, material, settings, estimated, starts) in cases.items():
        if study.small and case in ("torus", "spot"):
            continue
        for optimiser in OPTIMISERS:
            limit = 3 if study.small else 60
            rows = study.minimise(f"optimiser-{case}-{optimiser}", capture, starts, settings, estimated, optimiser=optimiser, max_iterations=limit, serial=True)
            found[f"{case}, {optimiser}"] = [
                {"found": {name: common.rounded(value, 5) for name, value in row["found"].items()}, "start_cost": common.number(row["start_cost"]),
                 "cost": common.number(row["cost"]), "error": common.number(row["found"]["youngs_modulus"] / material[0] - 1.0, 3), "converged": row["converged"],
                 "succeeded": row["succeeded"], "reason": row["reason"], "evaluations": row["evaluations"], "steps": row["steps"], "processor_seconds": common.number(row["processor_seconds"], 3),
                 "costs": [common.number(w[0]) for w in row["way"]]} for row in rows]
            print(case, optimiser, [(r["error"], r["evaluations"], r["cost"], r["processor_seconds"]) for r in found[f"{case}, {optimiser}"]], flush=True)
    return found


ALL = {"views": views, "same-cells": same_cells, "resolutions": resolutions, "bands": bands, "differences": differences, "steps": steps, "widths": widths,
       "difference-gradients": difference_gradients, "costs": costs, "grounds": grounds, "joint": joint, "bodies": bodies, "optimisers": optimisers}
