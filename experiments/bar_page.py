"""The sections of docs/experiments.md about the bar and the dinosaur whose nodes are followed. Standard library only."""
import plots
from page import IMAGES, from_landscape, judged, machine, results, table


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
# What Wang et al. found for their eight moduli, as table 1 prints it.
FOUND_IN_PAPER = [2.0e5, 1.0e6, 1.2e4, 6.6e5, 2.1e6, 6.6e4, 1.0e7, 1.9e4]


def track_rows(runs):
    rows = []
    for name, r in runs.items():
        kind, count = name.rsplit("-", 1)
        if kind not in WHAT:
            continue
        e = r["errors"]
        rows.append([WHAT[kind], count, r["settings"]["horizon"].replace(",", ", then "), small(e["worst_modulus"]), small(e["mass_damping"]), small(e["stiffness_damping"]),
                     r["evaluations"], f"{r['wall_seconds']:.0f}", f"{r['processor_seconds']:.0f}", r["reason"] if r["converged"] else "stopped by its budget"])
    return table(["case", "moduli", "frames", "worst E", "alpha", "beta", "evaluations", "time [s]", "processor time [s]", "why it ended"], rows)


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


def bar_targets(runs):
    """The targets, and whether the runs at hand meet them."""
    def worst(kind, key):
        return max(abs(r["errors"][key]) for name, r in runs.items() if name.startswith(kind + "-"))

    rows = []
    if "clean-8" in runs:
        eight = runs["clean-8"]
        dampings = max(worst("clean", "mass_damping"), worst("clean", "stiffness_damping"))
        rows += [["without noise, every E within 1 %", unsigned(worst("clean", "worst_modulus")), judged(worst("clean", "worst_modulus") < 0.01)],
                 ["without noise, alpha and beta within 2 %", unsigned(dampings), judged(dampings < 0.02)],
                 ["eight moduli in at most 3 min", f"{eight['wall_seconds']:.0f} s at load {eight['load_at_start']:.0f}, {eight['processor_seconds']:.0f} s of processor", judged(eight["wall_seconds"] <= 180)]]
    if "homogeneous-8" in runs:
        rows.append(["eight moduli of an even bar within 2 %", unsigned(worst("homogeneous", "worst_modulus")), judged(worst("homogeneous", "worst_modulus") < 0.02)])
    for name, r in sorted(runs.items()):
        if name.startswith("noise-"):
            rows.append([f"with noise, every E within 5 %: {name.split('-')[1]}", unsigned(abs(r["errors"]["worst_modulus"])), judged(abs(r["errors"]["worst_modulus"]) < 0.05)])
    return table(["target", "worst", ""], rows)


