#!/usr/bin/env python3
"""Writes docs/experiments.md, docs/weiss.md, their plots and the README's table of accuracy from the results.json of each experiment. Standard
library only.

Usage: experiments/make_docs.py [--check]
  --check  write nothing; return 1 and name the files that do not match the results"""
import math
import sys

import plots
from bar_page import bar, dinosaur
from battery_page import battery, coverage, error_budget
from calibrated_sensors_page import calibrated_sensors
from load_free_page import reference_shapes, rough_scan, sagging_leaf, two_mountings, two_zones
from material_curves_page import material_curves
from oracle_tracking_page import clouds
from page import IMAGES, ROOT, judged, machine, percent, results, table, with_truth
from pressed_bodies_page import pressed_bodies
from presses_page import presses
from real_tracks_page import real_tracks
from silicone_beam_page import silicone_beam, silicone_strips
from stress_fields_page import stress_fields
from touched_page import organ_probing, skin, slab_pokes
from tracking_page import swinging
from photo_chain_page import photo_chain
from exports_page import exports
from plant_page import plant
from twins_page import plans, twins
import weiss_page

PAGE, WEISS, README, PLOT = ROOT / "docs/experiments.md", ROOT / "docs/weiss.md", ROOT / "README.md", IMAGES / "torus-sweep.svg"
ACCURACY = ("<!-- accuracy: made by experiments/make_docs.py -->\n", "<!-- end of accuracy -->\n")


def oracle():
    figures = results("oracle-bounce")
    if not figures:
        return "Not run yet.\n"
    rows = []
    for name, r in figures["recordings"].items():
        p = r["parameters"]
        E = p["youngs_modulus"]
        rows.append([name, with_truth(E), percent(E["value"] / E["truth"] - 1), with_truth(p["poisson_ratio"]),
                     with_truth(p["mass_damping"]), with_truth(p["stiffness_damping"], 1e3),
                     f"{1e3 * r['surface_rms']:.2f} / {1e3 * r['sensor_noise']:.2f}", f"{r['wall_seconds']:.0f}",
                     "yes" if r["converged"] else "no"])
    text = table(["recording", "E [Pa] (truth)", "error", "nu (truth)", "mass damping [1/s] (truth)", "stiffness damping [ms] (truth)",
                  "surface rms / sensor noise [mm]", "time [s]", "converged"], rows)
    text += "\nA model predicts the other bounce:\n\n"
    text += table(["model of", "recording", "surface rms [mm]", "fitted there [mm]"],
                  [[p["model"], p["recording"], f"{1e3 * p['surface_rms']:.2f}",
                    f"{1e3 * figures['recordings'][p['recording']]['surface_rms']:.2f}"] for p in figures["predictions"]])
    stated = [(name, key, p) for name, r in figures["recordings"].items() for key, p in r["parameters"].items()
              if p.get("interval_90") and p.get("truth") is not None]
    outside = [f"{name}, {key.replace('_', ' ')}" for name, key, p in stated if not p["interval_90"][0] <= p["truth"] <= p["interval_90"][1]]
    text += f"\n{len(stated) - len(outside)} of {len(stated)} stated 90 % intervals hold the truth" + \
        (f"; not those of {'; '.join(outside)}" if outside else "") + ".\n"
    return text + f"\nMeasured on {machine(figures)}.\n"


def loaded():
    figures = results("oracle-load")
    if not figures:
        return "Not run yet.\n"
    p, clouds, nodes = figures["parameters"], figures["clouds"], figures["nodes"]
    text = table(["program", "E [kPa] (truth)", "nu (truth)", "mass damping [1/s] (truth)", "stiffness damping [ms] (truth)", "surface rms [mm]", "time / of processor [s]"],
                 [[figures["commit"][:7], with_truth(p["youngs_modulus"], 1e-3), with_truth(p["poisson_ratio"]), with_truth(p["mass_damping"]),
                   with_truth(p["stiffness_damping"], 1e3), f"{1e3 * figures['surface_rms']:.2f}", f"{figures['wall_seconds']:.0f} / {figures['processor_seconds']:.0f}"]])
    text += ("\nDistances under each weight, mean (greatest), of the sheet's length. The weight moves the sheet by what stands beside it, at most. Clouds: of seen points to the "
             "simulated surface, noise included; nodes: of the true surface's vertices, against the model, and against models of the true material on the same grid and on finer ones, "
             "which shows what grid and material law leave.\n\n")
    share = lambda l: f"{100 * l['relative_mean']:.2f} % ({100 * l['relative_max']:.2f} %)"
    text += table(["weight [g]", "moves it [mm]", "clouds", "points left out", *(f"nodes, {name}" for name in nodes)],
                  [[f"{1e3 * load['mass']:.0f}", f"{1e3 * load['moved']:.0f}", share(seen), f"{seen['outliers']} of {seen['outliers'] + seen['points']}", *(share(n[i]) for n in nodes.values())]
                   for i, (load, seen) in enumerate(zip(figures["loads"], clouds))])
    worst = max(l["relative_mean"] for l in nodes["fitted"])
    text += (f"\nThe greatest mean node distance is {100 * worst:.2f} % of the sheet's length (target 2 %, {judged(worst < 0.02)}; the paper has up to 5.6 % of its normalised pot holder). "
             "Points of a cloud are compared with the nearest place of the surface: sliding along it shows in the nodes alone. Their greatest distances are mostly readings in the air close to the sheet, "
             f"which do not stand alone.\n\nYoung's modulus is {percent(p['youngs_modulus']['value'] / p['youngs_modulus']['truth'] - 1)} off. Of the true material, the fit's own mesh comes as near "
             "to the true shapes as finer ones do: what is left is the law's, not the mesh's.\n")
    return text + f"\nMeasured on {machine(figures)}.\n"


