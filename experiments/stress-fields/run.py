#!/usr/bin/env python3
"""Stress in a bar of two stiffnesses that is held at one end under its weight, by the true moduli, by the least and the greatest of them
everywhere, and by those of a fit to a synthetic recording (Wang 2015, figure 8). About two minutes on two shared cores."""
import base64
import math
import pathlib
import re
import shutil
import struct
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

TRUE_RATIO = 0.3
FIELDS = {"von_mises [Pa]": "stress", "greatest_strain [1]": "strain"}


def with_moduli(found, folder, moduli, ratio):
    """A copy of a model with another modulus in each element and another Poisson's ratio [-]; None keeps its own. It has no frames: it
    is simulated in equilibrium."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in ("model.toml", "model.vtu", "surface.ply"):
        shutil.copy(found / name, folder / name)
    text = re.sub(r"\[timing\]\n(.+\n)*", "", (folder / "model.toml").read_text())
    if moduli:
        text = re.sub(r"(?m)^poissons_ratio\s*=.*$", f"poissons_ratio = {ratio!r}", text)
        raw = struct.pack(f"<{len(moduli)}d", *moduli)
        encoded = base64.b64encode(struct.pack("<Q", len(raw)) + raw).decode()
        volume = (folder / "model.vtu").read_text()
        pattern = r'(<DataArray [^>]*Name="youngs_modulus \[Pa\]"[^>]*>)[^<]*'
        assert re.search(pattern, volume)
        (folder / "model.vtu").write_text(re.sub(pattern, lambda m: m.group(1) + encoded, volume))
    (folder / "model.toml").write_text(text)


def state(program, folder):
    """The model's equilibrium: arrays of its cells and points."""
    common.run(program, "simulate", folder / "model.toml", "--out", folder / "simulated")
    return common.read_vtu(folder / "simulated/frames/000000.vtu")


def off(values, truth, volumes):
    """Root mean square difference, by volume, over the greatest true value."""
    mean = sum(v * (a - b)**2 for v, a, b in zip(volumes, values, truth)) / sum(volumes)
    return common.number(math.sqrt(mean) / max(truth), 4)


def outlines(found, at):
    """Corners [m] of the cells of the layer that is seen from the side, in a state, and the numbers of these cells."""
    cells = [at["connectivity"][i:i + 8] for i in range(0, len(at["connectivity"]), 8)]
    rest = [found["points"][3 * n + 2] for n in range(len(found["points"]) // 3)]
    front = max(sum(rest[n] for n in cell) for cell in cells)
    layer = [e for e, cell in enumerate(cells) if sum(rest[n] for n in cell) > front - 1e-6]
    side = [[n for n in cells[e] if rest[n] > sum(rest[m] for m in cells[e]) / 8] for e in layer]
    return layer, [[common.rounded(at["points"][3 * n:3 * n + 2], 4) for n in corners] for corners in side]


def main():
    arguments = common.arguments(__doc__)
    work, program = arguments.work, arguments.program
    capture, out = work / "capture", work / "fit"
    if not (out / "figures.json").exists():
        common.run(program, "synth", HERE / "scene.toml", "--out", capture)
    fit = common.fit(program, capture, out, {"cells": 15})
    truth = {name: p["value"] for name, p in common.read(capture / "truth.json")["parameters"].items()}
    estimates = {p: fit["result"]["parameters"][p] for p in ("youngs_modulus", "youngs_modulus@free half", "poissons_ratio")}
    found = common.read_vtu(out / "model.vtu")
    held, free = (estimates[p]["value"] for p in ("youngs_modulus", "youngs_modulus@free half"))
    moduli = [truth["youngs_modulus"], truth["youngs_modulus@free half"]]
    shares = [math.log(E / held) / math.log(free / held) for E in found["youngs_modulus [Pa]"]]  # of the free half's material
    of_element = {"truth": [moduli[0]**(1 - s) * moduli[1]**s for s in shares], "soft": [min(moduli)] * len(shares),
                  "hard": [max(moduli)] * len(shares), "found": None}
    states = {}
    for name, values in of_element.items():
        with_moduli(out, work / name, values, TRUE_RATIO)
        states[name] = state(program, work / name)
    volumes = next(values for key, values in found.items() if key.startswith("fill"))
    lowest = lambda s: min(s["points"][1::3])
    sag = lambda s: lowest(found) - lowest(s)
    rows = {name: {**{key: off(s[array], states["truth"][array], volumes) for array, key in FIELDS.items()},
                   "greatest_stress": common.number(max(s["von_mises [Pa]"])), "sag": common.number(sag(s), 4)} for name, s in states.items()}
    layer, _ = outlines(found, states["truth"])
    common.write_results(__file__, {
        "truth": truth, "elements": len(shares), "estimates": {name: {key: common.number(p.get(key)) for key in ("value", "std")} for name, p in estimates.items()},
        "wall_seconds": fit["wall_seconds"], "materials": rows,
        "pictures": {name: {"outlines": outlines(found, s)[1], "stress": [common.number(s["von_mises [Pa]"][e], 4) for e in layer]} for name, s in states.items()}})


if __name__ == "__main__":
    main()