def bar():
    figures = results("bar")
    if not figures:
        return "Not run yet.\n"
    bar_plots(figures)
    runs = figures["runs"]
    some = next(iter(runs.values()))
    eight, simplex = runs["clean-8"], runs["nelder_mead-8"]
    moduli = [p["truth"] for p in eight["parameters"][:8]]
    spread = max(moduli) / min(moduli)
    text = table(["", "Wang 2015", "here"], [
        ["nodes / tetrahedra", "756 / 3000", f"{some['nodes']} / {some['elements']}"],
        ["frames that are compared", "3 x 250", f"3 x {figures['frames']}"],
        ["eight moduli, worst E", "", small(eight["errors"]["worst_modulus"])],
        [f"even bar, eight moduli, first {figures['first_horizon']} frames: worst E", "", small(runs["homogeneous-8"]["errors"]["worst_modulus"])],
        ["beta, worst", "", small(max((r["errors"]["stiffness_damping"] for n, r in runs.items() if n.startswith("clean")), key=abs))],
        ["fit of eight moduli", "1.5 h, 8 cores", f"{eight['wall_seconds']:.0f} s, 2 shared cores ({eight['processor_seconds']:.0f} s of processor)"],
        ["optimiser", "Nelder-Mead", "Levenberg-Marquardt"],
        ["forward / adjoint step", "", f"{eight['costs']['ms_per_forward_step']:.1f} / {eight['costs']['ms_per_adjoint_step']:.1f} ms"]])
    text += (f"\nFits compare the first {figures['first_horizon']} frames, at 60 a second, of each motion, and then all {figures['frames']}; where they begin comes from "
             f"the frequencies in {figures['frames']} frames of the bend ({eight['start']['wall_seconds']:.0f} s beside those of the fit of eight moduli). The paper lets the bar go from bent, twisted and stretched shapes; here it sets out "
             "straight with a velocity. Control points mix in the logarithm, in the paper linearly. "
             f"The paper's errors (0 to 20 %, one 37 %, for eight moduli) do not stand beside those of this table: its moduli lie at random places and span three decades, these lie evenly along the bar and span a factor of {spread:.1f}. Its own truth is below.\n\n"
             "**Without noise this is an inverse crime**: the truth is made by the very model that fits it, so the errors show that the optimiser finds the minimum, "
             "not how well a real bar would be measured. The row whose truth was simulated with half the step shows what another discretisation of time alone does.\n\n")
    text += bar_targets(runs) + "\n" + track_rows(runs)
    text += noise_by_frames(figures)
    text += truth_of_paper(runs)
    text += (f"\nNoise is {100 * figures['noise']:g} % of the bar's length on each coordinate of each node. Nelder-Mead begins where the others do, compares the first "
             f"{figures['first_horizon']} frames alone, and ends where its simplex is as small as the last step of the others, or after {figures['nelder_mead_budget_seconds']} s. With eight moduli it stood at {small(simplex['errors']['worst_modulus'])} after "
             f"{simplex['evaluations']} evaluations (start: {small(start_error(simplex))}).\n"
             "\n![Worst error of a modulus over evaluations](images/bar.svg)\n"
             "\nThe cost over the two moduli of the bar with two control points (the paper's figure 6), first "
             f"{figures['landscape_frames']} frames; grey: cannot be simulated; cross: truth. It is a narrow curved valley, along which a softer held end and a stiffer free end make up for each other.\n\n![Cost over two moduli](images/bar-landscape.svg)\n"
             "\nHow well the body's frequencies match those seen in its bend, over each modulus with the others as found (figure 7). Its minimum is where the fits begin.\n"
             "\n![Frequency mismatch over Young's modulus](images/bar-frequency-match.svg)\n")
    return text + f"\nMeasured on {machine(figures)}.\n"


def noise_by_frames(figures):
    """What noise does to each of eight moduli, and what it must do."""
    stages, bounds = figures["runs"]["noise-8"]["stages"], {d["frames"]: d["log_deviations"] for d in figures["deviations"]}
    rows = []
    for k in range(8):
        rows.append([f"{k + 1}"] + [cell for s in stages for cell in (small(s["parameters"][k]["relative_error"]), f"{100 * bounds[s['frames']][k]:.2g} %")])
    heads = [head for s in stages for head in (f"error, {s['frames']} frames", "least deviation")]
    free, = [bounds[s["frames"]][7] for s in stages[-1:]]
    return ("\nWith noise, eight moduli from the held end to the free one, as found after each stage, and the least standard deviation that any unbiased estimate of ln E can "
            "have with this noise in this many frames (the Cramer-Rao bound, from the cost's curvature at the truth):\n\n" + table(["modulus"] + heads, rows) +
            f"\nThe free end hardly deforms: its modulus cannot be told with less than {100 * free:.2g} % of deviation from {stages[-1]['frames']} frames of these motions, and the estimate is "
            f"{abs(stages[-1]['parameters'][7]['relative_error']) / free:.1f} such deviations off.\n")


def truth_of_paper(runs):
    """The paper's eight moduli at random control points, let go from deformed poses."""
    shown = {name: r for name, r in runs.items() if name.startswith("paper_") and "even" not in name}
    if not shown:
        return ""
    heads = {name: f"places {name.rsplit('-', 1)[0][-1]}{', noise' if 'noise' in name else ''}" for name in shown}
    rows = []
    for k in range(8):
        truth = next(iter(shown.values()))["parameters"][k]["truth"]
        rows.append([f"{truth:g}", f"{100 * (FOUND_IN_PAPER[k] / truth - 1.0):+.0f} %"] + [small(r["parameters"][k]["relative_error"]) for r in shown.values()])
    for key, name, found in (("mass_damping", "alpha", "0 to -5 %"), ("stiffness_damping", "beta", "-60 to +60 %")):
        rows.append([name, found] + [small(r["errors"][key]) for r in shown.values()])
    rows.append(["processor time [s]", "1.5 h, 8 cores"] + [f"{r['processor_seconds']:.0f}" for r in shown.values()])
    rows.append(["evaluations", ""] + [str(r["evaluations"]) for r in shown.values()])
    text = ("\n**The paper's own truth**: its eight moduli, over three decades, at nodes drawn at random, mixed by harmonic weights; the bar is let go from the equilibria in which its end "
            "is twisted by 60 degrees, bent up by a quarter of its length, and pulled out by 15 %; 250 frames of each. Which of its control points had which modulus the paper does not say. Errors:\n\n" +
            table(["truth [Pa]", "Wang 2015"] + list(heads.values()), rows))
    even = runs.get("paper_even_1-8")
    if even:
        text += (f"\nAn even bar, with the same noise, fitted with eight moduli at such places: at most {unsigned(even['errors']['worst_modulus'])} off (paper, without noise: 7 %). A modulus whose place is hardly strained, "
                 "or beside a much stiffer one, is what noise leaves open.\n")
    return text


