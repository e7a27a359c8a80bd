"""The section of docs/experiments.md about stress-strain curves. Standard library only."""
from page import machine, percent, results, table


def share(value):
    """A relative error; those far beyond the data's size in words."""
    if value is None:
        return "none"
    return percent(value, sign=False) if value < 10 else f"{value:.0e} times"


def terms(fit):
    return sum(name.startswith("exponent_") for name in fit["parameters"])


def law(fit):
    """Young's modulus, and each term's exponent with its stiffness against the first's."""
    p = {name: value for name, (value, _) in fit["parameters"].items()}
    ratio = lambda i: f" ({p[f'stiffness_ratio_{i}']:.1g})" if i > 1 else ""
    return f"{p['youngs_modulus'] / 1e3:.3g} kPa; " + ", ".join(f"{p[f'exponent_{i}']:.2f}{ratio(i)}" for i in range(1, terms(fit) + 1))


def picture(name, words):
    return f"![{words}](images/{name}.png)\n\n"


def material_curves():
    figures = results("material-curves")
    if not figures:
        return "Not run yet.\n"
    return WORDS.format(nu=figures["poisson_ratio"]) + silicones(figures) + multiaxial(figures) + foam(figures) + f"\nMeasured on {machine(figures)}.\n"


WORDS = ("`pliant fit` of captures that are curves alone: a cube whose free faces carry no stress. One term of Ogden's law, then more where half the BIC asks for them; exponents of either sign, positive ones where all that is fitted is pulled along one axis alone. "
         "Stresses have a deviation of 1 % of each curve's greatest; errors below are root mean squares relative to that. Poisson's ratio is {nu} for all but the foam: curves of rubbers hardly show it.\n\n")


def silicones(figures):
    rows = []
    for name, s in figures["silicones"].items():
        ogden, linear, small = (s["fits"][k] for k in ("ogden", "linear", "linear, small"))
        rows.append([name.replace("_", " "), percent(s["strain"], sign=False), f"{s['greatest_stress'] / 1e6:.3g}", law(ogden), share(ogden["rms"][1]), share(linear["rms"][1]), share(small["rms"][2]),
                     f"{small['parameters']['youngs_modulus'][0] / 1e3:.3g}"])
    worst = max(s["fits"]["ogden"]["rms"][1] for s in figures["silicones"].values())
    return ("**Thirteen silicones**, in tension to the greatest stress. " + f"Fits take {figures['points']} points evenly over the strain; errors are over all points. Worst: {share(worst)}.\n\n" +
            picture("material-silicones", "Nominal stress over strain of 13 silicones, with Ogden's law and linear ones") +
            table(["silicone", "greatest strain", "greatest stress [MPa]", "Ogden: E, exponent of each term (its stiffness against the first)", "error", "linear: error over the whole curve", f"linear to {percent(figures['small'], sign=False)}: error there", "its E [kPa]"], rows) +
            "\nThe initial slope is not to be trusted: strain is the crosshead's, in steps of 2 %. A linear law over small strain is good to some per cent there and off by a multiple of ten per cent at failure.\n\n")


def other_errors(s, key):
    """(median, greatest) over the curves that the fit did not see."""
    f = s["fits"].get(key)
    if not f:
        return None
    others = sorted(e if e is not None else float("inf") for i, e in enumerate(f["rms"]) if i not in f["tests"])
    return (others[len(others) // 2], others[-1]) if others else None


def spread(pair):
    return "" if pair is None else share(pair[0]) if pair[0] == pair[1] else f"{share(pair[0])} ({share(pair[1])})"


def multiaxial(figures):
    rows, curves = [], []
    for name, s in figures["multiaxial"].items():
        one, everything = s["fits"]["one mode"], s["fits"]["all"]
        fitted = max(one["rms"][i] for i in one["tests"])
        of_all = sorted(everything["rms"])
        kinds = list(dict.fromkeys(t["kind"] for t in s["tests"]))
        rows.append([name, f"{len(s['tests'])} ({', '.join(kinds)})", s["fitted_mode"].replace("_", " "), terms(one), share(fitted), spread(other_errors(s, "one mode")),
                     spread(other_errors(s, "two modes")), terms(everything), spread((of_all[len(of_all) // 2], of_all[-1])), law(everything)])
        for i, t in enumerate(s["tests"]):
            cell = lambda key: ("" if key not in s["fits"] else ("fitted: " if i in s["fits"][key]["tests"] else "") + share(s["fits"][key]["rms"][i]))
            curves.append([name, t["name"].replace("_", " "), f"{t['range'][0]:.2f} to {t['range'][1]:.2f}", cell("one mode"), cell("two modes"), share(everything["rms"][i])])
    return ("**Several modes of loading.** Fitted to one mode, the others predicted; to that and one more (equibiaxial; shear, of brain), what is left predicted; and to all curves. The median error, and in brackets the worst curve's.\n\n" +
            picture("material-rubbers", "Rubbers: measured, fitted to all curves (lines) and to one mode (dashed)") + picture("material-brain-gel", "Brain tissue and a gel, likewise") +
            table(["set", "curves", "one mode", "terms", "its error", "predicted from one mode", "predicted from two modes", "terms of all", "error of all", "of all: E, exponents"], rows) + MULTIAXIAL_WORDS +
            "\n<details><summary>Every curve</summary>\n\n" + table(["set", "curve", "stretch or shear", "one mode", "two modes", "all"], curves) + "\n</details>\n\n")


MULTIAXIAL_WORDS = ("\nUniaxial tension alone does not determine rubbers: a term with a negative exponent that takes up the last per cent of it is read at side stretches near one, and becomes anything under two stretches. Hence exponents are positive there; "
                    "with an equibiaxial test beside, errors are some per cent. "
                    "Brain: axial tests reach 10 % and say nothing of shear after 25 % of compression. "
                    "Sheared prestretched brain is taken as the data's deformation gradients have it (stretch along the shear's direction). Katashima's biaxial curve is left out: both stretches are the same in the file while the stresses differ. The Cauchy stresses of Jones and Treloar are fitted as differences.\n").replace("The Cauchy stresses of Jones and Treloar are", "Jones' biaxial Cauchy stresses are")


def foam(figures):
    f = figures["foam"]
    rows = []
    for name, fit in f["fits"].items():
        rows.append([name, terms(fit) or "linear", f"{fit['parameters']['poissons_ratio'][0]:.3f}", f"{fit['parameters']['youngs_modulus'][0] / 1e3:.0f}"] +
                    [("" if i in fit["tests"] else "predicted: ") + share(fit["rms"][i]) for i in range(3)])
    return ("**A shoe's foam.** Compression without side strain, as the recordings' notes say; tension with free sides.\n\n" + picture("material-foam", "Foam in tension, compression and simple shear, measured and by four fits") +
            table(["fitted to", "terms", "Poisson's ratio", "E [kPa]", "tension", "compression", "shear"], rows) + FOAM_WORDS)


FOAM_WORDS = ("\nShear is not predicted by tension and compression: an isotropic foam that is as stiff as this along its axis, and has no side strain, would be much stiffer in shear. Fitted to all three, tension pays for it. "
              "A Poisson's ratio of 0.45, fixed, fails in every mode.\n")
