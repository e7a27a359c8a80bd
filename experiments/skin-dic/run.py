#!/usr/bin/env python3
"""Healthy skin between two pads: a law from the first half of the pad's way, the second half predicted.

Recordings are read where they lie; nothing of them is kept but figures and a picture, which needs matplotlib."""
import csv
import json
import math
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
import common

THICKNESS = 1.5e-3      # assumed: only E times it shows [m]
POISSONS_RATIO = 0.45   # assumed
BETWEEN = 18            # cells from pad to pad
BEHIND, BESIDE = 10, 12  # cells that the sheet reaches beyond the pads' middles
PAD_CELLS = 2           # half a pad: about 8 mm squares, as in the recording's geometry
NOISE = 2e-4            # of a displacement: about what an even sheet misses, so that the force counts beside [m]
FORCE_NOISE = 0.02      # of the greatest force among the steps
EVERY = 10              # of the points
FRAMES = (5, 10, 15, 20, 25, 30, 35, 40, 45, 49)
SPLIT = 25              # the last frame that is fitted
FURTHER = (5.0, 6.0, 7.0, 8.0)  # pad displacements with a force alone [mm]
IMAGE = common.ROOT / "docs/images/skin-dic.png"


def rows_of(name):
    with open(common.shared_data() / f"skin-dic-healthy/{name}.csv", newline="") as file:
        return [{k: float(v) for k, v in r.items()} for r in csv.DictReader(file)]


def force_at(curve, ux):
    for (u0, f0), (u1, f1) in zip(curve, curve[1:]):
        if u0 <= ux <= u1:
            return f0 + (f1 - f0) * (ux - u0) / (u1 - u0)
    return None


def main():
    arguments = common.arguments(__doc__.splitlines()[0])
    program = arguments.program.parent.parent / "experiments/pliant_skin"
    points, pads = rows_of("dic_points_mm"), rows_of("pads_mm")
    curve = [(-r["moving_pad_ux_mm"], -r["reaction_fx_N"]) for r in rows_of("pad_force")]
    seen = points[::EVERY]
    fixed = 1e-3 * pads[0]["fixed_x"]
    steps = []
    for frame in FRAMES:
        pad = pads[frame]
        steps.append({"frame": frame, "pad": [1e-3 * pad["moving_x"], 1e-3 * pad["moving_y"]],
                      "displacements": [[1e-3 * (p[f"{c}_f{frame:03d}"] - p[f"{c}_f000"]) for c in "xy"] for p in seen], "force": -force_at(curve, -pad["moving_x"])})
    steps += [{"frame": None, "pad": [-1e-3 * ux, 0.0], "displacements": [], "force": -force_at(curve, ux)} for ux in FURTHER]
    base = {"thickness": THICKNESS, "cell": fixed / BETWEEN, "fixed_pad": fixed, "cells": [BEHIND, BESIDE], "pad_cells": PAD_CELLS, "points": [[1e-3 * p["x_f000"], 1e-3 * p["y_f000"]] for p in seen],
            "displacement_noise": NOISE, "poisson_ratio": POISSONS_RATIO, "start_modulus": 1e4}
    figures = {"thickness": THICKNESS, "poisson_ratio": POISSONS_RATIO, "points": len(seen), "noise": NOISE, "split": -steps[FRAMES.index(SPLIT)]["pad"][0],
               "steps": [{"pad": -s["pad"][0], "force": -s["force"], "moved": math.sqrt(sum(u * u + v * v for u, v in s["displacements"]) / len(s["displacements"])) if s["displacements"] else None} for s in steps], "fits": []}

    def ask(name, task, terms, is_fitted, rim_held):
        out = arguments.work / f"{name}.json"
        if not out.exists():
            greatest = max(abs(s["force"]) for s in steps if is_fitted(s))
            request = {**base, "task": task, "terms": terms, "rim_held": rim_held, "steps": [{**s, "fitted": is_fitted(s), "force_noise": FORCE_NOISE * greatest} for s in steps]}
            path = arguments.work / f"{name}-request.json"
            path.write_text(json.dumps(request))
            out.write_text(subprocess.run([program, f"request={path}"], check=True, stdout=subprocess.PIPE, text=True).stdout)
        return common.read(out)

    check = ask("check", "check", 2, lambda s: s["frame"] in FRAMES[:2], True)
    figures["derivative_errors"] = check["derivative_errors"]
    print(check, flush=True)
    first_half = lambda s: s["frame"] is not None and s["frame"] <= SPLIT
    # What the skin around is to the sheet is not known: its rim free, and held.
    for name, is_fitted, rim_held, all_terms in (("first half, rim free", first_half, False, (0, 1)), ("first half, rim held", first_half, True, (0, 1, 2)), ("all, rim held", lambda s: True, True, (1,))):
        for terms in all_terms:
            f = ask(f"{name.replace(' ', '-').replace(',', '')}-{terms}", "fit", terms, is_fitted, rim_held)
            row = {"name": name, "terms": terms, **{k: f[k] for k in ("nodes", "elements", "succeeded", "reason", "evaluations", "theta", "seconds", "forces", "rms", "failure") if k in f}}
            row["fitted"] = [is_fitted(s) for s in steps]
            figures["fits"].append(row)
            print(name, terms, [round(v, 4) for v in row.get("theta", [])], [round(-x, 4) if x is not None else None for x in row.get("forces", [])], [round(1e3 * x, 3) for x in row.get("rms", []) if x is not None], row["seconds"], row.get("failure"), flush=True)
    common.write_results(__file__, figures)
    draw(figures, curve)


def draw(figures, curve):
    plt = common.pyplot()
    if not plt:
        return
    figure, panels = plt.subplots(1, 2, figsize=(14, 5))
    pad = [1e3 * s["pad"] for s in figures["steps"]]
    panels[0].plot([c[0] for c in curve], [c[1] for c in curve], color="#999", lw=3, label="measured")
    for row in figures["fits"]:
        colour = {0: "#b5401f", 1: "#1f5fa8", 2: "#3a8a3a"}[row["terms"]]
        style = {"first half, rim free": ":", "first half, rim held": "--"}.get(row["name"], "-")
        label = ("linear" if row["terms"] == 0 else f"{row['terms']} term{'s' * (row['terms'] > 1)}") + f", {row['name']}"
        panels[0].plot(pad, [-f if f is not None else float("nan") for f in row["forces"]], style, color=colour, marker=".", label=label)
        panels[1].plot(pad, [1e3 * r if r is not None else float("nan") for r in row["rms"]], style, color=colour, marker=".", label=label)
    panels[1].plot(pad, [1e3 * s["moved"] if s["moved"] else float("nan") for s in figures["steps"]], color="#999", lw=3, label="what points move (rms)")
    for panel, label in zip(panels, ("force [N]", "displacement [mm]")):
        panel.axvline(1e3 * figures["split"], color="#ccc", ls=":")
        panel.set_xlabel("pad's displacement [mm]")
        panel.set_ylabel(label)
        panel.legend(fontsize=8)
    panels[0].set_ylim(0, 0.35)
    panels[1].set_xlim(0, 4.2)
    figure.tight_layout()
    figure.savefig(IMAGE, dpi=80)


if __name__ == "__main__":
    main()
