"""The section of docs/experiments.md about a face on its skull, a pillow and a stiffening foam under presses. Standard library only."""
import plots
from page import IMAGES, machine, percent, results, table


def face(f):
    truth, p = f["truth"], f["estimates"]
    text = (f"**A face on its skull (figure 10).** One layer of {f['elements']} linear tetrahedra (paper 8261) slides on a rigid ellipsoid and is held at the neck. {f['presses'] - 1} presses of a glued disc of 22 mm on one cheek, pushed and pulled, "
            f"are fitted in {f['seconds']:.0f} s; of one more that is not fitted the markers are predicted to {percent(f['test_press'], False)} of the greatest displacement. Truth: E = {truth['modulus']:g} Pa, nu = {truth['ratio']:g}, exponent {truth['exponent']:g}, everywhere; found: "
            + ", ".join(f"{key.replace('_', ' ')} {value:g} ± {std:g}" for key, (value, std) in p.items()) + ". "
            f"Then a cylinder of 16 mm with round ends is pressed 5 mm into the cheek and drawn 8 mm along it; a skin of {f['surface_vertices']} vertices follows by moving least squares. The true surface is {f['true_vertices']} nodes of the true law's skin, of {f['true_elements']} quadratic tetrahedra.\n\n")
    names = {"found": "fitted", "own": "the true law on the fit's elements"}
    text += table(["model", "cylinder", "surface off, rms [mm] (of the greatest motion)", "greatest [mm]", "greatest motion [mm]", "force [N] (truth)"],
                  [[names[r["model"]], r["what"], f"{1e3 * r['rms']:.2f} ({percent(r['rms'] / r['moved'], False)})", f"{1e3 * r['max']:.2f}", f"{1e3 * r['moved']:.1f}", f"{r['force']:.3g} ({r['true_force']:.3g})"] for r in f["cylinder"]])
    return text + (f"\n![The face at rest, and pressed by a cylinder: predicted, and true](images/pressed-face.png)\n\nAt rest; predicted and true under the cylinder that was drawn along, in colours by how far the skin moved. An equilibrium takes {f['milliseconds']:g} ms (median) on this busy machine; the paper's "
                   "face is deformed interactively. The paper gives no error of its face. Most of the error is the elements': linear ones, one through a layer that hardly changes its volume and as long as the probe's radius, are too stiff under it, which a softer law makes up for in the markers alone.\n\n")


def pillow(f):
    truth = f["truth"]
    text = (f"**A pillow with a hard part (figures 1, 3 and 9).** A curved closed body of Ogden's foam, E = {truth['modulus']:g} Pa with a ball of {truth['hard']:g} Pa in it that nobody tells the fit about; {f['presses']} presses of a disc of 16 mm radius that is glued on, "
            "half of them pulls; then one of 24 mm radius, elsewhere, pushes and pulls. The truth's elements are quadratic and smaller, its law is of the family that the fit knows. Errors are of the whole surface's vertices that truly moved by more than a tenth of the most.\n\n")
    rows = []
    for name, fit in f["fits"].items():
        for r in fit["predicted"]:
            rows.append([name, fit["elements"], f"{fit['seconds']:.0f}", f"{fit['zones']['soft']:.3g} / {fit['zones']['hard']:.3g}", f"{1e3 * fit['marker_rms']:.2f}", f"{1e3 * r['depth']:+g}",
                         f"{1e3 * r['rms']:.2f} ({percent(r['rms'] / r['moved'], False)})", f"{1e3 * r['max']:.2f}", f"{r['force']:.3g} ({r['true_force']:.3g})"])
    text += table(["choices", "elements (paper 1691)", "time [s]", "E in the soft / hard part [Pa]", "markers fitted, rms [mm]", "other probe [mm], + pushed", "surface off, rms [mm] (of the greatest motion)", "greatest [mm]", "force [N] (truth)"], rows)
    return text + "\n![The pillow under the other probe, pushed and pulled, in the colours of the modulus that was found](images/pressed-pillow.png)\n\nPushed and pulled by the other probe; colours are the modulus that was found, from 5 (dark) to 20 kPa (light).\n\n"


