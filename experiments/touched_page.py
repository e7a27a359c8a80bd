"""The sections of docs/experiments.md about balls and tips that are pushed into real objects, and skin between pads. Standard library only."""
from page import machine, percent, results, table


def share(value):
    return "not found" if value is None else percent(value, sign=False)


def law_name(terms):
    return "linear" if int(terms) == 0 else f"{terms} term{'s' * (int(terms) > 1)}"


def law(parameters):
    if len(parameters) == 2:
        lam, alpha = parameters
        nu = alpha / lam
        return f"E {lam * (1 + nu) * (1 - 2 * nu) / 1e3:.3g} kPa"
    return "; ".join(f"{parameters[i] / 1e3:.3g} kPa, {parameters[i + 1]:.1f}" for i in range(0, len(parameters), 3))


def quartiles(values):
    return f"{share(values[1])} ({share(values[0])} to {share(values[2])})"


def organ_probing():
    figures = results("organ-probing")
    if not figures:
        return "Not run yet.\n"
    rows, probes = [], []
    for name, s in figures["sets"].items():
        for terms, f in s["laws"].items():
            rows.append([name, f"{1e3 * s['radius']:.2f}", f"{1e3 * s['depth']:.1f}", law_name(terms) + (", least BIC" if int(terms) == s["chosen"] else ""), law(f["parameters"]), share(f["error"]), share(f["of_held_out_median"]),
                         share(f["shallow_error"]), share(f["deep_error"]), "not found" if f["deepest"] is None else percent(f["deepest"])])
        f = s["laws"][str(s["chosen"])]
        probes.append([name, s["probes"], s["rejected"], law_name(s["chosen"]), " / ".join(f"{v:.2f}" for v in f["stiffness"]), quartiles(f["plain"]), quartiles(f["mapped"]), quartiles(f["own"])])
    second = figures["second_radius"]
    return (ORGAN_WORDS.format(nu=figures["poisson_ratio"], nodes=figures["nodes"], worst=max(figures["derivative_errors"])) + "![Force over depth, medians and laws](images/organ-probing.png)\n\n" +
            "Errors are root mean squares over the greatest force of the median curve. The deeper half is predicted from a fit to the shallower one.\n\n" +
            table(["set", "ball [mm]", "depth [mm]", "law", "mu, exponent of each term", "fitted median", "median of the other probes", "shallow half, fitted alone", "deeper half, predicted from it", "the deepest force"], rows) +
            ORGAN_FAILURES + "\nProbe by probe, the held-out half (the law with the least BIC; median and quartiles of each probe's rms over its own greatest force):\n\n" +
            table(["set", "probes", "met nothing", "law", "stiffness of fitted probes against the median (quartiles)", "one law for all", "stiffness of the 4 fitted probes around", "deeper half, with the probe's own stiffness by its shallower half"], probes) +
            "\n**A second radius.** No object of these data was probed with two balls: liver with 4.00 mm, meat and phantoms with 3.16 mm. What can be shown is simulated: three terms with a Poisson's ratio of 0.40 on a finer mesh "
            f"({second['nodes']} nodes), fitted under the ball of 4 mm with {figures['poisson_ratio']} on the coarser one.\n\n" +
            table(["law", "4 mm, fitted", "2 mm, predicted", "8 mm, predicted"], [[law_name(r["terms"]), share(r["fitted"]), share(r["smaller"]), share(r["larger"])] for r in second["rows"]]) +
            f"\nMeasured on {machine(figures)}.\n")


ORGAN_WORDS = ("Shape, thickness and support of the objects are not recorded. Assumed: a block of 40 x 40 x 20 mm that its ground holds ({nodes} nodes of quadratic tetrahedra, 1.6 mm where it is touched; one with 0.8 mm gives forces within 3 %), Poisson's ratio {nu}, no friction. "
               "The ball slides and is led along the normal; each probe's first reading is taken off its forces, and probes that end below 0.1 N are left out. Fitted: the median over every second probe, at six depths. Derivatives of forces by the law, through the equilibrium, "
               "against central differences: {worst:.0e}.\n\n")


ORGAN_FAILURES = ("\nMeat and phantoms: depths that were not fitted are predicted within some per cent to a quarter, best where the law's stiffening shows in the shallow half. Liver, pressed by 3 mm, is not: its force grows faster than the laws that fit the shallow half, "
                  "and exponents of -25 to -30 (fits ended at the most iterations allowed) stand for something else, thin tissue on a hard ground most likely, for the thickness of 20 mm is assumed. BIC over six points is a weak judge.\n")


