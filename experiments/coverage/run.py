#!/usr/bin/env python3
"""How often the stated intervals hold the truth, on recordings by `pliant synth` under physics that the fit does not use.

    run.py [PROGRAM] [--count N] [--minutes M] [--jobs J] [--again 1] [--work FOLDER]

Each recording is of a drawn shape, material, throw and camera, by smaller elements and steps than a fit takes, and differs from what a
fit assumes in one more way, its family: the law at large strain, the damping, how hard and smooth the floor is, a coefficient of
friction that the capture has wrong, a stiffness that varies by a tenth within the body, or nothing more. Fits get no choices. The
intervals are counted by family, over results that do not doubt themselves; what stands for unmodelled physics (docs/uncertainty.md) may
be set by every other round of the families, so the rounds between (`held back`) are counted alone as well.

Hours on two cores, so results add up: a recording that stands in results.json, with the commit of the program that fitted it, or that is
fitted in the work folder is not fitted again unless with --again 1, and after M minutes no further one is begun. J fits run side by side,
each on its share of the processors."""
import concurrent.futures
import math
import os
import pathlib
import random
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parent / "battery")]
import common
from run import NAMES, judged, score, told

FAMILIES = ["law", "damping", "contact", "friction", "varying", "mesh"]
GRAVITY = 9.81


def unit(rng):
    v = [rng.gauss(0, 1) for _ in range(3)]
    return [x / math.hypot(*v) for x in v]


def shape(rng):
    """TOML of a shape, its volume [m^3], and the area [m^2]."""
    size = common.log_uniform(rng, 0.06, 0.25)
    kind = rng.choice(["torus", "box", "sphere"])
    if kind == "torus":
        tube = size * rng.uniform(0.14, 0.22)
        ring = size / 2 - tube
        return ({"torus": {"ring_radius": ring, "tube_radius": tube, "ring_segments": 64, "tube_segments": 32}},
                2 * math.pi ** 2 * ring * tube ** 2, 4 * math.pi ** 2 * ring * tube, size)
    if kind == "sphere":
        return ({"sphere": {"radius": size / 2, "subdivisions": 3}}, math.pi / 6 * size ** 3, math.pi * size ** 2, size)
    a, b, c = size, size * rng.uniform(0.35, 1), size * rng.uniform(0.3, 0.7)
    return {"box": {"size": [a, b, c], "facet": size / 16}}, a * b * c, 2 * (a * b + b * c + c * a), size


def draw(number):
    """Family, scene as tables of TOML, and what to change in the capture afterwards."""
    rng = random.Random(1000 + number)
    family = FAMILIES[number % len(FAMILIES)]
    body, volume, area, size = shape(rng)
    density = common.log_uniform(rng, 50, 1100)
    time_scale = math.sqrt(size / GRAVITY)
    modulus = density * GRAVITY * size * common.log_uniform(rng, 8, 80)
    tilt = rng.uniform(0, 0.35) if rng.random() < 0.5 else 0.0
    turn = rng.uniform(0, 2 * math.pi)
    normal = [math.sin(tilt) * math.cos(turn), math.cos(tilt), math.sin(tilt) * math.sin(turn)]
    height = size * rng.uniform(0.75, 1.4)
    velocity = [rng.uniform(-0.5, 0.5) * size / time_scale for _ in range(3)]
    velocity[1] = -rng.uniform(0.5, 2) * size / time_scale
    spin = [rng.uniform(-1, 1) / time_scale for _ in range(3)]
    friction = rng.uniform(0.1, 0.5) if family == "friction" else 0.0
    weight = volume * density * GRAVITY
    hardness = weight / (0.25 * area * 1e-4 * size)  # of a floor that is as good as rigid
    soft = common.log_uniform(rng, 0.1, 1) if family == "contact" else 1.0
    distance, around, above = size * rng.uniform(2.4, 3.2), rng.uniform(0, 2 * math.pi), rng.uniform(0.4, 0.9)
    eye = [distance * math.cos(around) * math.cos(above), distance * math.sin(above), distance * math.sin(around) * math.cos(above)]
    frames = 24
    scene = {
        "object": {**body, "translation": [0.0, height, 0.0], "axis": unit(rng), "angle_deg": rng.uniform(0, 180), "density": density},
        "material": {"youngs_modulus": modulus, "poissons_ratio": rng.uniform(0.2, 0.47),
                     "mass_damping": common.log_uniform(rng, 0.03, 0.5) / time_scale,
                     "stiffness_damping": common.log_uniform(rng, 0.008, 0.06) * time_scale,
                     "mean_strain": "corotated" if family == "law" else "neo_hookean",
                     "damping_law": "rayleigh" if family == "damping" else "kelvin_voigt"},
        "world": {"gravity": [0.0, -GRAVITY, 0.0]},
        "timing": {"frame_rate": round(frames / (4.7 * time_scale)), "frame_count": frames, "start_frame": 1},
        "simulation": {"cell_size": size / 18, "substeps": 16, "newmark_theta": 0.5, "contact_stiffness": hardness * soft,
                       "contact_smoothing": 1e-3 * size * (common.log_uniform(rng, 1, 5) if family == "contact" else 1)},
        "initial": {"linear_velocity": velocity, "angular_velocity": spin, "known": True},
        "plane": [{"point": [0.0, 0.0, 0.0], "normal": normal, "known": True, "friction": friction, "half_size": 3 * size}],
        "camera": [{"name": "front", "width": 160, "height": 120, "eye": eye, "target": [0.0, 0.5 * size, 0.0], "vertical_fov_deg": 50.0,
                    "depth_scale": 10000.0, "sensor": {"preset": "structured-light", "noise_base": 0.006 * size, "noise_growth": 0.0,
                                                       "step": 2e-4}}]}
    if family == "varying":  # two halves, of shapes that are alike about their middle: the mean stays
        normal = unit(rng)
        scene["region"] = [{"name": f"half {i}", "half_space": {"point": [0.0, height, 0.0], "normal": [sign * x for x in normal]},
                            "youngs_modulus": modulus * (1 + 0.1 * sign)} for i, sign in enumerate((1, -1))]
    return family, scene, {"friction": max(0.0, friction + rng.gauss(0, 0.05)) if family == "friction" else None}


