#!/usr/bin/env python3
"""Writes docs/experiments.md and its plots from the results.json of each experiment. Standard library only.

Usage: experiments/make_docs.py [--check]
  --check  write nothing; return 1 where the page does not match the results"""
import json
import math
import pathlib
import sys

import plots

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent
IMAGES = ROOT / "docs/images"
PAGE, PLOT = ROOT / "docs/experiments.md", IMAGES / "torus-sweep.svg"


def results(name):
    path = HERE / name / "results.json"
    return json.loads(path.read_text()) if path.exists() else None


def machine(figures):
    m = figures["machine"]
    return f"{m['cores']} cores ({m['processor']}), shared with other work: load {m['load']} at the end"


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]) + "\n"


def percent(value, sign=True):
    return f"{100 * value:{'+' if sign else ''}.1f} %"


def with_truth(p, scale=1.0, unit=""):
    text = f"{p['value'] * scale:.4g}"
    if p.get("std"):
        std = p["std"] * scale
        text += f" ± {std:.0f}" if std >= 10 else f" ± {std:.2g}"
    if p.get("truth") is not None:
        text += f" ({p['truth'] * scale:g})"
    return text + unit


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
    outside = [f"{name}: {key.replace('_', ' ')} {abs(p['value'] - p['truth']) / p['std']:.1f} deviations off"
               for name, r in figures["recordings"].items() for key, p in r["parameters"].items()
               if p.get("std") and p.get("truth") is not None and abs(p["value"] - p["truth"]) > 2 * p["std"]]
    text += "\nOutside twice the stated deviation: " + ("; ".join(outside) if outside else "none") + \
        ". The deviations come from the sensor's noise alone; another material law and other elements are not in them.\n"
    return text + f"\nMeasured on {machine(figures)}.\n"


def torus():
    figures = results("torus")
    if not figures:
        return "Not run yet.\n"
    text = table(["", "Weiss 2020", "here"], [
        ["elements / nodes", "690 / 1138", f"{figures['elements']} / {figures['nodes']}"],
        ["starts within 5 % of the truth", "18 to 20 of 20", f"{figures['within_5_percent']} of {figures['starts']}"],
        ["mean error of Young's modulus", "2.7 to 5 %", percent(figures["mean_error"], False)],
        ["worst error", "", percent(figures["worst_error"], False)],
        ["optimiser", "Rprop", "Levenberg-Marquardt"],
        ["forward step", "95 ms", f"{figures['ms_per_forward_step']:.1f} ms"],
        ["adjoint step", "225 ms", f"{figures['ms_per_adjoint_step']:.1f} ms"],
        ["whole fit, one thread (median)", "", f"{figures['median_wall_seconds']:.0f} s"]])
    text += ("\nThe recording was simulated on a finer grid with shorter steps than it is fitted with; the paper's starts and noise are its "
             "own. All starts that converge agree: what is left of the error is the noise (a deviation of about 1.2 %), the grid and the step. The steps here are shorter "
             "than the paper's: several to a frame, where it took one.\n\n")
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
    PLOT.parent.mkdir(exist_ok=True)
    PLOT.write_text("\n".join(parts) + "\n")


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


def small(value):
    """A relative error in percent, without digits that say nothing."""
    percents = 100 * abs(value)
    if percents < 1e-3:
        return "< 0.001 %"
    return f"{100 * value:+.0f} %" if percents >= 10 else f"{100 * value:+.2g} %"


def unsigned(value):
    return small(value).lstrip("+")


WHAT = {"clean": "no noise", "noise": "noise", "finer_truth": "no noise, truth with half the step", "homogeneous": "no noise, truth even",
        "nelder_mead": "no noise, Nelder-Mead"}


def track_rows(runs):
    rows = []
    for name, r in runs.items():
        kind, count = name.rsplit("-", 1)
        e = r["errors"]
        rows.append([WHAT[kind], count, small(e["worst_modulus"]), small(e["mass_damping"]), small(e["stiffness_damping"]),
                     r["evaluations"], f"{r['wall_seconds']:.0f}", f"{r['processor_seconds']:.0f}", r["reason"] if r["converged"] else "stopped by its budget"])
    return table(["case", "moduli", "worst E", "alpha", "beta", "evaluations", "time [s]", "processor time [s]", "why it ended"], rows)


