"""docs/weiss.md: the evaluation of Weiss et al. 2020 beside pliant's figures of the same quantity. Standard library only."""
import math

import plots
from page import IMAGES, machine, percent, results, table

NOT_RUN = "Not run yet.\n"

HEAD = """# The evaluation of Weiss et al. 2020

The paper's figures beside pliant's, of the same quantity: the mean error of Young's modulus over the runs that reach the truth, the
share of runs that do, and evaluations. Set-ups are the paper's as far as it tells them: shapes, Young's moduli, frames, cameras, noise in
voxels, phi_max (the width of the band around the surface beyond which points cost a constant), starts log-uniform from a tenth to ten times the truth. What
differs everywhere: recordings are simulated here on cells 0.69 times as long as those of the fit and with shorter steps, where the paper uses the
same simulation for both (an inverse crime); a frame is several time steps, where it was one; starts are followed as `pliant fit` follows
its own, over 60 % of the frames, then over all, by Gauss-Newton with Levenberg and Marquardt's damping, where the paper uses Rprop. *Reached* means within 25 % of the truth; the paper does
not say what it counts as converged. Nobody who uses `pliant fit` gives a start: it scans four decades.

    python3 experiments/weiss/run.py build/release/apps/pliant [--only STUDY,...]

"""


def reached(row):
    return f"{row['reached']} of {row['starts']}"


def mean(row):
    return percent(row["mean_error"], False) if row["mean_error"] is not None else ""


def goal(row, paper):
    """Whether an error is at most half the paper's."""
    return "met" if row["mean_error"] is not None and row["mean_error"] <= 0.5 * paper else "missed"


def starts_table(studies, name, head, papers):
    """`papers`: by case (title, the paper's mean error or None, the share that it reached or empty)."""
    found = studies.get(name)
    if not found:
        return NOT_RUN
    rows = []
    for case, (title, error, share) in papers.items():
        r = found.get(case)
        if r:
            rows.append([title, percent(error, False) if error is not None else "not told", share, mean(r), goal(r, error) if error is not None else "", reached(r),
                         percent(r["worst_error"], False), f"{r['evaluations']:g}"])
    return table([head, "paper: mean error", "paper: converged", "mean error", "half the paper's", "reached", "worst start", "evaluations (median)"], rows)


def way_plot(found, path, truth):
    """Young's modulus over iterations, all starts of all cases."""
    longest = max(len(r["way"]) for case in found.values() for r in case["rows"])
    panel = plots.Panel(80, 20, 520, 300, (0.0, math.log10(max(2, longest + 1))), (math.log10(truth) - 1.15, math.log10(truth) + 1.15))
    panel.axes("iteration + 1", "Young's modulus [Pa]")
    for colour, case in zip(plots.COLOURS * 2, found.values()):
        for r in case["rows"]:
            points = [(i + 1, max(E, truth / 14)) for i, E in enumerate([r["start"], *r["way"]])]
            panel.parts.append(f'<polyline points="{" ".join(f"{panel.x(x):.1f},{panel.y(min(y, truth * 14)):.1f}" for x, y in points)}" fill="none" stroke="{colour}" stroke-width="1" opacity="0.6"/>')
    plots.write(path, 640, 380, panel.parts)


def curves_table(found, title):
    rows = []
    for case, c in found.items():
        signs = c["wrong_signs"]
        wrong = ", ".join(f"{w:.3g}" for w in signs) if len(signs) < 4 else f"between {min(signs):.3g} and {max(signs):.3g}"
        rows.append([*case.split(", "), f"{c['lowest_at']:.4g}", f"{len(c['wrong_signs'])} of {len(c['values'])}" + (f" ({wrong} Pa)" if wrong else ""), c["failed"] or ""])
    return table([*title, "lowest cost at [Pa]", "derivative points away from the truth", "could not be simulated"], rows)