def release_name(name, fit):
    if name == "even":
        return "even bar, no choices"
    if fit["capture"] == "regions":
        text = "two regions" + (", Poisson's ratio given" if fit["choices"].get("poissons_ratio.estimate") is False else "")
    else:
        text = "no choices: " if not fit["choices"] else ""
        text += f"{fit['control_points']} control point{'s' if fit['control_points'] > 1 else ''}"
    return text + (f", {fit['choices']['cells']} cells" if "cells" in fit["choices"] else "")


def control_values(fit):
    """From the free end to the held one, in kPa, with their deviations."""
    found = fit["field"] or [q for key, q in reversed(fit["parameters"].items()) if key.startswith("youngs_modulus")]
    return ", ".join(f"{1e-3 * c['value']:.4g} ± {1e-3 * c['std']:.2g}" for c in found)


def release():
    figures = results("oracle-release")
    if not figures:
        return "Not run yet.\n"
    fits = figures["fits"]

    def stated(p, scale=1.0):
        if not p.get("interval_90"):
            return f"{scale * p['value']:.3g} (given)"
        low, high = (scale * end for end in p["interval_90"])
        return f"{scale * p['value']:.3g} [{low:.3g}, {high:.3g}]" + (f" ({scale * p['truth']:.3g})" if p["truth"] is not None else "")

    rows, zones = [], []
    for name, f in fits.items():
        p = f["parameters"]
        own = [p["poisson_ratio"], p["mass_damping"], p["stiffness_damping"]]
        rows.append([release_name(name, f), str(f["elements"]), f["verdict"], stated(p["youngs_modulus"], 1e-3) if f["control_points"] == 1 and f["capture"] != "regions" else "see below",
                     stated(own[0]), stated(own[1]), stated(own[2], 1e3), f"{1e3 * f['surface_rms']:.2f}", f"{f['wall_seconds']:.0f} / {f['processor_seconds']:.0f}", f["commit"][:7]])
        if "zones" not in f:
            continue
        off = [percent(z["mean"] / z["truth"] - 1) for z in f["zones"]]
        zones.append([release_name(name, f), control_values(f), *(f"{1e-3 * z['mean']:.0f} ({o})" for z, o in zip(reversed(f["zones"]), reversed(off))),
                      *(f"{1e3 * e:.1f}" for e in (f["swing_errors"][0], f["swing_errors"][2])), f"{f['cost']:.0f}"])
    text = "Values with their 90 % intervals, and the truth:\n\n"
    text += table(["fit", "elements", "verdict", "E [kPa]", "nu", "mass damping [1/s]", "stiffness damping [ms]", "surface rms [mm]", "time / of processor [s]", "program"], rows)
    if zones:
        upper, lower = fits["zones"]["zones"] if "zones" in fits else next(f["zones"] for f in fits.values() if "zones" in f)
        text += (f"\nThe bar of two stiffnesses: {1e-3 * lower['truth']:.0f} kPa below y = {lower['to']:g} m, {1e-3 * upper['truth']:.0f} kPa above. Zones are judged by the mean over their elements, weighted by volume. "
                 "Control values are told from the free end to the held one. Beside them, how far the free end's motion is off the true one, root mean square along the bar's narrow and wide side.\n\n")
        text += table(["Young's modulus is", "control values [kPa]", "lower zone [kPa]", "upper zone [kPa]", "x off [mm]", "z off [mm]", "cost"], zones)
    if "zones" in fits:
        worst = max(abs(z["mean"] / z["truth"] - 1) for z in fits["zones"]["zones"])
        text += f"\nZones within 15 % with no choices: {judged(worst < 0.15)} ({percent(worst, sign=False)} at most). The rule for how many control points a fit takes was set while looking at this recording.\n"
    text += ("\n**Poisson's ratio.** It comes out too high for the bar of two stiffnesses. More cells bring it down by a little and leave an interval that misses the truth: the mesh is a part of the cause, and the rest is not known.\n")
    return text + f"\nMeasured on {machine(figures)}.\n"


def torus():
    figures = results("torus")
    if not figures:
        return "Not run yet.\n"
    text = table(["", "Weiss 2020", "here"], [
        ["elements / nodes", "690 / 1138", f"{figures['elements']} / {figures['nodes']}"],
        ["starts within 5 % of the truth", "", f"{figures['within_5_percent']} of {figures['starts']}"],
        ["mean error of Young's modulus", "", percent(figures["mean_error"], False)],
        ["worst error", "", percent(figures["worst_error"], False)],
        ["optimiser", "Rprop", "Levenberg-Marquardt"],
        ["forward step", "95 ms", f"{figures['ms_per_forward_step']:.1f} ms"],
        ["adjoint step", "225 ms", f"{figures['ms_per_adjoint_step']:.1f} ms"],
        ["whole fit, one thread (median)", "", f"{figures['median_wall_seconds']:.0f} s"]])
    text += ("\nThe recording was simulated on a finer grid with shorter steps than it is fitted with; the paper's starts and noise are its "
             "own. All starts that converge agree: what is left of the error is the noise (a deviation of about 1.2 %), the grid and the step. The steps here are shorter "
             "than the paper's: several to a frame, where it took one. Its errors are means over those runs alone that it counts as converged, for several cameras, "
             "resolutions and noises; here every start counts, in one set-up. So they do not stand side by side.\n\n")
    text += "Each start, and the first ones again with Rprop:\n\n"
    rows = [["Levenberg-Marquardt", f"{r['start']:.4g}", f"{r['youngs_modulus']:.5g}", percent(r["relative_error"]), r["evaluations"],
             r["forward_steps"], f"{r['wall_seconds']:.0f}", "yes" if r["converged"] else "no"] for r in figures["levenberg_marquardt"]]
    rows += [["Rprop", f"{r['start']:.4g}", f"{r['youngs_modulus']:.5g}", percent(r["relative_error"]), r["evaluations"],
              r["forward_steps"], f"{r['wall_seconds']:.0f}", "yes" if r["converged"] else "no"] for r in figures["rprop"]]
    text += table(["optimiser", "start [Pa]", "found [Pa]", "error", "iterations, all stages", "forward steps", "time [s]", "converged"], rows)
    return text + f"\nMeasured on {machine(figures)}.\n"