def slab_pokes():
    figures = results("slab-poke-map")
    if not figures:
        return "Not run yet.\n"
    rows = []
    for f in figures["fits"]:
        if not f["succeeded"]:
            rows.append([f["controls"], "failed: " + f["reason"]] + [""] * 5)
            continue
        moduli = f["theta"][:f["controls"]]
        rows.append([f["controls"], " / ".join(f"{E / 1e3:.3g}" for E in moduli)] +
                    [share(f["fitted"]["rms"])] + [share(f["predicted"][k]) for k in ("rms", "median_deepest", "ninety_deepest")] + [f"{f['seconds'] / 60:.0f}"])
    depths = " and ".join(f"{1e3 * d:g}" for d in figures["depths"])
    return (f"Touch is where a level force turns into a growing parabola, by least squares: {-figures['touch']:.1f} mm above the scan in the middle of the {figures['used']} pokes (of {figures['pokes']}) that go far enough to be compared; the scan is raised by that. The body is what lies between it and the table, "
            f"{1e6 * figures['volume']:.0f} cm³, {figures['nodes']} nodes of quadratic tetrahedra, held by the table. Assumed: a round tip of {1e3 * figures['tip_radius']:g} mm, no friction, Poisson's ratio {figures['poisson_ratio']}. Compared: forces {depths} mm behind the touch, "
            f"less that before it. One poke in {figures['one_in']} is fitted, with the linear law, by one modulus or by {figures['fits'][-1]['controls']} at control points (weights by inverse square distance). How force grows with depth is not fitted.\n\n" +
            "![Forces of the slab, measured and simulated](images/slab-poke-map.png)\n\n" +
            table(["moduli", "moduli [kPa]", "fitted pokes: rms", "other pokes: rms", "their deepest force: median error", "90 % below", "time [min]"], rows) + SLAB_WORDS + f"\nMeasured on {machine(figures)}.\n")


SLAB_WORDS = ("\nA field of stiffness predicts the other pokes hardly better than one modulus: the fitted pokes get better, the worst of the others too, the middle one does not. Rms over each poke's own greatest force. The elements are about as wide as twice the contact, so the moduli are effective ones of this mesh and tip; that the tip's shape is not known makes them so in any case.\n")


def skin():
    figures = results("skin-dic")
    if not figures:
        return "Not run yet.\n"
    steps = figures["steps"]
    rows = []
    for f in figures["fits"]:
        if not f["succeeded"]:
            rows.append([f["name"], law_name(f["terms"]), "failed: " + f["reason"]] + [""] * 5)
            continue
        split = figures["split"] + 1e-9

        def force_error(low, high):
            pairs = [(x, s["force"]) for x, s in zip(f["forces"], steps) if low < s["pad"] <= high]
            if not pairs or any(x is None for x, _ in pairs):
                return "no equilibrium found"
            pairs = [(-x, measured) for x, measured in pairs]
            top = max(p[1] for p in pairs)
            return share((sum((a - b)**2 for a, b in pairs) / len(pairs))**0.5 / top)

        def moved_error(low, high):
            pairs = [(r, s["moved"]) for r, s in zip(f["rms"], steps) if s["moved"] and low < s["pad"] <= high and r is not None]
            return share((sum(r * r for r, _ in pairs) / sum(m * m for _, m in pairs))**0.5) if pairs else "not found"

        last = max(s["pad"] for s in steps if s["moved"]) + 1e-9
        rows.append([f["name"], law_name(f["terms"]), f"{f['theta'][0] * figures['thickness']:.3g}", ", ".join(f"{v:.3g}" for v in f["theta"][2:]), force_error(0, split), force_error(split, last), force_error(last, 1), moved_error(0, split), moved_error(split, last)])
    return (f"Assumed: a sheet {1e3 * figures['thickness']:g} mm thick, Poisson's ratio {figures['poisson_ratio']}, pads of 8 mm around the points that are recorded, nothing under the sheet; what it joins on at its rim is not known, so both ends of that are tried. "
            f"Pads lead their nodes as measured; {figures['points']} points and the pad's force are fitted up to {1e3 * figures['split']:.1f} mm and predicted beyond. Force errors are root mean squares over the greatest force of the range, displacement errors over what points move.\n\n"
            "![Force and displacement errors over the pad's way](images/skin-dic.png)\n\n" +
            table(["fitted to", "law", "E x thickness [N/m]", "exponents, stiffness ratio", "force, first half", f"force, {1e3 * figures['split']:.1f} to 3.8 mm", "force, 5 to 8 mm", "displacement, first half", "displacement, second half"], rows) + SKIN_WORDS + f"\nMeasured on {machine(figures)}.\n")


SKIN_WORDS = ("\nThe displacements between the pads are not reproduced by an even sheet: skin near the pads strains more, and between them less, than any of these. Where the rim is held, the sheet behind the pulled pad is pressed together, and beyond 3 mm the force drops: it buckles, most likely (not looked at), and what is predicted beyond says nothing of skin, which lies on something. "
              "The stiffening beyond 7 mm is in no curve's first half and is not predicted. A misfit of the displacements as large as this leaves exponents to what the model lacks: they are no material's. The deviation of a displacement was raised from 0.05 to 0.2 mm after a first run, in which the displacements left the force no say.\n")
