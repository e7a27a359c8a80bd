"""The section of docs/experiments.md about simulated presses with known force. Standard library only."""
import plots
from page import IMAGES, judged, machine, results, table

MATERIALS = {"ogden": "Ogden", "sampled": "sampled", "linear": "linear"}
LAWS = {"ogden": "**The truth: Ogden's law**, two terms in each layer. The truth lies in the family of laws that the fit of zones looks through: an inverse crime.",
        "fung": "**The truth: Fung's exponential law**, which is in none of the fitted families."}
NOISE = {"00": (0.003, 0.003), "10": (0.015, 0.021), "20": (0.025, 0.031), "30": (0.035, 0.044)}  # target; Bickel 2009, section 6, of their sampled material
TARGET = 0.08  # of test presses against measured markers


def share(value, digits=1):
    return "" if value is None else f"{100 * value:.{digits}f} %"


def pair(entry, end=""):
    return f"{share(entry['fit' + end], 2)} / {share(entry['test' + end], 2)}" if entry else ""


def over_all(entry):
    """Mean error over all presses."""
    sums = [entry[role] * entry[f"{role}_presses"] for role in ("fit", "test") if entry[role] is not None]
    return sum(sums) / (entry["fit_presses"] + entry["test_presses"]) if sums else None


def runs(name):
    return f"    python3 experiments/{name}/run.py OUT\n\n"


def presses():
    return ("### A virtual block of three layers\n\n" + runs("virtual-block") + virtual_block() + basis_growth() + strain_samples() +
            "\n### Another simulator's foam block\n\n" + runs("oracle-press") + oracle_press())


def virtual_block():
    figures = results("virtual-block")
    if not figures or not figures.get("seeds"):
        return "Not run yet.\n"
    first = next(iter(figures["seeds"].values()))
    return BLOCK_WORDS + "".join(one_law(law, words, first[law]) for law, words in LAWS.items() if law in first) + sampled_rows(figures["seeds"]) + f"Measured on {machine(figures)}.\n"


def sampled_rows(seeds):
    """Every fit of the sampled material beside the paper's figure."""
    rows = []
    for law in LAWS:
        for noise, (_, paper) in NOISE.items():
            for seed, laws in seeds.items():
                entry = laws.get(law, {}).get(noise, {}).get("sampled")
                if not entry:
                    continue
                verdicts = [judged(entry[role] is not None and entry[role] <= paper and not entry["no_equilibrium"]) for role in ("fit", "test")]
                rows.append([law, f"{int(noise)} %", seed, share(entry["fit"], 2), share(entry["fit_max"], 1), share(entry["test"], 2), share(entry["test_max"], 1),
                             str(entry["no_equilibrium"]), share(paper), verdicts[0], verdicts[1], f"{entry['seconds']:.0f}"])
    if not rows:
        return ""
    return SAMPLED_WORDS + table(["truth", "noise", "seed", "fitted presses", "worst", "test presses", "worst", "without equilibrium", "Bickel et al.", "fitted", "test", "time [s]"], rows) + "\n"


BLOCK_WORDS = ("After Bickel et al. 2009, section 6: a block of three layers of unlike non-linear materials, held below and pressed by a glued disc with a known force; the test presses are made by a wider disc. Truth and fit have the same mesh. "
               "The noise is a share of each marker's own displacement. Ogden's law is fitted by zones, each with a law of its own; zones are found by the fit, not told. "
               "Errors are against markers without noise: root mean squares over the greatest displacement of each press, averaged over presses. "
               "The target is for the mean of Ogden's fit over all presses, fitted and test.\n\n"
               "What limits the fits: a zone is kept only where it takes three per cent off the squares of the residuals, too, and under much noise that turns away zones for which the evidence is strong (the fits' notes, in results.json). "
               "The figures of Ogden's law and of the linear one are of a program that knew one deviation for all markers of a press; pliant now estimates how noise grows with displacement, and these two have not been made anew. The tables of each truth are of the first seed.\n\n")

SAMPLED_WORDS = ("#### The sampled material, and the paper's\n\n"
                 "Every element has a law of its own, of the form that all presses share (Ogden's, of one or two terms, as the evidence says), and on top of it stresses that are interpolated between samples of its strain. No layer and no zone is told or looked for. "
                 "Bickel et al. give one error for each level of noise, of their sampled material on a block of theirs, for the deformations that were fitted; here the test presses, which no fit sees, are judged by the same figure.\n\n")