def curve_plot(f):
    curves = {"truth": f["curve"], **f["curves"]}
    most_x = 1e3 * max(r["depth"] for rows in curves.values() for r in rows)
    most_y = 1.15 * max(r["force"] for name in ("truth", "ogden") for r in curves[name])
    panel = plots.EvenPanel(70, 20, 460, 300, most_x, most_y)
    panel.axes("displacement of the disc [mm]", "force [N]")
    for number, (name, label) in enumerate((("truth", "true law"), ("ogden", "Ogden, fitted"), ("linear", "linear, fitted"))):
        points = [(1e3 * r["depth"], r["force"]) for r in curves[name] if r["force"] <= most_y]
        path = " ".join(f"{panel.x(x):.1f},{panel.y(y):.1f}" for x, y in [(0.0, 0.0), *points])
        if name != "truth":
            panel.parts.append(f'<polyline points="{path}" fill="none" stroke="{plots.COLOURS[number]}" stroke-width="2"/>')
        else:
            for x, y in points:
                panel.mark(x, y, plots.COLOURS[number])
        panel.key(number, plots.COLOURS[number], label)
    x = panel.x(1e3 * f["deepest_fitted"])
    panel.parts.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="20" y2="320" stroke="#999" stroke-dasharray="3 3"/><text x="{x + 4:.1f}" y="34">deepest press fitted</text>')
    plots.write(IMAGES / "pressed-foam.svg", 560, 375, panel.parts)


def foam(f):
    curve_plot(f)

    def at(name, depth):
        """Between the two equilibria about a depth."""
        rows = [{"depth": 0.0, "force": 0.0, "least_volume_ratio": 1.0}, *f["curves"][name]]
        after = next((r for r in rows[1:] if r["depth"] >= depth - 1e-9), rows[-1])
        before = rows[rows.index(after) - 1]
        share = min(1.0, (depth - before["depth"]) / (after["depth"] - before["depth"]))
        return {key: before[key] + share * (after[key] - before[key]) for key in after}

    linear = f["curves"]["linear"]
    turned = next((r for r in linear if r["least_volume_ratio"] <= 0.0), None)
    last = linear[-1]
    text = (f"**A foam that stiffens (figure 8).** A block of 200 x 100 x 200 mm, Ogden's law of two terms, {f['presses']} presses (paper 12) by a disc of 60 mm down to {1e3 * f['deepest_fitted']:g} mm, {f['fits']['ogden']['elements']} tetrahedra (paper 3240). "
            "The fits are told that the foam is even (`law_zones=1`, `control_points=1`). At a place between those of the fit the disc goes on to half the block's height.\n\n![Force over displacement](images/pressed-foam.svg)\n\n")
    rows = []
    for r in f["curve"]:
        o, l = at("ogden", r["depth"]), at("linear", r["depth"])
        reached = l["depth"] > r["depth"] - 1e-3
        rows.append([f"{1e3 * r['depth']:g}", f"{r['force']:.3g}", f"{o['force']:.3g} ({percent(o['force'] / r['force'] - 1)})", f"{l['force']:.3g} ({percent(l['force'] / r['force'] - 1)})" if reached else "no equilibrium",
                     f"{o['least_volume_ratio']:.2f}", f"{l['least_volume_ratio']:.2f}" if reached else ""])
    text += table(["displacement [mm]", "force, truth [N]", "Ogden (off by)", "linear (off by)", "least det F, Ogden", "least det F, linear"], rows)
    if turned:
        text += f"\nThe linear law turns its first element over at {1e3 * turned['depth']:.3g} mm and {turned['force']:.3g} N, as the paper's does under large forces; "
    else:
        text += f"\nThe linear law turns no element over on this way (least det F {last['least_volume_ratio']:.2f}); "
    text += ("it goes on to the end of the way. " if f["fits"]["linear"]["complete"] else f"it finds no equilibrium beyond {1e3 * last['depth']:.3g} mm. ")
    text += (f"Ogden's keeps every element to the end (least det F {min(r['least_volume_ratio'] for r in f['curves']['ogden']):.2f}). Markers are fitted to {1e3 * f['fits']['ogden']['marker_rms']:.2f} mm rms by Ogden's law, {1e3 * f['fits']['linear']['marker_rms']:.2f} mm by the linear one. ")
    text += ("Small presses meet forces that are too high on these coarse linear elements, an edge of which is about as long as the disc's radius; and the fitted law stiffens less than the true one beyond what it was fitted to: "
             "it is nearer than the linear law there, and not near.\n\n")
    return text


def pressed_bodies():
    figures = results("pressed-bodies")
    if not figures:
        return "Not run yet.\n"
    text = "".join(part(figures[name]) for name, part in (("face", face), ("pillow", pillow), ("foam", foam)) if name in figures)
    fits = {f"{name}, {key}": fit for name in ("pillow", "foam") if name in figures for key, fit in figures[name]["fits"].items()}
    stopped = [name for name, fit in {**fits, **({"face": figures["face"]} if "face" in figures else {})}.items() if fit.get("was_stopped")]
    stopped = f" ({'; '.join(stopped)})" if stopped else " (none was)"
    return text + f"The same program made all three recordings, on other meshes: inverse crimes but for that. Choices are the program's own but for `cells` of face and foam, which give about the paper's numbers of elements, and where a row says otherwise; a fit that takes longer than 20 minutes on the shared machine is stopped with the best that it has{stopped}.\n\nMeasured on {machine(figures)}.\n"