def sweep():
    figures = results("torus-sweep")
    if not figures:
        return "Not run yet.\n"
    write_plot(figures)
    wrong = figures["wrong_signs"]
    text = "![Cost and its derivative over Young's modulus](images/torus-sweep.svg)\n\n"
    text += f"The cost has its lowest value of the sweep at {figures['lowest_at']:.4g} Pa (truth {figures['truth']:g}). "
    text += f"{figures['evaluated']} of {figures['asked']} values could be simulated. "
    text += ("The derivative points towards the minimum everywhere.\n" if not wrong else
             "The derivative points away from the minimum at " + ", ".join(f"{w:.4g}" for w in wrong) + " Pa.\n")
    text += ("\nAdjoint and tangents are two programs for the same derivative; they differ by at most "
             f"{figures['adjoint_against_tangent']:.1e} of its largest value.\n")
    return text


def write_plot(figures):
    """Two panels, cost above and E dcost/dE below, over the logarithm of E."""
    rows = figures["rows"]
    width, height, left, top, gap = 640, 190, 70, 20, 40
    x_of = [math.log10(r["youngs_modulus"]) for r in rows]
    low, high = min(x_of), max(x_of)
    sx = lambda x: left + (width - left - 20) * (x - low) / (high - low)
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {2 * height + gap + 60}" font-family="sans-serif" font-size="12">',
             '<rect width="100%" height="100%" fill="#fff"/>']

    def panel(offset, values, label, colour):
        least, most = min(values + [0.0]), max(values)
        sy = lambda y: offset + height * (most - y) / (most - least)
        parts.append(f'<rect x="{left}" y="{offset}" width="{width - left - 20}" height="{height}" fill="none" stroke="#ccc"/>')
        parts.append(f'<line x1="{left}" x2="{width - 20}" y1="{sy(0):.1f}" y2="{sy(0):.1f}" stroke="#999"/>')
        points = " ".join(f"{sx(x):.1f},{sy(y):.1f}" for x, y in zip(x_of, values))
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>')
        for x, y in zip(x_of, values):
            parts.append(f'<circle cx="{sx(x):.1f}" cy="{sy(y):.1f}" r="3" fill="{colour}"/>')
        for y in (least, most):
            parts.append(f'<text x="{left - 6}" y="{sy(y) + 4:.1f}" text-anchor="end">{y:.3g}</text>')
        parts.append(f'<text x="{left + 8}" y="{offset + 16}">{label}</text>')
        x = sx(math.log10(figures["truth"]))
        parts.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{offset}" y2="{offset + height}" stroke="#999" stroke-dasharray="4 4"/>')

    panel(top, [r["cost"] for r in rows], "cost", "#1f5fa8")
    panel(top + height + gap, [r["youngs_modulus"] * r["gradient_adjoint"] for r in rows], "E dcost/dE by the adjoint", "#b5401f")
    bottom = top + 2 * height + gap
    for modulus in (1000, 2000, 5000, 10000, 20000):
        x = math.log10(modulus)
        if low - 1e-9 <= x <= high + 1e-9:
            parts.append(f'<text x="{sx(x):.1f}" y="{bottom + 16}" text-anchor="middle">{modulus}</text>')
    parts.append(f'<text x="{(left + width - 20) / 2:.0f}" y="{bottom + 34}" text-anchor="middle">Young\'s modulus [Pa]; dashed: truth</text></svg>')
    plots.made[PLOT] = "\n".join(parts) + "\n"


def memory():
    figures = results("memory")
    if not figures:
        return "Not run yet.\n"
    most = max(r["peak_memory_mib"] for r in figures["fits"])
    text = table(["frames", "nodes", "optimiser", "peak memory [MiB]", "time [s]"],
                 [[r["frames"], r["nodes"], r["optimiser"].replace("_", "-"), f"{r['peak_memory_mib']:.0f}", f"{r['wall_seconds']:.0f}"]
                  for r in figures["fits"]])
    text += f"\nThe target is 1 GiB for 600 frames: {'met' if most < 1024 else 'missed'}, with {most:.0f} MiB at the most.\n\n"
    text += ("States that the reverse sweep of one small body holds, at a budget of 1 MiB: all of them while they fit, beyond it about as "
             "the square root of the frames.\n\n")
    return text + table(["frames", "all states [KiB]", "held at the most [KiB]"],
                        [[r["frames"], f"{r['all_states_bytes'] / 1024:.0f}", f"{r['peak_state_bytes'] / 1024:.0f}"] for r in figures["adjoint"]])


SILICONE_NAMES = {"silicone-h_e_c": "bar, Ecoflex 00-50", "silicone-h_e_s": "spine, Ecoflex 00-50", "silicone-t_em_c": "twisted bar, Ecoflex 00-50 and Mold Star 15",
                  "silicone-h_e_c-raw": "bar, range as recorded"}