def one_law(law, words, levels):
    rows, worst, zones, missing = [], [], [], []
    for noise, (target, _) in NOISE.items():
        fits = levels.get(noise)
        if not fits:
            continue
        percent = f"{int(noise)} %"
        ogden = fits.get("ogden")
        mean = over_all(ogden) if ogden else None
        verdict = judged(mean is not None and mean <= target and not ogden["no_equilibrium"]) if ogden else ""
        rows.append([percent, *(pair(fits.get(m)) for m in MATERIALS), share(mean, 2), share(target), verdict,
                     " / ".join(f"{fits[m]['seconds']:.0f}" if m in fits else "" for m in MATERIALS)])
        worst.append([percent, *(pair(fits.get(m), "_max") for m in MATERIALS)])
        if ogden:
            zones.append(f"- noise {percent}: " + ("; ".join(n.removeprefix("Zones: ").rstrip(".") for n in ogden["zones"]) or "one law for the whole block"))
        for m, name in MATERIALS.items():
            if m in fits and fits[m]["no_equilibrium"]:
                missing.append(f"noise {percent}, {name}: {fits[m]['no_equilibrium']} presses have no equilibrium and are in no mean")
            if m in fits and not fits[m]["converged"]:
                missing.append(f"noise {percent}, {name}: the fit did not converge")
    entries = [entry for fits in levels.values() for entry in fits.values()]
    text = (words + f" {max(e['fit_presses'] for e in entries)} presses are fitted, {max(e['test_presses'] for e in entries)} are test presses.\n\n" +
            table(["noise", "Ogden, zones: fit / test", "sampled: fit / test", "linear: fit / test", "Ogden, all presses", "target", "", "time [s], Ogden / sampled / linear"], rows))
    if missing:
        text += "\n" + "; ".join(missing) + ".\n"
    if zones:
        text += "\nZones that the fits of Ogden's law found (the layers meet at 33 and 67 mm of the block's height, y):\n\n" + "\n".join(zones) + "\n"
    return text + "\n<details><summary>The worst press of each fit</summary>\n\n" + table(["noise", *(f"{name}: fit / test" for name in MATERIALS.values())], worst) + "\n</details>\n\n"


def basis_growth():
    """Error of stress of the sampled material by its samples an element, where results hold it."""
    figures = results("virtual-block") or {}
    found = [(law, int(noise), fits["sampled"]["error_by_size"]) for law, levels in next(iter(figures.get("seeds", {}).values()), {}).items() for noise, fits in levels.items()
             if fits.get("sampled", {}).get("error_by_size")]
    if not found:
        return ""
    most = max(len(errors) for _, _, errors in found)
    panel = plots.EvenPanel(70, 20, 540, 260, most + 0.5, 108 * max(max(errors) for _, _, errors in found))
    panel.axes("samples an element, at the most", "error of stress [%]")
    for (law, noise, errors), colour in zip(found, plots.COLOURS):
        for size, error in enumerate(errors):
            panel.mark(size, 100 * error, colour)
    plots.write(IMAGES / "basis-growth.svg", 640, 330, panel.parts)
    return ("\nThe basis of the sampled material while it grows (Bickel 2009, section 4.2): the error of stress over all elements and presses, root mean square, relative to the greatest stress of the element. "
            "Without samples it is that of the elements' own laws; each sample that joins is the one that was worst.\n\n![Error of stress by the number of samples](images/basis-growth.svg)\n\n" +
            table(["truth, noise", *map(str, range(most))],
                  [[f"{law}, {noise} %", *(share(e) for e in errors), *[""] * (most - len(errors))] for law, noise, errors in found]))


def strain_samples():
    """Eq. 8 as printed against the sampled law, one element."""
    figures = results("strain-samples")
    if not figures:
        return ""
    methods = {"printed": "eq. 8 as printed", "own": "the element's own law alone", "sampled": "sampled"}
    sizes = ["0.1", "0.2", "0.25", "0.3", "0.35"]
    rows = [[law, f"{100 * float(noise):.0f} %", name, *(f"{100 * of[method][z]:.1f} %" for z in sizes), f"{100 * of[method]['work']:.2g} %"]
            for law, levels in figures["errors"].items() for noise, of in levels.items() for method, name in methods.items()]
    return ("\n#### Stress between samples and beyond them\n\n    python3 experiments/strain-samples/run.py\n\n" + STRAIN_WORDS +
            table(["truth", "samples' error", "law", *(f"strain {z}" for z in sizes), "work of closed paths"], rows))


STRAIN_WORDS = ("One element of the block's middle layer, without a block: 48 samples of its strain, compressions with shear of up to 0.25, whose stresses err by a factor each. "
                "Eq. 8 as printed interpolates (lambda, alpha) through all samples, and stress is E(p(e)) e: that has no energy, so closed paths of strain give or take work. "
                "Errors are of stress at other strains, root mean squares relative to the true ones; strains of 0.3 and 0.35 lie beyond the samples. "
                "Where the truth has the form of the element's law, eq. 8 loses everywhere, most of all beyond the samples. Fung's stress is a linear law's times a factor, which is what eq. 8 interpolates: there it is the closer one, and what it has in closed paths is its price.\n\n")