def costs(studies):
    found = studies.get("costs")
    if not found:
        return NOT_RUN
    words = {"displacement": "J_DISP: known displacements (eq. 2)", "field": "J_SDF: distance fields (eq. 3)", "surface": "J_SSC: points on the surface (eq. 4)",
             "every 10th frame with noise": "J_SSC, every 10th frame, noise of variance 3 voxels"}
    rows = []
    for case, c in found.items():
        body, cost = case.split(", ", 1)
        wrong = c["wrong_signs"]
        rows.append([body, words[cost], f"{c['lowest_at']:.4g}", f"{len(wrong)} of {len(c['values'])}" + (f", {min(wrong):.3g} to {max(wrong):.3g} Pa" if wrong else "")])
    text = table(["body", "cost", "lowest cost at [Pa]", "derivative points away from the truth"], rows)
    return text + ("\nThe truth is 1000 Pa of the block and 4000 Pa of the tree; the block is the paper's in three dimensions. Distance fields are advected by one semi-Lagrangian step, the look-up at the point "
                   "less its own displacement, which is the step that the paper warns of (4.1, figure 3c): its lowest cost lies beside the truth, and its derivative points away from the truth in between. True displacements are those of the recording's finer simulation.\n")


def joint(studies):
    found = studies.get("joint")
    if not found:
        return NOT_RUN
    truth, rows = found["truth"], found["rows"]
    least = min(r["cost"] for r in rows)
    good = [r for r in rows if r["cost"] < 1.05 * least + 3.0]
    off = [abs(r["gravity"] / truth["gravity"] - 1.0) for r in good]
    spread = lambda key: f"{min(r[key] for r in good):.4g} to {max(r[key] for r in good):.4g}"
    text = table(["", "Weiss 2020", "here", "truth"], [
        ["starts", "60", f"{len(rows)}", ""], ["ended at the lowest cost", "all (\"almost zero cost\")", f"{len(good)}", ""],
        ["gravity of those [m/s^2]", "\"quite unique\"", f"{spread('gravity')} (at most {percent(max(off), False)} off)", f"{truth['gravity']:g}"],
        ["Young's modulus [Pa]", "\"strongly differ\"", spread("youngs_modulus"), f"{truth['youngs_modulus']:g}"],
        ["stiffness damping [s]", "\"strongly differ\"", spread("stiffness_damping"), f"{truth['stiffness_damping']:g}"],
        ["evaluations (median)", "20 iterations", f"{sorted(r['evaluations'] for r in rows)[len(rows) // 2]}", ""]])
    others = [r for r in rows if r not in good]
    if others:
        text += f"\n{len(others)} starts ended elsewhere, at {min(r['cost'] for r in others) / least:.3g} times the lowest cost and more.\n"
    ridge = found["ridge"]
    panel = plots.EvenPanel(80, 20, 520, 300, 4.5, 7.0)
    panel.axes("Young's modulus [kPa]", "stiffness damping [ms]")
    panel.parts.append('<polyline points="' + " ".join(f"{panel.x(1e-3 * r['youngs_modulus']):.1f},{panel.y(1e3 * r['stiffness_damping']):.1f}" for r in ridge) +
                       f'" fill="none" stroke="{plots.COLOURS[0]}" stroke-width="2"/>')
    for r in good:
        panel.mark(1e-3 * r["youngs_modulus"], 1e3 * r["stiffness_damping"], plots.COLOURS[1])
    panel.cross(1e-3 * truth["youngs_modulus"], 1e3 * truth["stiffness_damping"])
    plots.write(IMAGES / "weiss-ridge.svg", 640, 390, panel.parts)
    text += "\nThe ridge of figure 28, between modulus and damping: Young's modulus held at values about the truth, stiffness damping and gravity as they are best then (line). It is no valley of equal costs: the cost rises along it, by hundreds to the next moduli, and starts that go to the end of it meet at one place. Points: where the starts ended; cross: the truth.\n\n![The ridge](images/weiss-ridge.svg)\n\n"
    return text + table(["Young's modulus held [Pa]", "stiffness damping [ms]", "cost above the lowest"],
                        [[f"{r['youngs_modulus']:g}", f"{1e3 * r['stiffness_damping']:.3g}", f"{r['cost'] - min(least, min(q['cost'] for q in ridge)):.3g}"] for r in ridge])