def silicone_ratio(fit):
    """Of the two moduli of the twisted bar, and its relative deviation."""
    soft, hard = (fit["parameters"][key] for key in ("youngs_modulus", "youngs_modulus@mold star 15"))
    deviations = [p["std"] / p["value"] for p in (soft, hard)]
    known = [c["correlation"] for c in fit["correlations"] if set(c["parameters"]) == {"youngs_modulus", "youngs_modulus@mold star 15"}]
    variance = sum(d * d for d in deviations) - 2.0 * (known[0] if known else 0.0) * deviations[0] * deviations[1]
    return hard["value"] / soft["value"], math.sqrt(variance)


def twisted_text(fits):
    ratio = {name: silicone_ratio(fits[name]) for name in ("twisted", "twisted-finer", "twisted-pose")}
    given = [ratio[name][0] for name in ("twisted", "twisted-finer")]
    low, high = 2.4, 2.8
    farthest = max(fits[name]["median_distance"] for name in ("twisted", "twisted-finer"))
    return ("**The twisted bar** shows the ratio of the two moduli alone; the softer one is held at 155 kPa ± 10 %. Its meshes agree within "
            f"{100 * (max(given) / min(given) - 1):.1f} %, at {min(given):.2f} to {max(given):.2f}, and the points lie within a median of {1e3 * farthest:.2f} mm of the fitted surface (pixels taken evenly, distance to the nearest place of it). "
            f"The notes of the recording have a ratio of {low} to {high}, from another model with another law: "
            + ("met. " if low <= min(given) and max(given) <= high else f"missed by {percent(max(given) / high - 1)} at the most. ")
            + f"With the camera's pose estimated it is {ratio['twisted-pose'][0]:.2f}. The far clamp's place is uncertain by 3 mm and 3 degrees and is taken as given.\n")


def silicone():
    figures = results("silicone")
    if not figures:
        return "Not run yet.\n"
    fits = figures["fits"]
    rows = []
    for name, f in fits.items():
        E, error = f["parameters"]["youngs_modulus"], f["parameters"].get("range_error@lidar")
        ratio = ""
        if f["recording"] == "silicone-t_em_c":
            value, deviation = silicone_ratio(f)
            ratio = f"{value:.2f} ± {value * deviation:.2f}"
        rows.append([SILICONE_NAMES[f["recording"]], f"{f['cells']} hexahedra" if f["cells"] else "no choice",
                     "estimated" if f["pose_is_estimated"] else "as given", f"{E['value'] / 1e3:.0f} ± {E['std'] / 1e3:.0f}", ratio,
                     f"{1e3 * error['value']:.0f} ± {1e3 * error['std']:.0f}" if error else "", f"{1e3 * f['surface_rms']:.1f}",
                     f"{1e3 * f['median_distance']:.1f}" if f.get("median_distance") else "", f"{f['wall_seconds']:.0f}"])
    E = lambda name: fits[name]["parameters"]["youngs_modulus"]["value"]
    interval = lambda name: " to ".join(f"{x / 1e3:.0f}" for x in fits[name]["parameters"]["youngs_modulus"]["interval_90"])
    pose = lambda name: sum(fits[name]["uncertainty"].get(cause, 0.0) ** 2 for cause in ("pose of lidar", "direction of gravity")) ** 0.5 / E(name)
    overlap = fits["bar-no-choice"]["parameters"]["youngs_modulus"]["interval_90"][1] >= fits["spine-no-choice"]["parameters"]["youngs_modulus"]["interval_90"][0]
    text = table(["recording", "along its length", "camera's pose", "E [kPa]", "ratio of moduli", "range error [mm]", "points' rms [mm]", "median distance [mm]", "time [s]"], rows)
    return text + (
        f"\nA point's distance counts as at most 5 % of the object's length in its rms. Where there are choices, Poisson's ratio is taken as {figures['poisson_ratio']:g}; the density is as in the recordings.\n\n"
        f"**One silicone in two shapes, no choices**: {E('bar-no-choice') / 1e3:.0f} and {E('spine-no-choice') / 1e3:.0f} kPa, {percent(E('spine-no-choice') / E('bar-no-choice') - 1)} apart where at most 10 % was asked for: missed. "
        f"The 90 % intervals, {interval('bar-no-choice')} and {interval('spine-no-choice')} kPa, {'overlap' if overlap else 'do not overlap'}. Neighbouring pixels of this camera scatter by 0.1 mm, a thirtieth of its noise, so its errors are smooth, and the pose and "
        f"gravity, which were found through it, are taken to be known no better than it reads: {100 * pose('bar-no-choice'):.0f} % and {100 * pose('spine-no-choice'):.0f} % of the moduli. "
        f"The mesh is no reason any more (the spine's necks are 7 mm long and 7 mm wide; earlier figures of 143 to 163 kPa on ever finer hexahedra were on the way to this one), nor is Poisson's ratio, which changes the spine by {percent(E('spine-given-pose') / E('spine-no-choice') - 1)} "
        "from what is assumed, 0.35, to 0.49, with hexahedra in the place of quadratic tetrahedra. What is left is how the objects stand in their clamps: the recordings' notes give 150 and 170 kPa for stiffness, pose and range fitted together, and for the bar 123 kPa "
        "where the tilt of its root is that of the clamp. The published fits of these images have 65 and 162 kPa; compression tests of the silicone 153 ± 5 kPa.\n\n"
        f"**Range**: as recorded, the sensor sees 42 mm into the bar. Begun at 30 mm, the fit finds {1e3 * fits['bar-raw']['parameters']['range_error@lidar']['value']:.0f} mm and {E('bar-raw') / 1e3:.0f} kPa; begun at zero it takes the points for the bar's "
        "far side and stays in a wrong valley, which its residuals show.\n\n"
        + twisted_text(fits) +
        f"\nMeasured on {machine(figures)}.\n")


