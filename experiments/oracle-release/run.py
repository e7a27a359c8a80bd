#!/usr/bin/env python3
"""A bar, and a bar of two stiffnesses, bent and let go: recordings of another simulator (other elements, another material law, three
depth sensors fused to clouds).

The even bar is fitted with no choice of ours. Nobody tells the program where the second bar's materials meet: its Young's modulus is
a field over 1, 2, 3, 4 or 6 control points; and once more as two regions, as one who knows the place would write. What a user can
judge a number of control points by (cost, and how frames that took no part are predicted) stands beside what the truth says.
truth.json is read for judging only. Standard library only."""
import base64
import math
import pathlib
import struct
import sys
import xml.etree.ElementTree

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

EVEN, ZONES = "oracle-release", "oracle-release-zones"
NAMES = ["youngs_modulus", "poisson_ratio", "mass_damping", "stiffness_damping"]
SHORT = 60             # frames of the shortened recording; those after it are predicted
INDEPENDENT = 50       # points a frame counts as, in the cost
LOWER = """
[[region]]
name = "lower part"
half_space = { point = [0.0, -0.18, 0.0], normal = [0.0, -1.0, 0.0] }
"""
GIVEN_POISSON = {"poisson_ratio.estimate": False}  # it stays at the program's own start value

# name: (capture, choices)
FITS = {
    "even": ("even", {}),
    "regions": ("regions", {}),
    **{f"points-{n}": ("zones", {"control_points": n}) for n in (1, 2, 3, 4, 6)},
    "regions-given-poisson": ("regions", GIVEN_POISSON),
    **{f"points-{n}-given-poisson": ("zones", {"control_points": n, **GIVEN_POISSON}) for n in (2, 3, 4, 6)},
    "regions-finer": ("regions", {"cells": 20}),
    **{f"short-{n}": ("short", {"control_points": n}) for n in (1, 2, 3, 4, 6)},
    "short-regions": ("short-regions", {}),
    "even-finer": ("even", {"cells": 20}),
    "points-4-finer": ("zones", {"control_points": 4, "cells": 20}),
}


def captures(work):
    """Folders that point at the recordings' files: as they are, shortened, and with the lower material named."""
    shared = common.shared_data()
    shorter = lambda text: text.replace("frame_count = 90", f"frame_count = {SHORT}")
    for name, source, change in (("even", EVEN, lambda text: text), ("zones", ZONES, lambda text: text),
                                 ("regions", ZONES, lambda text: text + LOWER), ("short", ZONES, shorter),
                                 ("short-regions", ZONES, lambda text: shorter(text) + LOWER)):
        if not (shared / source / "capture.toml").exists():
            continue
        folder = work / "captures" / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "capture.toml").write_text(change((shared / source / "capture.toml").read_text()))
        for file in ("rest.ply", "clouds"):
            if not (folder / file).is_symlink():
                (folder / file).symlink_to((shared / source / file).resolve())
    return work / "captures"


def arrays_of(vtu):
    """Arrays of a VTK file (ascii or inline base64, not compressed) by name, flat."""
    root = xml.etree.ElementTree.parse(vtu).getroot()
    formats = {"Float64": "d", "Float32": "f", "Int64": "q", "Int32": "i", "UInt8": "B", "UInt64": "Q", "UInt32": "I"}
    width = 8 if root.get("header_type") == "UInt64" else 4
    found = {}
    for array in root.iter("DataArray"):
        text = (array.text or "").strip()
        if array.get("format") == "ascii":
            values = [float(word) for word in text.split()]
        else:
            data = base64.b64decode(text)[width:]
            code = formats[array.get("type")]
            values = list(struct.unpack(f"<{len(data) // struct.calcsize(code)}{code}", data))
        found[array.get("Name")] = values
    return found


def elements_of(model):
    """(height of its middle [m], volume of its part inside the object [m^3], Young's modulus [Pa]) of each cell of a model."""
    a = arrays_of(model)
    points, nodes, ends = a["points"], a["connectivity"], a["offsets"]
    elements, begin = [], 0
    for end, modulus, fill in zip(ends, a["youngs_modulus [Pa]"], a["fill"]):
        corners = [points[3 * int(n):3 * int(n) + 3] for n in nodes[begin:int(end)]]
        begin = int(end)
        volume = fill * math.prod(max(c[d] for c in corners) - min(c[d] for c in corners) for d in range(3))
        elements.append((sum(c[1] for c in corners) / len(corners), volume, modulus))
    return elements


