#!/usr/bin/env python3
"""A bar, and a bar of two stiffnesses, bent and let go: recordings of another simulator (other elements, another material law, three
depth sensors fused to clouds).

Both are fitted with no choice of ours: nobody tells the program where the second bar's materials meet, nor that there are two. Once
more that one is fitted as two regions, as one who knows the place would write, and with one modulus. truth.json is read for
judging only. Standard library only."""
import math
import pathlib
import struct
import sys
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

EVEN, ZONES = "oracle-release", "oracle-release-zones"
NAMES = ["youngs_modulus", "poisson_ratio", "mass_damping", "stiffness_damping"]
START = 5              # the frame of the release
LOWER = """
[[region]]
name = "lower part"
half_space = { point = [0.0, -0.18, 0.0], normal = [0.0, -1.0, 0.0] }
"""
GIVEN_POISSON = {"poissons_ratio.estimate": False}  # it stays at the program's own start value

# name: (capture, choices)
FITS = {
    "even": ("even", {}),
    "zones": ("zones", {}),
    "one-modulus": ("zones", {"control_points": 1}),
    "regions": ("regions", {}),
    "regions-given-poisson": ("regions", GIVEN_POISSON),
    "regions-finer": ("regions", {"cells": 24}),
}


def captures(work):
    """Folders that point at the recordings' files: as they are, and with the lower material named."""
    shared = common.shared_data()
    for name, source, change in (("even", EVEN, lambda text: text), ("zones", ZONES, lambda text: text),
                                 ("regions", ZONES, lambda text: text + LOWER)):
        if not (shared / source / "capture.toml").exists():
            continue
        folder = work / "captures" / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "capture.toml").write_text(change((shared / source / "capture.toml").read_text()))
        for file in ("rest.ply", "clouds"):
            if not (folder / file).is_symlink():
                (folder / file).symlink_to((shared / source / file).resolve())
    return work / "captures"


def elements_of(model):
    """(lower and upper end [m], volume of its part inside the object [m^3], Young's modulus [Pa]) of each cell of a model."""
    a = common.read_vtu(model)
    points, nodes, ends = a["points"], a["connectivity"], a["offsets"]
    elements, begin = [], 0
    for end, modulus, fill in zip(ends, a["youngs_modulus [Pa]"], a["fill"]):
        corners = [points[3 * int(n):3 * int(n) + 3] for n in nodes[begin:int(end)]]
        begin = int(end)
        low, high = ([pick(c[d] for c in corners) for d in range(3)] for pick in (min, max))
        elements.append((low[1], high[1], fill * math.prod(h - l for l, h in zip(low, high)), modulus))
    return elements


def zones_of(model, zones):
    """Mean of Young's modulus over each zone's elements, weighted by their volume in it, and beside it the zone's truth."""
    out = []
    elements = elements_of(model)
    for zone in zones:
        inside = [(volume * max(0.0, min(high, zone["y_max"]) - max(low, zone["y_min"])) / (high - low), modulus)
                  for low, high, volume, modulus in elements]
        mean = sum(v * E for v, E in inside) / sum(v for v, _ in inside)
        out.append({"from": zone["y_min"], "to": zone["y_max"], "mean": common.number(mean), "truth": zone["value"]})
    return out


def swing_errors(fit, source, first):
    """How far the free end of a fit's motion is off the true one, rms of each coordinate [m] over the frames."""
    data = common.shared_data() / source / "truth"
    with zipfile.ZipFile(data / "trajectory.npz") as archive:
        (frames, count, _), q = common.read_array(archive, "q")
        scale = common.read_array(archive, "scale")[1][0]
    ply = (data / "reference.ply").read_bytes()
    rest = struct.unpack_from(f"<{3 * count}d", ply, ply.index(b"end_header\n") + 11)
    files = sorted((fit / "frames").glob("*.vtu"))
    squares, end = [0.0] * 3, None
    for k in range(min(len(files), frames - first)):
        frame = common.read_vtu(files[k])
        moved, there = frame["displacement [m]"], frame["points"]
        if end is None:  # nodes about 30 mm from the end, and the true surface's vertices at their height
            heights = [there[3 * n + 1] - moved[3 * n + 1] for n in range(len(there) // 3)]
            end = [n for n, y in enumerate(heights) if abs(y + 0.33) < 0.02]
            height = sum(heights[n] for n in end) / len(end)
            true_end = [n for n in range(count) if abs(rest[3 * n + 1] - height) < 0.012]
        for d in range(3):
            simulated = sum(moved[3 * n + d] for n in end) / len(end)
            true = sum(scale * q[3 * (count * (k + first) + n) + d] - rest[3 * n + d] for n in true_end) / len(true_end)
            squares[d] += (simulated - true) ** 2 / min(len(files), frames - first)
    return [common.number(math.sqrt(v), 3) for v in squares]


def main():
    arguments = common.arguments(__doc__, gather={"action": "store_true", "help": "no new fits: gather those that are in --work"})
    folder = captures(arguments.work)
    truth = {name: common.read(common.shared_data() / name / "truth.json")["parameters"] for name in (EVEN, ZONES)}
    fits = {}
    for name, (capture, choices) in FITS.items():
        if not (folder / capture).exists():
            print(f"{name}: its recording is not there, left out")
            continue
        if arguments.gather and not (arguments.work / name / "figures.json").exists():
            continue
        figures = common.fit(arguments.program, folder / capture, arguments.work / name, choices)
        result = figures.pop("result")
        own = truth[EVEN if capture == "even" else ZONES]
        parameters = {}
        for key, p in result["parameters"].items():
            if key in NAMES or key.startswith("youngs_modulus"):
                value = own.get(key, {}).get("value")
                parameters[key] = {"value": common.number(p["value"]), "std": common.number(p.get("std"), 2), "interval_90": p.get("interval_90"), "unit": p["unit"],
                                   "truth": value if isinstance(value, (int, float)) else None}
        model = arguments.work / name / "model.toml"
        fits[name] = {"capture": capture, "elements": len(elements_of(model.with_suffix(".vtu"))),
                      "control_points": len(result.get("fields", {}).get("youngs_modulus", {}).get("control_points", [])) or 1,
                      "choices": choices, "parameters": parameters,
                      "field": [{"y": common.number(c[1], 4), "value": common.number(c[3]), "std": common.number(c[4], 2)}
                                for c in result.get("fields", {}).get("youngs_modulus", {}).get("control_points", [])],
                      "surface_rms": common.number(result["error"]["surface_rms"], 4), "points": result["error"]["points"],
                      "cost": common.number(result["cost"]["final"]), "verdict": result["verdict"],
                      "converged": figures["exit_code"] == 0, "commit": result["software"]["commit"], **figures}
        fits[name]["swing_errors"] = swing_errors(arguments.work / name, EVEN if capture == "even" else ZONES, START)
        if capture != "even":
            fits[name]["zones"] = zones_of(model.with_suffix(".vtu"), own["youngs_modulus"]["value"]["zones"])
        zones = ", ".join(f"{z['mean'] / 1e3:.0f} ({z['truth'] / 1e3:.0f})" for z in fits[name].get("zones", []))
        print(f"{name}: E {parameters['youngs_modulus']['value']}, zones [kPa] {zones}, nu {parameters['poisson_ratio']['value']}, "
              f"cost {fits[name]['cost']}, {figures['wall_seconds']} s", flush=True)
    common.write_results(__file__, {"fits": fits})


if __name__ == "__main__":
    main()