def rest_meshes():
    figures = results("rest-meshes")
    if not figures:
        return "Not run yet.\n"
    rows, refused = [], []
    for name, m in figures["meshes"].items():
        if "failure" in m:
            refused.append(f"{name}: {m['failure']}")
            continue
        sag = lambda r: percent(r["sag"], sign=False) if "sag" in r else r["failure"]
        rows.append([name, f"{1e3 * m['unit']:g}" + (" (assumed)" if m["unit_is_assumed"] else ""), m["nodes"], m["elements"],
                     " x ".join(f"{1e3 * v:.0f}" for v in m["extent"]), f"{m['dihedral_deg'][0]:.1f} to {m['dihedral_deg'][1]:.1f}",
                     f"{m['below_5_deg']} / {m['below_10_deg']}", f"{m['least_radius_ratio']:.3f}", m["passed_over"],
                     "yes" if m["boundary_is_closed"] and m["pieces"] == 1 else f"no ({m['pieces']} pieces)", sag(m["linear"]), sag(m["quadratic"])])
    text = table(["file", "unit [mm]", "nodes", "tetrahedra", "size [mm]", "dihedral angles [deg]", "below 5 / 10 deg", "least radius ratio",
                  "other cells passed over", "one closed body", "sag, as it is", "sag, with mid nodes"], rows)
    text += "".join(f"\nRefused: {line}\n" for line in refused)
    return text + (
        f"\nThe sag is the greatest displacement over the length of the longest axis, whose low tenth is held while gravity acts across it: "
        f"Young's modulus is {figures['stiffness']:g} times the weight of a column of that length, Poisson's ratio {figures['poisson_ratio']:g}. "
        "For the cylinder beam theory with shear gives 3.4 %: its elements with mid nodes are right, as they are they lock. So do all the "
        "others, by 14 to 51 %: a fit on the linear elements would find moduli too low by that. None had elements inside out, unused nodes or "
        "nodes at one place.\n\nWhat they cannot give: they are shapes without motion, force or material, so nothing can be fitted. The Armadillo has "
        "no unit. The squirrel has a nearly flat element (a radius ratio of 0) and still bends; the trunk and the Armadillo have slivers. "
        f"The other files of that folder are surfaces ({', '.join(figures['surfaces'])}), not volumes: they are for `surface`, where they are "
        "closed.\n")


def rubber():
    figures = results("rubber-dic")
    if not figures:
        return "Not run yet.\n"
    shown = [s for s in figures["strains"] if s["frame"] in (1, 3, 6, 10, 15, 19)]
    text = table(["frame", "stretch along", "stretch across", "points", "rms about an even stretch [mm]", "-ln(across) / ln(along)"],
                 [[s["frame"], s["along"], s["across"], s["points"], s["rms_mm"], f"{s['ratio_of_logarithms']:.3f}"] for s in shown])
    ratios = [s["ratio_of_logarithms"] for s in figures["strains"]]
    text += (f"\nPoisson's ratio is {min(ratios):.3f} to {max(ratios):.3f} in every frame up to 27 %: a steady material constant, somewhat below "
             f"what near incompressibility would give. {figures['missing']} of {figures['points'] * figures['frames']} points are missing.\n\n")
    fits, variants = ([f for f in figures["fits"] if bool(f["variant"]) == varied] for varied in (False, True))
    strain = lambda f: next((1 - s["across"]) / (s["along"] - 1) for s in figures["strains"] if s["frame"] == f["frame"])
    text += (f"Fitted as a body that is held at its ends, {1e3 * figures['thickness']:g} mm thick (the thickness was not recorded). The law of the fit is linear in the stretch, so "
             "beside its Poisson's ratio stands (1 - across) / (along - 1):\n\n")
    text += table(["frame", "cells along the strip", "Poisson's ratio", "from the strains", "markers rms [mm]", "points"],
                  [[f["frame"], f["cells"], f"{f['poisson_ratio']:.3f} ± {f['std']:.2g}", f"{strain(f):.3f}", f["marker_rms_mm"], f["points"]] for f in fits])
    finest = {f["frame"]: f for f in fits}
    worst = max(abs(f["poisson_ratio"] - strain(f)) for f in finest.values())
    text += (f"\nOn the finest mesh of each frame the two differ by at most {worst:.3f}. How the ends are held matters more than the noise; frame 3 with one thing changed "
             f"at a time ({fits[0]['poisson_ratio']:.3f} with none):\n\n")
    text += table(["changed", "cells", "Poisson's ratio", "markers rms [mm]"],
                  [[f["variant"], f["cells"], f"{f['poisson_ratio']:.3f} ± {f['std']:.2g}", f["marker_rms_mm"]] for f in variants])
    pieces = figures["pieces"]
    spread = lambda key: (min(p[key] for p in pieces), max(p[key] for p in pieces))
    return text + ("\nThe seen points are the strip's outer side, which sinks by half of what the strip thins; between ends that are held, and so do not thin, it would sink as it did not: so the points "
                   "are taken for the body's middle. Quadratic tetrahedra are held by those of their nodes that lie inside the ends, up to an element short of where the ends begin, and the "
                   "strip is then stretched over too long a piece; hexahedra are held where the ends are. Ends are turned as the strip was seen where they begin, for it bends within them.\n\n"
                   "The residuals stay above the noise because the strip is not as even as the body cut from its rest shape: from piece to piece of 4 mm, frame 3 is stretched by "
                   "{:.3f} to {:.3f}, twisted by {:.3f} to {:.3f}, and its axis leans sideways by {:.3f} to {:.3f}. ".format(*spread("along"), *spread("twist"), *spread("slope_sideways")) +
                   "The grips were outside the view. No force was recorded, so Young's modulus cannot be found at all; and no time, so neither can damping.\n")