def from_landscape(figures, path):
    """Cost over two moduli, in shades of its logarithm."""
    moduli, costs, truth = figures["landscape"]["moduli"], figures["landscape"]["costs"], figures["landscape"]["truth"]
    log = [math.log10(E) for E in moduli]
    half = 0.5 * (log[1] - log[0])
    span = (log[0] - half, log[-1] + half)
    known = [math.log10(c) for row in costs for c in row if c]
    low, high = min(known), max(known)
    panel = plots.Panel(80, 20, 380, 380, span, span)
    for second, row in zip(log, costs):
        for first, cost in zip(log, row):
            colour = plots.shade((math.log10(cost) - low) / (high - low)) if cost else "#ddd"
            panel.cell((10**(first - half), 10**(first + half)), (10**(second - half), 10**(second + half)), colour)
    panel.axes("modulus at the held end [Pa]", "modulus at the free end [Pa]")
    panel.cross(*truth)
    for i in range(40):
        panel.parts.append(f'<rect x="490" y="{360 - 8 * i}" width="18" height="8.4" fill="{plots.shade(i / 39)}"/>')
    panel.parts.append(f'<text x="514" y="368">{10**low:.1e}</text><text x="514" y="54">{10**high:.1e}</text><text x="490" y="30">cost</text>')
    plots.write(path, 600, 460, panel.parts)


def bar_plots(figures):
    runs = figures["runs"]
    panel = plots.Panel(80, 20, 540, 300, (0.0, 2.3), (-10.0, 1.5))
    number = 0
    for count, colour in zip((1, 2, 8), plots.COLOURS):
        for kind, title in (("clean", "Levenberg-Marquardt"), ("nelder_mead", "Nelder-Mead")):
            row = runs.get(f"{kind}-{count}")
            if not row:
                continue
            points = [(1 + i, max(worst, 1e-10)) for i, _, _, worst in row["history"]]
            panel.line([(1, abs(start_error(row)))] + points, colour, f"{title}, {count} {'modulus' if count == 1 else 'moduli'}", number,
                       dashed=kind == "nelder_mead")
            number += 1
    panel.axes("evaluations of the cost", "worst relative error of a modulus")
    plots.write(IMAGES / "bar.svg", 660, 380, panel.parts)
    from_landscape(figures, IMAGES / "bar-landscape.svg")
    panel = plots.Panel(80, 20, 540, 260, (3.0, 8.0), (-6.0, 2.5))
    number = 0
    for name in ("clean-1", "clean-2"):
        row = runs.get(name, {})
        for curve in row.get("start", {}).get("curves", []):
            count, control = int(name[-1]), curve["control"]
            colour = plots.COLOURS[number]
            label = "one modulus" if count == 1 else f"modulus {control} of {count}"
            panel.vertical(row["parameters"][control - 1]["truth"], colour)
            panel.line(list(zip(curve["moduli"], curve["mismatch"])), colour, label, number)
            number += 1
    panel.axes("Young's modulus [Pa]; dashed: truth", "frequency mismatch")
    plots.write(IMAGES / "bar-frequency-match.svg", 660, 340, panel.parts)


def judged(good):
    return "met" if good else "missed"


