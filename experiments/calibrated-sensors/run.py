#!/usr/bin/env python3
"""Three depth sensors that are badly calibrated: a ring is dropped before them, and a ball moved about. Two are stated 2 degrees and 20 mm
off, one of them also takes its images 8 ms late through a lens that bends. `pliant calibrate` by the ball, applied to the recording of the
ring, and fits of that with the cameras as they are stated, as they were found, and as they truly are. No choice of ours but that the
points themselves are fitted (tracking=off) in all three. The truth judges only. Standard library only."""
import json
import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

RADIUS, RATE, FRAMES = 0.08, 30.0, 90
MIDDLE = (0.0, 0.3, 0.0)
WAY = ((0.26, 3.0, 0.0), (0.2, 4.3, 1.0), (0.22, 2.3, 2.0))  # of the ball along each axis: A sin(w t + phase)
CHOICES = {"tracking": "off"}
CAMERAS = {
    "left": {"eye": [-0.6, 0.6, 0.85], "wrong": {}, "truth": {}},
    "right": {"eye": [0.75, 0.55, 0.75], "wrong": {"turn_deg": [0.8, 1.6, -0.8], "shift": [0.014, -0.010, 0.010], "distortion": [], "time_offset": 0.0},
              "truth": {"distortion": [-0.15, 0.03, 0.0, 0.0], "time_offset": 0.008}},
    "top": {"eye": [0.1, 1.2, 0.5], "wrong": {"turn_deg": [1.4, 0.0, -1.4], "shift": [-0.012, 0.012, 0.010]}, "truth": {}},
}


def cameras(wrong):
    text = ""
    for name, camera in CAMERAS.items():
        text += f"""
[[camera]]
name = "{name}"
width = 240
height = 180
eye = {camera["eye"]}
target = {list(MIDDLE)}
vertical_fov_deg = 51
sensor = {{ preset = "structured-light" }}
""" + "".join(f"{key} = {common.toml(value)}\n" for key, value in camera["truth"].items())
        if wrong and camera["wrong"]:
            text += f"stated = {common.toml(camera['wrong'])}\n"
    return text


def ring(wrong):
    return f"""format = "scene/1"
name = "ring before three sensors"
seed = 3
[object]
torus = {{ ring_radius = 0.13, tube_radius = 0.05, ring_segments = 96, tube_segments = 48 }}
translation = [0.0, 0.35, 0.0]
axis = [1.0, 0.0, 0.2]
angle_deg = 35
mass = 0.456
[material]
youngs_modulus = 4000.0
poissons_ratio = 0.3
mass_damping = 0.3
stiffness_damping = 0.004
[world]
gravity = [0.0, -9.81, 0.0]
[timing]
frame_rate = 60.0
frame_count = 40
start_frame = 3
[simulation]
cell_size = 0.016
substeps = 8
[[plane]]
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
half_size = 1.5
""" + cameras(wrong)


def ball():
    """A light ball that a force leads along its way; `pliant synth` knows no hand that carries one."""
    mass = 0.1
    here = [m + a * math.sin(p) for m, (a, w, p) in zip(MIDDLE, WAY)]
    speed = [a * w * math.cos(p) for a, w, p in WAY]
    keys = [{"time": k / RATE, "force": [-mass * a * w * w * math.sin(w * k / RATE + p) for a, w, p in WAY]} for k in range(FRAMES + 1)]
    return f"""format = "scene/1"
name = "ball"
seed = 4
[object]
sphere = {{ radius = {RADIUS}, subdivisions = 4 }}
translation = {here}
mass = {mass}
[material]
youngs_modulus = 1e5
poissons_ratio = 0.3
stiffness_damping = 0.01
[world]
gravity = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
[timing]
frame_rate = {RATE}
frame_count = {FRAMES}
[simulation]
cell_size = 0.04
[initial]
linear_velocity = {speed}
[[force]]
at = {[here[0], here[1] + RADIUS, here[2]]}
radius = {4 * RADIUS}
over_time = [{", ".join(common.toml(key) for key in keys)}]
""" + cameras(True)


def pose_error(found, true):
    """Angle [degrees] and way at the scene's middle [m] between two poses, 4 x 4."""
    trace = sum(found[i][k] * true[i][k] for i in range(3) for k in range(3))
    back = [sum(true[i][k] * (MIDDLE[i] - true[i][3]) for i in range(3)) for k in range(3)]
    there = [sum(found[i][k] * back[k] for k in range(3)) + found[i][3] for i in range(3)]
    return math.degrees(math.acos(max(-1.0, min(1.0, 0.5 * (trace - 1.0))))), math.dist(there, MIDDLE)


def main():
    arguments = common.arguments(__doc__)
    work, program = arguments.work, arguments.program
    captures = {}
    for name, text in {"true": ring(False), "stated": ring(True), "ball": ball()}.items():
        captures[name] = work / name
        if not (captures[name] / "capture.toml").exists():
            (work / f"{name}.toml").write_text(text)
            common.run(program, "synth", work / f"{name}.toml", "--out", captures[name])
    # A recording of a ball has no scan: it is anywhere.
    facts = captures["ball"] / "capture.toml"
    facts.write_text(facts.read_text().replace('surface = "rest.ply"\n', "").split("[[force]]")[0] + "[[depth]]" + facts.read_text().split("[[depth]]", 1)[1])
    captures["calibrated"] = work / "calibrated"
    timing = common.run(program, "calibrate", captures["ball"], "--ball", RADIUS, "--reference", "left", "--apply", captures["stated"], "--out", captures["calibrated"])
    truth = common.read(captures["true"] / "truth.json")
    sensors = {}
    for sensor in common.read(captures["calibrated"] / "calibration.json")["sensors"]:
        true = truth["cameras"][sensor["name"]]
        degrees, way = pose_error(sensor["camera_to_world"], true["camera_to_world"])
        sensors[sensor["name"]] = {
            "turned": common.number(math.degrees(sensor["turned"])), "moved": common.number(sensor["moved"]), "pose_error_deg": common.number(degrees, 3),
            "pose_error": common.number(way, 3), "time_offset": common.number(sensor["time_offset"], 4), "true_time_offset": true["time_offset"],
            "distortion": [common.number(k, 3) for k in sensor["distortion"]], "true_distortion": true["distortion"],
            "rms_before": common.number(sensor["rms_before"], 3), "rms_after": common.number(sensor["rms_after"], 3)}
    print(json.dumps(sensors, indent=1), flush=True)
    fits = {}
    for name in ("stated", "calibrated", "true"):
        figures = common.fit(program, captures[name], work / f"fit-{name}", CHOICES)
        result = figures.pop("result")
        p = result["parameters"]
        fits[name] = {"youngs_modulus": common.number(p["youngs_modulus"]["value"]), "std": common.number(p["youngs_modulus"].get("std"), 2),
                      "surface_rms": common.number(result["error"]["surface_rms"], 4), "converged": figures["exit_code"] == 0,
                      "verdict": result.get("verdict", {}).get("kind") if isinstance(result.get("verdict"), dict) else result.get("verdict"),
                      "mass_damping": common.number(p["mass_damping"]["value"], 3), "stiffness_damping": common.number(p["stiffness_damping"]["value"], 3),
                      "commit": result["software"]["commit"], **figures}
        print(name, fits[name], flush=True)
    common.write_results(__file__, {"choices": CHOICES, "truth": {k: v["value"] for k, v in truth["parameters"].items()}, "calibration": timing, "sensors": sensors, "fits": fits})


if __name__ == "__main__":
    main()