def arm():
    figures = results("soft-arm")
    if not figures:
        return "Not run yet.\n"
    rows = [[r["pressure_mbar"], r["swing_mm"], f"{r['frequency_hz']:.2f}", f"{r['damping_ratio']:.3f}", f"{1e-3 * r['youngs_modulus']:.0f}",
             percent(r["youngs_modulus"] / figures["authors"] - 1)] for r in figures["recordings"]]
    text = table(["vented from [mbar]", "first swing [mm]", "frequency [Hz]", "damping ratio", "E of a solid arm [kPa]",
                  f"against the authors' {1e-3 * figures['authors']:.0f} kPa"], rows)
    for f in figures.get("fits", []):
        text += (f"\n`pliant fit` of the release after {f['pressure_mbar']} mbar, from the first turning point on: E = {1e-3 * f['youngs_modulus']:.0f} kPa, "
                 f"the tip followed to {f['marker_rms_mm']} mm rms in {f['wall_seconds']:.0f} s"
                 + ("" if f["converged"] else f"; stopped at its limit of {f['limit']:.0f} s, before it had converged" if f.get("limit") else "; not converged") +
                 f". Its dampings, {f['mass_damping']:g} 1/s and {1e3 * f['stiffness_damping']:g} ms, are not told apart by one frequency. A single point, the middle of the tip's markers, is followed, and the pose at the "
                 "first turning point is estimated along with the rest.\n")
    return text + ("\nE is that of a clamped solid cylinder by beam theory with shear and rotary inertia. The true arm has chambers, whose shape "
                   "was not recorded: they take away stiffness and mass. The frequency is known to 2 %, for turning "
                   "points fall on frames 10 ms apart; weight, which stretches the arm if it hangs, is left out and changes E by some per cent. Steps of 400 mbar and more are left out: "
                   "after them the arm creeps as far as it swings.\n\nWhat cannot be had: the pressure's load (no chambers), its course over time (only the "
                   "set point), and where the markers sit on the arm (they stand off the tip; their mean is taken for its middle).\n")