NAMES = {"levenberg_marquardt": "Gauss-Newton (Levenberg-Marquardt)", "rprop": "Rprop", "lbfgs": "L-BFGS", "gradient_descent": "gradient descent"}


def optimisers(studies):
    found = studies.get("optimisers")
    if not found:
        return NOT_RUN
    rows = []
    for case, runs in found.items():
        body, optimiser = case.split(", ")
        least = min(r["cost"] for other, all_of in found.items() if other.startswith(body + ", ") for r in all_of if r["cost"] is not None)
        ended = sum(r["cost"] is not None and r["cost"] < 1.05 * least + 3.0 for r in runs)
        rows.append([body, NAMES[optimiser], f"{ended} of {len(runs)}", "; ".join(percent(r["error"]) for r in runs), "; ".join(f"{r['evaluations']}" for r in runs),
                     "; ".join(f"{r['processor_seconds']:.0f}" for r in runs), "; ".join(f"{r['cost']:.0f}" if r["cost"] is not None else "failed" for r in runs)])
    text = table(["body", "optimiser", "at the lowest cost", "error of E, each start", "evaluations", "processor time [s]", "final cost"], rows)
    ratios = []
    for body in dict.fromkeys(case.split(", ")[0] for case in found):
        newton, rprop = (sum(r["evaluations"] for r in found[f"{body}, {o}"]) for o in ("levenberg_marquardt", "rprop") if f"{body}, {o}" in found)
        ratios.append(f"{body} {rprop / newton:.1f}")
    return text + (f"\nEvaluations of Rprop over those of Gauss-Newton: {', '.join(ratios)} (goal: 10; where one number is unknown Rprop itself ends after some 35, where "
                   "nine are it is stopped at 60 without having arrived). An evaluation of Gauss-Newton carries a tangent for each unknown, one of the others an adjoint. "
                   "All begin at the same starts and see all frames at once; first-order methods end after 60 iterations. The ramp has nine unknowns: gravity (3), Young's modulus, two dampings, and the plane (3), "
                   "8 degrees and 30 mm off and not seen. The paper: gradient descent and Rprop reach the optimum of one unknown, L-BFGS overshoots; with many, gradient descent diverges and Rprop is best.\n")