def bar_targets(runs, part):
    """The targets, and whether the runs at hand meet them.

    part: frames that were compared of those that the target for the time speaks of"""
    def worst(kind, key):
        return max(abs(r["errors"][key]) for name, r in runs.items() if name.startswith(kind + "-"))

    rows = []
    if "clean-8" in runs:
        dampings = max(worst("clean", "mass_damping"), worst("clean", "stiffness_damping"))
        rows += [["without noise, every E within 1 %", unsigned(worst("clean", "worst_modulus")), judged(worst("clean", "worst_modulus") < 0.01)],
                 ["without noise, alpha and beta within 2 %", unsigned(dampings), judged(dampings < 0.02)],
                 ["eight moduli in at most 3 min", f"{runs['clean-8']['wall_seconds']:.0f} s, with {part} of the frames", "not shown"]]
    if "homogeneous-8" in runs:
        rows.append(["eight moduli of an even bar within 2 %", unsigned(worst("homogeneous", "worst_modulus")), judged(worst("homogeneous", "worst_modulus") < 0.02)])
    if any(name.startswith("noise-") for name in runs):
        rows.append(["with noise, every E within 5 %", unsigned(worst("noise", "worst_modulus")), judged(worst("noise", "worst_modulus") < 0.05)])
    return table(["target", "worst", ""], rows)


def bar():
    figures = results("bar")
    if not figures:
        return "Not run yet.\n"
    bar_plots(figures)
    runs = figures["runs"]
    some = next(iter(runs.values()))
    eight, simplex = runs["clean-8"], runs["nelder_mead-8"]
    text = table(["", "Wang 2015", "here"], [
        ["nodes / tetrahedra", "756 / 3000", f"{some['nodes']} / {some['elements']}"],
        ["frames that are compared", "3 x 250", f"3 x {figures['horizon']}"],
        ["eight moduli, worst E", "0 to 20 %, one 37 %", small(eight["errors"]["worst_modulus"])],
        ["even bar, eight moduli, worst E", "7 %", small(runs["homogeneous-8"]["errors"]["worst_modulus"])],
        ["beta, worst", "60 %", small(max((r["errors"]["stiffness_damping"] for n, r in runs.items() if n.startswith("clean")), key=abs))],
        ["fit of eight moduli", "1.5 h, 8 cores", f"{eight['wall_seconds']:.0f} s, 2 shared cores ({eight['processor_seconds']:.0f} s of processor)"],
        ["optimiser", "Nelder-Mead", "Levenberg-Marquardt"],
        ["forward / adjoint step", "", f"{eight['costs']['ms_per_forward_step']:.1f} / {eight['costs']['ms_per_adjoint_step']:.1f} ms"]])
    text += (f"\nFits compare the first {figures['horizon']} frames, at 60 a second, of each motion, fewer than the paper's, to keep the experiment short; where they begin comes from "
             f"the frequencies in {figures['frames']} frames of the bend (of eight moduli without noise: in the compared frames alone). The paper lets the bar go from bent, twisted and stretched shapes; here it sets out "
             "straight with a velocity. Control points mix in the logarithm, in the paper linearly.\n\n"
             "**Without noise this is an inverse crime**: the truth is made by the very model that fits it, so the errors show that the optimiser finds the minimum, "
             "not how well a real bar would be measured. The row whose truth was simulated with half the step shows what another discretisation of time alone does.\n\n")
    text += bar_targets(runs, f"{figures['horizon']} of {figures['frames']}") + "\n" + track_rows(runs)
    noisy = runs["noise-8"]["parameters"][:8]
    text += ("\nWith noise, moduli from the held end to the free one: " + ", ".join(small(p["relative_error"]) for p in noisy) +
             ". The free end hardly deforms, so its modulus hardly shows.\n")
    text += (f"\nNoise is {100 * figures['noise']:g} % of the bar's length on each coordinate of each node. Nelder-Mead begins at what the modes' frequencies in the whole bend give (the fit of eight moduli without noise above at what the compared frames "
             "alone give, another start of the same kind), ends where "
             f"its simplex is as small as the last step of the others, or after {figures['nelder_mead_budget_seconds']} s. With eight moduli it then stood at {small(simplex['errors']['worst_modulus'])} after "
             f"{simplex['evaluations']} evaluations (start: {small(start_error(simplex))}).\n"
             "\n![Worst error of a modulus over evaluations](images/bar.svg)\n"
             "\nThe cost over the two moduli of the bar with two control points (the paper's figure 6), first "
             f"{figures['landscape_frames']} frames; grey: cannot be simulated; cross: truth. It is a narrow curved valley, along which a softer held end and a stiffer free end make up for each other.\n\n![Cost over two moduli](images/bar-landscape.svg)\n"
             "\nHow well the body's frequencies match those seen in its bend, over each modulus with the others as found (figure 7). Its minimum is where the fits begin.\n"
             "\n![Frequency mismatch over Young's modulus](images/bar-frequency-match.svg)\n")
    return text + f"\nMeasured on {machine(figures)}.\n"