SECTIONS = [
    ("A battery of random recordings", "battery",
     "Twenty recordings by another simulator, drawn at random: shape, size, stiffness, density, dampings, camera, and how the object is dropped, thrown on a tilted board, pulled and let go, or hung. "
     "Fitted with no choice of ours; the truth is read for judging only.", battery),
    ("How often intervals hold the truth", "coverage",
     "Recordings by `pliant synth` on smaller elements and steps than a fit's. Each differs in one more way from what a fit assumes: `law`, linear elasticity in turning frames and Rayleigh's damping; "
     "`damping`, Rayleigh's alone; `contact`, a floor up to ten times softer and five times smoother; `friction`, a coefficient that the capture has wrong by 0.05; `varying`, one half a tenth stiffer, the other as much softer; `mesh`, nothing more. "
     "`held back` is every other round of the families.", coverage),
    ("What one error of a recording costs", "error-budget",
     "A drop, a throw on a tilted board, a hanging and a released object of the battery, and each again with one thing in its capture wrong that nobody told, of a size "
     "that good equipment and care leave: the scan, the mass, the camera's pose and lens, its range, gravity's direction, the frame rate. Fitted with no choice of ours; the truth is read for judging only.",
     error_budget),
    ("Another simulator's recordings", "oracle-bounce",
     "A ring dropped on the floor (twice), and a pebble dropped on a tilted board whose place is to be found too, recorded by another simulator with another material law, other elements "
     "and a model of a depth sensor's faults. Fitted with no choice of ours; the truth is read for judging only.", oracle),
    ("Twins of a thrown toy and a thrown pillow", "twins",
     "Weiss et al. 2020, section 7.4 and tables 1 to 5: a soft toy that is let go with a spin above a floor, and a pillow that is thrown on a ramp that no camera sees, made by the independent simulator, with friction and stuffing that varies. "
     "Given: mass, scan, which way is up, the floor; of the ramp a guess 9 degrees and 30 mm off. Neither gravity's strength nor friction, dampings or velocities are known. Fitted with no choice of ours; the truth is read for judging only.", twins),
    ("What a recording would tell", "recording-plans",
     "`pliant check --plan` of the ring of `examples/synthetic-ring` and of changes to it, one at a time: half the width of the 90 % interval that a fit of such a recording states, over the value, and in brackets what contributes most.", plans),
    ("From photographs to a prediction", "photo-chain",
     "A stiffening ball (Ogden's law), pressed in a simulation; its dots are painted and photographed, measured by `pliant markers`, fitted, and a wider disc is pressed elsewhere by `pliant press`, against the simulation's own surface. "
     "Beside it the same with markers that are known exactly.", photo_chain),
    ("Another simulator's bars, bent and let go", "oracle-release",
     "A bar, and a bar of two stiffnesses, held at one end, pulled aside and let go; three depth sensors fused to clouds at 30 Hz. Made by the same simulator. The even bar is fitted with no choice of ours. "
     "Where the other's materials meet is told to no fit but those of two regions; the truth is read for judging only.", release),
    ("Another simulator's sheet, let go and under weights", "oracle-load",
     "A sheet held along one edge, pulled aside and let go, then at rest under six weights; clouds of three depth sensors (Wang et al. 2015, figure 10 and table 3). Fitted to the release "
     "with no choice of ours; the weights are predicted, the truth is read for judging only.", loaded),
    ("A pot holder in two mountings", "two-mountings",
     "A silicone sheet held by one edge and let go from under a weight, lying and then hanging by its next edge; three depth sensors (Wang et al. 2015, figure 10 and table 3). The material of each release, fitted with no choice of ours, "
     "predicts weights in both mountings. The same program made the truth, with another law (Ogden's), other elements and shorter steps.", two_mountings),
    ("A silicone beam let go", "silicone-beam",
     "A real cantilever of Dragon Skin 10 (30 x 30 x 100 mm, Dubied et al.), held straight, released, and followed by motion capture at 100 Hz; twice under its own "
     "weight and twice with 0.51 N hung from its tip. Fitted under its own weight; what the weight does is predicted.", silicone_beam),
    ("Strips of one silicone, filmed", "silicone-strips",
     "Real: three strips of a silicone, two lengths and a shape with a waist, filmed from the side at 240 Hz as they swing from a clamp (films from a public repository, not shipped). "
     "Fitted with no choice of ours.", silicone_strips),
    ("Silicone bars at rest", "silicone",
     "Real: one depth image each, by a lidar camera, of bars that hang from a clamp or are twisted by half a turn (recordings of Arnavaz et al. 2023).", silicone),
    ("The bouncing torus", "torus",
     "Weiss et al. 2020, figure 8: one camera of 50 x 50 pixels, 40 frames, Young's modulus unknown and all else known. Starts are "
     "log-uniform between a tenth and ten times the truth of 5000 Pa.", torus),
    ("The cost over stiffness", "torus-sweep", "One curve: the same torus, from a fifth of the truth to five times it. The studies of the paper (its figures 7 and 18: a tree, and several lengths and noises) are not repeated.", sweep),
    ("Meshes made elsewhere", "rest-meshes", "Volumes that other programs made, in three formats: what `pliant mesh` says of each, and how far each "
     "sags with its own linear elements and with mid nodes on their edges.", rest_meshes),
    ("A stretched rubber strip", "rubber-dic", "435 speckles followed by two cameras over 20 frames of a strip under tension; what can be had from "
     "displacements alone.", rubber),
    ("A pneumatic arm after venting", "soft-arm", "A silicone arm, 44 x 100 mm, one chamber of which was inflated and vented: the swing that is left.", arm),
    ("A bar whose nodes are followed", "bar", "Wang et al. 2015, figures 6, 7 and 9 and table 1: a bar held at one end twists, bends and stretches; its "
     "moduli at one, two or eight control points and its two dampings are unknown.", bar),
    ("A dinosaur with seven moduli", "dinosaur", "Wang et al. 2015, figure 5b and table 1: control points at the extremities and the belly, mixed by harmonic weights; "
     "all nodes followed, through one swing and through all of the paper's frames.", dinosaur),
    ("Load-free shapes of objects that sag", "reference-shapes",
     "Wang et al. 2015, section 6.1 and table 2: a plant, a beam and a phone holder, as simple shapes. Each sags under its weight from a load-free shape that is known; from the sagged shape alone that shape is looked for, with the material given.",
     reference_shapes),
    ("A leaf that is scanned as it droops", "oracle-sag",
     "A drooping leaf, then pulled aside and let go; three depth sensors fused to clouds at 30 Hz. Made by another simulator with another material law and other elements. Neither the load-free shape nor the material is known; "
     "fitted with no choice of ours, and in other ways beside. The truth is read for judging only.", sagging_leaf),
    ("A plant that is scanned as it sags", "plant",
     "Wang et al. 2015, section 7 and table 4: a stem and three thick leaves, of five moduli, held in a pot, scanned sagging, pulled aside and let go; three depth sensors fused to clouds, 250 frames at 30 Hz. Made by a simulator of its own "
     "(`simulator.py`: quadratic tetrahedra, a compressible neo-Hookean law, BDF2 in steps of 1/360 s). Load-free shape, moduli, Poisson's ratio and both dampings are unknown. The truth is read for judging only.", plant),
    ("A bar of two stiffnesses that sags", "two-zone-sag",
     "Wang et al. 2015, figures 6 and 9 with the reference shape unknown: moduli and load-free shape together, with derivatives through the equilibrium, beside a splitting: three iterations of Levenberg-Marquardt "
     "with the shape held, then the shape anew, and so on; and beside the paper's own algorithm.", two_zones),
    ("Stress by a material that was found", "stress-fields",
     "Wang et al. 2015, figure 8: a foam bar of two stiffnesses is held at one end and falls into its swing under gravity; one depth camera sees it. Stress in its equilibrium by the material that was fitted, by two even ones, and by the true one.", stress_fields),
    ("A scan that is only roughly right", "rough-scan",
     "The dropped ring of the example, one depth camera, with its scan bent on purpose: the shape as an unknown of a dynamic fit, by a smooth field with a prior.", rough_scan),
    ("Sensors that were badly calibrated", "calibrated-sensors",
     "Three synthetic depth cameras before a dropped ring: two are stated 2 degrees and 20 mm off, one of them also takes its images 8 ms late through a lens that bends. A ball moved about before them calibrates them; the ring is fitted with the cameras as "
     "they are stated, as they were found, and as they are, by the points themselves (tracking=off, which sensors with clocks of their own need), with no other choice of ours. The truth judges only.", calibrated_sensors),
    ("Objects that swing before three sensors", "tracking",
     "A hanging bar and a thin leaf, curved both ways, held at one end, pulled aside and let go; three depth sensors around them do not see a third of the surface. Followed by `pliant track`'s tracker.", swinging),
    ("Two ways from clouds to a material", "oracle-tracking",
     "Another simulator's bars again: from the motion that the tracker finds, in turns with it (Wang et al. 2015, section 3), and from the points themselves by surface constraints (Weiss et al. 2020).", clouds),
    ("Real objects that are followed", "real-tracks",
     "Real: a knobbly ball, a plush dog and two cloths, moved by hands and a robot; rest surfaces made of their own frames. `pliant track`, with no choice of ours.", real_tracks),
    ("Presses with known force", None,
     "Simulated: blocks that are pressed at many places by a disc with a known force, markers on their surface followed. The material is fitted to most presses and predicts the others (Bickel et al. 2009).", presses),
    ("A face, a pillow and a foam under presses", "pressed-bodies",
     "Simulated, by Bickel et al. 2009, figures 1, 3, 8, 9 and 10: a layer that slides over a skull, a pillow with a hard part, and a foam that is pressed on. Each is fitted to some presses by `pliant fit` and pressed by another probe with `pliant press`.", pressed_bodies),
    ("Stress-strain curves", "material-curves",
     "Real: tension of silicones, several modes of loading of rubbers, a gel and brain tissue, and a shoe's foam. One cube each, fitted with the law and the parameters of presses.", material_curves),
    ("Balls pushed into organs and phantoms", "organ-probing",
     "Real: force over depth at hundreds of places of pig liver, meat and two phantoms. One law an object, the other probes, greater depths and another ball predicted.", organ_probing),
    ("A slab that is poked all over", "slab-poke-map",
     "Real: a soft slab on a table, scanned from above by a depth camera and poked along its normals at 90 places.", slab_pokes),
    ("Skin between two pads", "skin-dic", "Real: points on healthy skin followed by a camera while one pad is pulled, and the pad's force.", skin),
    ("Models in other simulators", "exports",
     "Models that were fitted to recordings of the battery with no choice of ours, exported and run by other programs (docs/exports.md).", exports),
    ("Memory of long recordings", "memory", "A torus that bounces for ten seconds, with about 2,400 nodes; long steps and few iterations.", memory),
]