def write_scene(path, name, tables):
    lines = ['format = "scene/1"', f"name = {common.toml(name)}"]
    for title, blocks in tables.items():
        for block in blocks if isinstance(blocks, list) else [blocks]:
            lines += ["", f"[[{title}]]" if isinstance(blocks, list) else f"[{title}]"]
            lines += [f"{key} = {common.toml(value)}" for key, value in block.items()]
    path.write_text("\n".join(lines) + "\n")


def forget(capture, changes):
    """Takes what a fit must not know out of a capture."""
    file = capture / "capture.toml"
    kept, skips = [], False
    for line in file.read_text().splitlines():
        if line.startswith("["):
            skips = line == "[[region]]"
        if skips:
            continue
        if line.startswith("friction") and changes["friction"] is not None:
            line = f"friction = {changes['friction']!r}"
        kept.append(line)
    file.write_text("\n".join(kept) + "\n")


def true_values(capture):
    """Of truth.json, with the names that results have; a stiffness that varies by its mean."""
    parameters = common.read(capture / "truth.json")["parameters"]
    parameters["poisson_ratio"] = parameters["poissons_ratio"]
    return parameters


def one(arguments, number):
    family, scene, changes = draw(number)
    folder = arguments.work / f"{number:03}"
    capture = folder / "capture"
    if not (capture / "ready").exists():
        folder.mkdir(parents=True, exist_ok=True)
        write_scene(folder / "scene.toml", f"{family} {number}", scene)
        common.run(arguments.program, "synth", folder / "scene.toml", "--out", capture, "--seed", number)
        forget(capture, changes)
        (capture / "ready").touch()
    threads = max(1, (os.cpu_count() or 1) // arguments.jobs) if arguments.jobs > 1 else None
    figures = common.fit(arguments.program, capture, folder / "fit", threads=threads)
    result = figures.pop("result")
    return {"family": family, "commit": arguments.commit, "verdict": result["verdict"], "wall_seconds": figures["wall_seconds"],
            "surface_rms": common.number(result["error"].get("surface_rms") or 0.0, 4),
            "parameters": judged(result, true_values(capture))}


def commit():
    said = subprocess.run(["git", "-C", HERE, "rev-parse", "--short", "HEAD"], capture_output=True, text=True)
    return said.stdout.strip() or "unknown"


def known_rows():
    """Those of results.json."""
    path = HERE / "results.json"
    return common.read(path)["recordings"] if path.exists() else {}


def main():
    arguments = common.arguments(__doc__, count={"type": int, "default": 200, "help": "number of recordings"},
                                 minutes={"type": float, "default": math.inf, "help": "after which no further fit is begun"},
                                 jobs={"type": int, "default": 1, "help": "fits side by side"},
                                 again={"type": int, "default": 0, "help": "1: fit those of results.json again"})
    arguments.commit = commit()
    begin, rows = time.monotonic(), {} if arguments.again else known_rows()

    def fitted(number):
        name = f"{number:03}"
        is_late = time.monotonic() - begin > 60 * arguments.minutes
        if name in rows or is_late and not (arguments.work / name / "fit/figures.json").exists():
            return
        try:
            rows[name] = one(arguments, number)
        except SystemExit as refusal:
            rows[name] = {"family": FAMILIES[number % len(FAMILIES)], "commit": arguments.commit, "verdict": "refused",
                          "reason": str(refusal)[-500:], "parameters": {}, "wall_seconds": 0.0}
            print(f"{name}: refused\n{refusal}", flush=True)
            return
        print(rows[name]["family"], told(name, rows[name]), flush=True)

    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        list(pool.map(fitted, range(arguments.count)))
    rows = dict(sorted(rows.items()))
    parts = {"all": rows, "held back": {n: r for n, r in rows.items() if int(n) // len(FAMILIES) % 2}}
    parts |= {family: {n: r for n, r in rows.items() if r["family"] == family} for family in FAMILIES}
    scores = {part: score(of) for part, of in parts.items() if of}
    for part, s in scores.items():
        cells = [f"{NAMES[n]} {p['held']}/{p['results']} (rms {100 * p['rms_error']:.1f} %, stated {100 * p['median_deviation']:.1f} %)"
                 for n, p in s["parameters"].items()]
        print(f"{part}: {s['recordings']} recordings, {s['trusted']} explained: {'; '.join(cells)}")
    common.write_results(__file__, {"asked_for": arguments.count, "recordings": rows, "score": scores})


if __name__ == "__main__":
    main()