def start_error(row):
    """Worst relative error of a modulus that the modes' frequencies gave."""
    return max((found / p["truth"] - 1.0 for found, p in zip(row["start"].get("moduli", []), row["parameters"])), key=abs, default=float("nan"))


def dinosaur():
    figures = results("dinosaur")
    if not figures:
        return "Not run yet.\n"
    runs = figures["runs"]
    rows = [(label, runs[name]) for name, label in (("clean-7", "one swing"), ("whole-7", "all frames"), ("noise-7", "all frames, noise of 1 %")) if name in runs]
    places = ["head", "tail", "left hand", "right hand", "left foot", "right foot", "belly"]
    first = rows[0][1]
    text = table(["", "Wang 2015", *(f"here, {label}" for label, _ in rows)], [
        ["nodes / tetrahedra", "4867 / 16270", *(f"{r['nodes']} / {r['elements']}" for _, r in rows)],
        ["frames that are compared", "523", *(str(r["settings"]["horizon"]).split(",")[-1] for _, r in rows)],
        ["worst E", "5 %", *(small(r["errors"]["worst_modulus"]) for _, r in rows)],
        ["alpha", "", *(small(r["errors"]["mass_damping"]) for _, r in rows)],
        ["beta", "60 %", *(small(r["errors"]["stiffness_damping"]) for _, r in rows)],
        ["evaluations", "", *(r["evaluations"] for _, r in rows)],
        ["time on 2 shared cores", "3 h, 8 cores", *(f"{r['wall_seconds']:.0f} s ({r['processor_seconds']:.0f} s of processor)" for _, r in rows)],
        ["forward / adjoint step", "", *(f"{r['costs']['ms_per_forward_step']:.0f} / {r['costs']['ms_per_adjoint_step']:.0f} ms" for _, r in rows)],
        ["why it ended", "", *(r["reason"] for _, r in rows)]])
    text += "\n" + table(["", "truth", *(f"error, {label}" for label, _ in rows)],
                         [[place, f"{first['parameters'][i]['truth']:g}", *(small(r["parameters"][i]["relative_error"]) for _, r in rows)]
                          for i, place in enumerate(places + ["alpha [1/s]", "beta [s]"])])
    text += "\n" + table(["target", "here", ""], [
        [f"every E within 3 %, {label}", unsigned(abs(r["errors"]["worst_modulus"])), judged(abs(r["errors"]["worst_modulus"]) < 0.03)] for label, r in rows] + [
        ["one swing in at most 30 min", f"{first['wall_seconds'] / 60:.1f} min", judged(first["wall_seconds"] <= 1800)]])
    begun = "ten times the truth's mean modulus and dampings, since no vibration was seen well enough" if first["start"]["by"] == "off" else "what the modes' frequencies give"
    text += (f"\nThe fit of one swing began at {begun}. Made of rounded limbs, meshed, held at the feet and pushed. Model and truth are one, an inverse crime. "
             "Fits of all frames compare the first 16, then 60, then all.\n")
    if "noise-7" in runs:
        noisy = runs["noise-7"]
        before, last = noisy["history"][-4], noisy["history"][-1]
        text += (f"\nNoise is normal, of a hundredth of the size in each coordinate, where the farthest node moves by {1e3 * noisy['motions'][0]['largest_displacement']:.0f} mm: it leaves the hands open, "
                 f"which hardly bend. Over the last three iterations the worst modulus went from {100 * abs(before[3]):.0f} to {100 * abs(last[3]):.0f} % off and the cost, a negative log "
                 f"likelihood, fell by {before[1] - last[1]:.2f}: less than one standard deviation is worth (0.5).\n")
    cores = figures["machine"]
    return text + f"\nMeasured on {cores['cores']} cores ({cores['processor']}), shared with other work" + (
        f": load {first['load_at_start']:.1f} at the start" if "load_at_start" in first else "") + ".\n"