def sensors():
    figures = results("sensors")
    if not figures:
        return ""
    rows = []
    for name, r in figures.items():
        seen = "; ".join([f"planes to {min(s['plane_rms_mm'])} mm rms, {s['objects']} objects" for s in r.get("scenes", [])[:1] if s.get("plane_rms_mm")] +
                         ([f"cloud of {r['cloud']['points']} points"] if "cloud" in r else []))
        masks = "; ".join(f"{key}: {m['median']}" for key, m in r.get("mask_iou", {}).items())
        rows.append([name, r["frames"], seen, masks])
    return ("\n## Real sensors\n\nRecordings of real depth cameras, read by `pliant check`. None has a scan at rest and a mass, so none can "
            "be fitted; what they show is that images, planes, objects and noise are read as they are.\n\n    python3 experiments/sensors/run.py "
            "build/release/apps/pliant\n\n" + table(["recording", "frames", "found", "agreement with masks (median intersection over union)"], rows))


def page():
    text = ("# Experiments\n\nWhat pliant reaches, beside a paper's figures where they are of the same thing. This page is made by "
            "`experiments/make_docs.py`: the measured figures are those of each experiment's `results.json`, the words around them are the script's, and a test compares both with this page.\n")
    for title, name, about, section in SECTIONS:
        command = f"    python3 experiments/{name}/run.py build/release/apps/pliant\n\n" if name else ""
        text += f"\n## {title}\n\n{about}\n\n{command}{section()}"
    return text + sensors()


def accuracy():
    """What README.md says of the example recording."""
    figures = results("oracle-bounce")
    r = figures["recordings"]["oracle-bounce-a"]

    def row(words, key, scale, unit):
        p = r["parameters"][key]
        digits = max(0, 1 - math.floor(math.log10(p["std"] * scale)))
        return [words, f"{p['value'] * scale:.{digits}f} ± {p['std'] * scale:.{digits}f}{unit}", f"{p['truth'] * scale:g}{unit}"]

    off = max(abs(f["parameters"]["youngs_modulus"]["value"] / f["parameters"]["youngs_modulus"]["truth"] - 1) for f in figures["recordings"].values())
    predicted, = [p["surface_rms"] for p in figures["predictions"] if p["model"] == "oracle-bounce-a"]
    return (table(["", "estimated", "truth"], [row("Young's modulus", "youngs_modulus", 1, " Pa"), row("Poisson's ratio", "poisson_ratio", 1, ""),
                                               row("mass damping", "mass_damping", 1, " 1/s"), row("stiffness damping", "stiffness_damping", 1e3, " ms")]) +
            f"\n{r['points']} points, {1e3 * r['surface_rms']:.2f} mm rms under a sensor noise of about {1e3 * r['sensor_noise']:.2f} mm; {r['wall_seconds']:.0f} s on {figures['machine']['cores']} cores shared with\n"
            f"other work. The model predicts another recording of the same ring to {1e3 * predicted:.2f} mm. Of that, and of a pebble on a\ntilted board "
            f"of unknown place, Young's modulus is found within {100 * off:.1f} %. What follows a ± is a deviation that holds other models\nthan the fit's, too.\n")


def readme():
    text = README.read_text()
    begin, end = (text.index(mark) for mark in ACCURACY)
    return text[:begin] + ACCURACY[0] + accuracy() + text[end:]


def main():
    made = {PAGE: page(), WEISS: weiss_page.page(), README: readme()} | plots.made  # the page draws the plots
    if "--check" in sys.argv:
        stale = [str(path.relative_to(ROOT)) for path, text in made.items() if not path.exists() or path.read_text() != text]
        sys.exit(f"{', '.join(stale)}: other than the results; run experiments/make_docs.py" if stale else 0)
    for path, text in made.items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)


if __name__ == "__main__":
    main()