def page():
    figures = results("weiss")
    studies = figures["studies"] if figures else {}
    share = {"1": ("1 camera", 0.0239, "95 % on average"), "2": ("2 cameras", 0.0894, ""), "4": ("4 cameras", 0.0508, ""), "8": ("8 cameras", 0.0446, "")}
    text = HEAD
    text += "## Views (figures 10a and 21)\n\nThe torus, 40 frames, cameras of 50 x 50 pixels at random places above the floor, noise of 0.1 voxels, phi_max 5, 20 starts. (Section 7.3 of the paper gives 2.39 % to four cameras and 5.08 % to one, its figure the other way round.)\n\n"
    text += starts_table(studies, "views", "views", share)
    same = studies.get("same-cells")
    if same:
        text += (f"\nAll starts of a row end at one place, so what is left is no matter of starts or optimisers: of one camera's {mean(studies['views']['1'])}, {mean(same['1'])} are left where "
                 f"the recording is simulated on the fit's own cells, and {mean(same['third'])} where the fit's steps are a third as long, too. The paper's errors are those of one simulation for both.\n")
    text += "\n## Resolutions (figures 10b and 22)\n\nOne camera; of its readings at most 1,000 a frame are compared.\n\n"
    text += starts_table(studies, "resolutions", "pixels", {"20": ("20 x 20", 0.0271, "18 of 20"), "50": ("50 x 50", 0.0462, ""), "100": ("100 x 100", 0.0305, "20 of 20"), "200": ("200 x 200", 0.0256, "")})
    if studies.get("resolutions"):
        way_plot(studies["resolutions"], IMAGES / "weiss-resolutions.svg", 5000.0)
        text += "\n![Young's modulus over the iterations, all starts](images/weiss-resolutions.svg)\n"
    text += "\n## Width of the band and noise (figure 23)\n\n14 starts. The paper does not say its two noises; here 0.1 and 1 voxels (18 mm on an object of 280 mm). All starts of a row end at one place: what the errors tell is the mesh and, of the last row, the noise.\n\n"
    text += starts_table(studies, "bands", "phi_max, noise [voxels]", {"1, 0.1": ("1, 0.1", 0.1196, "10 of 14"), "1, 1": ("1, 1", 0.1075, "10 of 14"), "5, 0.1": ("5, 0.1", 0.0557, "13 of 14"), "5, 1": ("5, 1", 0.0301, "13 of 14")})
    text += "\n## Adjoint and finite differences (figures 19 and 24)\n\nRprop with gradients by the adjoint and by forward differences of 5 and 100 Pa, seven starts, 40 iterations at most.\n\n"
    text += starts_table(studies, "differences", "gradient", {"0": ("adjoint", 0.0141, "all"), "5": ("difference of 5 Pa", 0.3514, "none"), "100": ("difference of 100 Pa", 0.3933, "none")})
    text += "\nThe paper's errors with differences are means over all runs. The derivative over Young's modulus, from a fifth to five times the truth:\n\n"
    text += curves_table(studies["difference-gradients"], ["width of the difference [Pa]; 0: adjoint"]) if studies.get("difference-gradients") else NOT_RUN
    text += "\n## Frames and noise (figure 18)\n\nThe torus, phi_max 5, over a tenth to ten times the truth of 5000 Pa. It meets the floor in frame 10: before that its weight alone, which the fall takes away, could strain it.\n\n"
    text += curves_table(studies["steps"], ["frames", "noise [voxels]"]) if studies.get("steps") else NOT_RUN
    text += "\n## Width of the band (figure 20)\n\nThe paper: wrong signs below one voxel, best from 2 to 5.\n\n"
    text += curves_table(studies["widths"], ["phi_max [voxels]"]) if studies.get("widths") else NOT_RUN
    text += "\n## Three costs (figures 3 and 7)\n\n" + costs(studies)
    text += "\n## A ball on six grounds (figures 25 and 26)\n\nRandom tilts up to 29 degrees each way, heights and throws, the same 20 starts on each, 20 frames, noise 0.07 voxels, phi_max 1, truth 2000 Pa. The ground is not drawn: a steep one would stand before the camera.\n\n"
    text += starts_table(studies, "grounds", "ground", {str(i): (str(i), None, "18 to 20 of 20") for i in range(1, 7)})
    errors = [percent(r["fit_error"]) for r in studies.get("grounds", {}).values() if "fit_error" in r]
    if errors:
        text += ("\nThe starts that fail are those that are seven times too soft and more: the ball flattens, and between there and the truth the cost rises (as the paper says of its own), which an optimiser that only "
                 f"goes down does not cross. `pliant fit` scans first: with no start given it is off by {', '.join(errors)} on the six.\n")
    text += "\n## Gravity, Young's modulus and stiffness damping together (figures 11, 27 and 28)\n\nThe ball, 60 starts: Young's modulus and stiffness damping from a tenth to ten times the truth, gravity from half to twice; its direction is free within the prior about `up`.\n\n" + joint(studies)
    text += "\n## Bodies of many parts (figures 9 and 29)\n\nIn the dragon's place two other bodies, held at the hind end, 10 frames, 20 starts (the paper: two, \"very small reconstruction errors\"). Their meshes are not part of this repository; the study reads them where they are.\n\n"
    text += starts_table(studies, "bodies", "body", {"spot.obj": ("cow", None, "2 of 2"), "bunny_watertight_simplified.obj": ("bunny", None, "2 of 2")})
    text += "\n## Optimisers (figures 30 and 31)\n\n" + optimisers(studies)
    return text + (f"\nMeasured on {machine(figures)}.\n" if figures else "")
