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
    return ("### A virtual block of three layers\n\n" + runs("virtual-block") + virtual_block() + basis_growth() +
            "\n### Another simulator's foam block\n\n" + runs("oracle-press") + oracle_press())


def virtual_block():
    figures = results("virtual-block")
    if not figures or "laws" not in figures:
        return "Not run yet.\n"
    return BLOCK_WORDS + "".join(one_law(law, words, figures["laws"][law]) for law, words in LAWS.items() if law in figures["laws"]) + f"Measured on {machine(figures)}.\n"


BLOCK_WORDS = ("After Bickel et al. 2009, section 6: a block of three layers of unlike non-linear materials, held below and pressed by a glued disc with a known force; the test presses are made by a wider disc. Truth and fit have the same mesh. "
               "The noise is a share of each marker's own displacement. Ogden's law is fitted by zones, each with a law of its own; zones are found by the fit, not told. "
               "Errors are against markers without noise: root mean squares over the greatest displacement of each press, averaged over presses. "
               "The target is for the mean of Ogden's fit over all presses, fitted and test.\n\n"
               "What limits the fits: a zone is kept only where it takes three per cent off the squares of the residuals, too, and under much noise that turns away zones for which the evidence is strong (the fits' notes, in results.json). "
               "The figures of all three materials are of a program that knew one deviation for all markers of a press; with it the sampled material followed noise that grows with displacement, and many presses then found no equilibrium, so it was fitted to markers without noise alone. pliant now estimates how noise grows, and takes samples in rounds (`pliant fit --set material=sampled`): these rows have not been made anew. "
               f"Bickel et al. give, for their sampled material on a block of theirs, {', '.join(f'{100 * paper:.1f} % at {int(noise)} %' for noise, (_, paper) in NOISE.items())} noise; that method is run here without noise alone.\n\n")


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
    found = [(law, int(noise), fits["sampled"]["error_by_size"]) for law, levels in figures.get("laws", {}).items() for noise, fits in levels.items()
             if fits.get("sampled", {}).get("error_by_size")]
    if not found:
        return ""
    most = max(len(errors) for _, _, errors in found)
    panel = plots.EvenPanel(70, 20, 540, 260, most + 0.5, 108 * max(max(errors) for _, _, errors in found))
    panel.axes("samples an element, at the most", "error of stress [%]")
    for (law, noise, errors), colour in zip(found, plots.COLOURS):
        for size, error in enumerate(errors, 1):
            panel.mark(size, 100 * error, colour)
    plots.write(IMAGES / "basis-growth.svg", 640, 330, panel.parts)
    return ("\nThe basis of the sampled material while it grows (Bickel 2009, section 4.2): the error of the stress E(p(e)) e over all elements and presses, root mean square, relative to the greatest stress of the element. "
            "Zero strain is the first sample; the second, the one that was worst, takes most off.\n\n![Error of stress by the number of samples](images/basis-growth.svg)\n\n" +
            table(["truth, noise", *map(str, range(1, most + 1))],
                  [[f"{law}, {noise} %", *(share(e) for e in errors), *[""] * (most - len(errors))] for law, noise, errors in found]))


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