def start_error(row):
    """Worst relative error of a modulus that the modes' frequencies gave."""
    return max((found / p["truth"] - 1.0 for found, p in zip(row["start"].get("moduli", []), row["parameters"])), key=abs, default=float("nan"))


def dinosaur():
    figures = results("dinosaur")
    if not figures:
        return "Not run yet.\n"
    r = figures["runs"]["clean-7"]
    places = ["head", "tail", "left hand", "right hand", "left foot", "right foot", "belly"]
    text = table(["", "Wang 2015", "here"], [
        ["nodes / tetrahedra", "4867 / 16270", f"{r['nodes']} / {r['elements']}"],
        ["frames that are compared", "523", r["settings"]["horizon"]],
        ["worst E", "5 %", small(r["errors"]["worst_modulus"])],
        ["beta", "60 %", small(r["errors"]["stiffness_damping"])],
        ["time", "", f"{r['wall_seconds']:.0f} s, 2 shared cores ({r['processor_seconds']:.0f} s of processor)"],
        ["forward / adjoint step", "", f"{r['costs']['ms_per_forward_step']:.0f} / {r['costs']['ms_per_adjoint_step']:.0f} ms"]])
    text += "\n" + table(["", "truth", "found", "error"], [[place, f"{p['truth']:g}", f"{p['value']:.5g}", small(p["relative_error"])]
                                                       for place, p in zip(places + ["alpha [1/s]", "beta [s]"], r["parameters"])])
    text += ("\nMade of rounded limbs, meshed, held at the feet and pushed. Also an inverse crime: model and truth are one, and there is no noise. "
             f"It {'converged' if r['converged'] else 'did not converge'} after {r['evaluations']} evaluations.\n")
    return text + f"\nMeasured on {machine(figures)}.\n"


SECTIONS = [
    ("Another simulator's recordings", "oracle-bounce",
     "A ring dropped on the floor (twice), and a pebble dropped on a tilted board whose place is to be found too, recorded by another simulator with another material law, other elements "
     "and a model of a depth sensor's faults. Fitted with no choice of ours; the truth is read for judging only.", oracle),
    ("The bouncing torus", "torus",
     "Weiss et al. 2020, figure 8: one camera of 50 x 50 pixels, 40 frames, Young's modulus unknown and all else known. Starts are "
     "log-uniform between a tenth and ten times the truth of 5000 Pa.", torus),
    ("The cost over stiffness", "torus-sweep", "The same torus, as in figures 7 and 18 of the paper: from a fifth of the truth to five times it.", sweep),
    ("A bar whose nodes are followed", "bar", "Wang et al. 2015, figures 6, 7 and 9 and table 1: a bar held at one end twists, bends and stretches; its "
     "moduli at one, two or eight control points and its two dampings are unknown.", bar),
    ("A dinosaur with seven moduli", "dinosaur", "Wang et al. 2015, figure 5b and table 1: control points at the extremities and the belly, mixed by harmonic weights; "
     "all nodes followed through one swing.", dinosaur),
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
    text = ("# Experiments\n\nWhat pliant reaches, beside the paper's figures where there are any. This page is made from the "
            "`results.json` of each experiment by `experiments/make_docs.py`; nothing here is typed by hand.\n")
    for title, name, about, section in SECTIONS:
        text += f"\n## {title}\n\n{about}\n\n    python3 experiments/{name}/run.py build/release/apps/pliant\n\n{section()}"
    return text + sensors()


def main():
    made = page()
    if "--check" in sys.argv:
        sys.exit(0 if PAGE.exists() and PAGE.read_text() == made else "docs/experiments.md does not match the results: run experiments/make_docs.py")
    PAGE.write_text(made)


if __name__ == "__main__":
    main()