def zones_of(model, zones):
    """Mean of Young's modulus over each zone's elements, weighted by volume, and beside it the zone's truth."""
    out = []
    elements = elements_of(model)
    for zone in zones:
        inside = [(volume, modulus) for y, volume, modulus in elements if zone["y_min"] <= y <= zone["y_max"]]
        mean = sum(v * E for v, E in inside) / sum(v for v, _ in inside)
        out.append({"from": zone["y_min"], "to": zone["y_max"], "mean": common.number(mean), "truth": zone["value"]})
    return out


def rms_by_frame_range(program, model, captures, short, whole, work):
    """Of a model fitted to the first frames: rms over those, and over those after [m]."""
    names = (short, whole)
    errors = [common.evaluate(program, model, captures / name, work / f"{model.parent.name}-on-{name}.json")["error"] for name in names]
    counts, squares = [e["points"] for e in errors], [e["points"] * e["surface_rms"] ** 2 for e in errors]
    return math.sqrt(squares[0] / counts[0]), math.sqrt((squares[1] - squares[0]) / (counts[1] - counts[0]))


def main():
    arguments = common.arguments(__doc__)
    folder = captures(arguments.work)
    truth = {name: common.read(common.shared_data() / name / "truth.json")["parameters"] for name in (EVEN, ZONES)}
    fits = {}
    for name, (capture, choices) in FITS.items():
        if not (folder / capture).exists():
            print(f"{name}: its recording is not there, left out")
            continue
        figures = common.fit(arguments.program, folder / capture, arguments.work / name, choices)
        result = figures.pop("result")
        own = truth[EVEN if capture == "even" else ZONES]
        parameters = {}
        for key, p in result["parameters"].items():
            if key in NAMES or key.startswith("youngs_modulus"):
                value = own.get(key, {}).get("value")
                parameters[key] = {"value": common.number(p["value"]), "std": common.number(p.get("std"), 2), "unit": p["unit"],
                                   "truth": value if isinstance(value, (int, float)) else None}
        model = arguments.work / name / "model.toml"
        fits[name] = {"capture": capture, "cells": choices.get("cells", 12), "control_points": choices.get("control_points", 1),
                      "poisson_is_estimated": choices.get("poisson_ratio.estimate", True), "parameters": parameters,
                      "field": [{"y": common.number(c[1], 4), "value": common.number(c[3]), "std": common.number(c[4], 2)}
                                for c in result.get("fields", {}).get("youngs_modulus", {}).get("control_points", [])],
                      "surface_rms": common.number(result["error"]["surface_rms"], 4), "points": result["error"]["points"],
                      "cost": common.number(result["cost"]["final"]), "estimated": sum(
                          (3 if isinstance(p["value"], list) else 1) for p in result["parameters"].values() if p["estimated"]),
                      "converged": figures["exit_code"] == 0, **figures}
        if capture != "even":
            fits[name]["zones"] = zones_of(model.with_suffix(".vtu"), own["youngs_modulus"]["value"]["zones"])
        if capture.startswith("short"):
            fitted, predicted = rms_by_frame_range(arguments.program, model, folder, capture, capture.replace("short-regions", "regions").replace("short", "zones"),
                                                   arguments.work)
            fits[name].update(fitted_rms=common.number(fitted, 5), predicted_rms=common.number(predicted, 5))
        zones = ", ".join(f"{z['mean'] / 1e3:.0f} ({z['truth'] / 1e3:.0f})" for z in fits[name].get("zones", []))
        print(f"{name}: E {parameters['youngs_modulus']['value']}, zones [kPa] {zones}, nu {parameters['poisson_ratio']['value']}, "
              f"cost {fits[name]['cost']}, {figures['wall_seconds']} s", flush=True)
    common.write_results(__file__, {"short": SHORT, "independent": INDEPENDENT, "fits": fits})


if __name__ == "__main__":
    main()