def oracle_press():
    figures = results("oracle-press")
    fits = {m: figures[m] for m in MATERIALS if m in figures} if figures else {}
    if not fits:
        return "Not run yet.\n"
    some = next(iter(fits.values()))["true"]["presses"]
    count = {role: sum(p[0] == role for p in some) for role in ("fit", "test")}
    rows = [[MATERIALS[m], pair(f["measured"]), pair(f["true"]), judged(f["measured"]["test"] is not None and f["measured"]["test"] <= TARGET and all(p[3] is not None for p in f["measured"]["presses"])),
             f"{f['seconds']:.0f}"] for m, f in fits.items()]
    if "truth" in figures:
        rows.append(["the other simulator itself", pair(figures["truth"]["measured"]), "", "", ""])
    text = ORACLE_WORDS.format(**count) + table(
        ["material", "measured markers: fit / test", "the other simulator's markers: fit / test", f"target {100 * TARGET:.0f} % (measured, test)", "time [s]"], rows) + "\n"
    if "truth" in figures:
        text += "The last row is what noise alone makes: the true displacements against the measured markers. "
    text += "The other simulator's markers include those that the disc hides and those that were lost, which nobody measured.\n\n"
    for m, f in fits.items():
        if f["settings"]:
            text += f"{MATERIALS[m]}: fitted with {', '.join(f['settings'])}.\n\n"
        if not f.get("converged", True):
            text += f"{MATERIALS[m]}: the fit did not converge.\n\n"
        lost = sum(p[3] is None for p in f["true"]["presses"])
        if lost:
            text += f"{MATERIALS[m]}: {lost} presses have no equilibrium and are in no mean.\n\n"
    write_plot(fits)
    text += "![Markers' rms error over the greatest displacement of each press](images/oracle-press.svg)\n\n" + by_press(fits)
    return text + (f"\nMeasured on {machine(figures)}.\n" if "machine" in figures else "")


ORACLE_WORDS = ("A stiffening foam block, held below, made by another simulator with another material law and other elements; {fit} presses to fit, {test} test presses by a wider disc. "
                "Measured markers have noise of 0.5 mm a coordinate. Errors are root mean squares over the greatest displacement of each press, averaged over presses. "
                "Fitted with no choice of ours but the material, where none is told below; the other simulator's markers are read for judging only.\n\n")


def by_press(fits):
    """The test presses by greatest displacement, against the true markers."""
    rows, ratios = [], []
    tests = [i for i, p in enumerate(next(iter(fits.values()))["true"]["presses"]) if p[0] == "test"]
    presses = lambda i: {m: f["true"]["presses"][i] for m, f in fits.items()}
    moved = lambda i: next(iter(presses(i).values()))[1]
    for i in sorted(tests, key=moved):
        errors = {m: p[3] for m, p in presses(i).items()}
        ratio = errors["linear"] / errors["ogden"] if errors.get("linear") and errors.get("ogden") else None
        ratios.append(ratio)
        rows.append([f"{1e3 * moved(i):.1f}", *("no equilibrium" if e is None else share(e) for e in errors.values()), "" if ratio is None else f"{ratio:.1f}"])
    text = "The test presses, against the other simulator's markers:\n\n" + table(["greatest displacement [mm]", *(MATERIALS[m] for m in fits), "linear over Ogden"], rows)
    greatest = ratios[-2:]
    if len(greatest) == 2 and None not in greatest:
        text += f"\nOf the two that go farthest, the linear law's error is {greatest[0]:.1f} and {greatest[1]:.1f} times that of Ogden's.\n"
    return text


def write_plot(fits):
    """Rms of the markers against the true ones over the greatest displacement of each press [mm]."""
    points = [(m, role == "test", 1e3 * moved, 1e3 * rms) for m, f in fits.items() for role, moved, rms, _ in f["true"]["presses"] if rms is not None]
    panel = plots.EvenPanel(70, 20, 540, 300, 1.08 * max(p[2] for p in points), 1.08 * max(p[3] for p in points))
    panel.axes("greatest displacement of a press [mm]; open: fitted, filled: test", "markers' rms error [mm]")
    colours = dict(zip(MATERIALS, plots.COLOURS))
    for m, is_test, x, y in points:
        panel.mark(x, y, colours[m], filled=is_test)
    for number, m in enumerate(fits):
        panel.key(number, colours[m], MATERIALS[m])
    plots.write(IMAGES / "oracle-press.svg", 640, 370, panel.parts)
