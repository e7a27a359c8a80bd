"""The sections of docs/experiments.md about objects that are scanned as they sag. Standard library only."""
import math

from page import IMAGES, from_landscape, judged, machine, percent, results, table, tiny, with_truth


def found_or_why(row):
    if row["found"]:
        return "yes"
    return "no: " + row["reason"].removeprefix("this material carries ")


SCHEME_NAMES = {"pseudo_transient": "steps of pseudo-time (default)", "newton": "Newton's method from the scan", "virtual_force": "virtual forces (the paper's)"}


def reference_object(r):
    return [r["choices"]["object"], f"{float(r['choices']['youngs_modulus']):g}", f"{r['nodes']}", percent(r["sag"], sign=False)]


def scheme_name(r, row):
    name = SCHEME_NAMES[row["scheme"]]
    if row["scheme"] == "virtual_force":
        name += f", steps of {r['choices']['virtual_step']} s, damping {r['choices']['virtual_damping']} / s"
    return name


def reference_shapes():
    figures = results("reference-shapes")
    if not figures:
        return "Not run yet.\n"
    images = [f"![{name}: free of load and sagged, in grey; the scan as dots](images/reference-shapes-{name}.png)"
              for name in dict.fromkeys(r["choices"]["object"] for r in figures["recovered"])]
    rows = [reference_object(r) + [tiny(row.get("static_error")), tiny(row.get("known_error")), tiny(row["residual"]), row["iterations"],
                                   f"{row['seconds']:.1f}", f"{row['re_sag_seconds']:.1f}" if "re_sag_seconds" in row else found_or_why(row)]
            for r in figures["recovered"] for row in r["schemes"]]
    text = "\n\n".join(images) + ("\n\nGrey: the shape that was found, and what it sags into; dots: the scan. Quadratic tetrahedra, Poisson's ratio 0.4, 1000 kg/m^3. Distances are the greatest of any node, "
                                  "over the object's longest edge; residuals relative to the load; times are processor time of one thread. On the scan's own mesh, of which the known shape's nodes, mass, material and "
                                  "elements are given, the problem is the exact inverse of the one that made the scan (an inverse crime): it shows that the solver finds what is there, not how well a real object's shape is known.\n\n")
    text += table(["object", "E [Pa]", "nodes", "sag", "re-sagged against scan", "found against known shape", "residual", "iterations", "time [s]", "time to sag again [s]"], rows)
    found = [row for r in figures["recovered"] for row in r["schemes"] if row["found"]]
    total = sum(len(r["schemes"]) for r in figures["recovered"])
    if found:
        worst = lambda key: max(row.get(key, math.inf) for row in found)
        text += "\n" + table(["target", "here", ""], [
            ["static shape reproduced to 1e-6", tiny(worst("static_error")), judged(worst("static_error") <= 1e-6)],
            ["known shape recovered to 1e-3", tiny(worst("known_error")), judged(worst("known_error") <= 1e-3)],
            ["at most 60 s", f"{worst('seconds'):.1f} s on one thread", judged(worst("seconds") <= 60.0)],
            ["a shape is found for each", f"{len(found)} of {total}", judged(len(found) == total)]])
    same = lambda a, b: all(a["choices"][key] == b["choices"][key] for key in ("object", "youngs_modulus", "cell_size"))
    compared = [(r, row) for rivals in figures["schemes"] for r in [*(r for r in figures["recovered"] if same(r, rivals)), rivals] for row in r["schemes"]]
    limit = figures["schemes"][0]["choices"]["max_iterations"]
    text += f"\n**Schemes.** The smallest mesh of each object; the rivals are stopped after {limit} iterations, or at a residual of {float(figures['schemes'][0]['choices']['tolerance']):g}.\n\n"
    text += table(["object", "E [Pa]", "nodes", "sag", "scheme", "found", "residual", "found against known shape", "iterations", "time [s]"],
                  [reference_object(r) + [scheme_name(r, row), found_or_why(row), tiny(row["residual"]), tiny(row.get("known_error")), row["iterations"], f"{row['seconds']:.1f}"]
                   for r, row in compared])
    text += ("\nThe paper's table 2 reports mean differences of 8.9e-5 (plant), 2.6e-4 (beam) and 1.7e-3 (phone holder) of the load-free shapes from those of another solver, 6.4e-5, 2.2e-5 and 2.3e-9 of the static ones, and 9 to 22 s; "
             "its meshes, its sizes and its rule for stopping are not given, so the figures stand side by side only.\n")
    text += "\n**On another mesh.** Of the known shape only the surface of its scan is taken, meshed anew with other tetrahedra, and its mass. What is reproduced is still the scan; how well the shape is known depends on the meshes, of which each has its own stiffness. Vertices of the load-free surface that was found, against where they belong, and their distance from the known surface, read from a grid of 0.4 % of the size, which near sharp edges is worth no better than 2e-3.\n\n"
    text += table(["object", "E [Pa]", "nodes of the scan's mesh (known shape's)", "sag", "vertices: rms", "greatest", "surface: rms", "greatest", "scan taken for load-free: rms", "re-sagged against scan", "time [s]"],
                  [[r["choices"]["object"], f"{float(r['choices']['youngs_modulus']):g}", f"{r['nodes']} ({r['known_nodes']})", percent(r["sag"], sign=False)] +
                   ([tiny(row["vertices"]["rms"]), tiny(row["vertices"]["greatest"]), tiny(row["surface"]["rms"]), tiny(row["surface"]["greatest"]), tiny(row["scan_taken_for_load_free"]["rms"]), tiny(row.get("static_error"))]
                    if row["found"] else [found_or_why(row), "", "", "", "", ""]) + [f"{row['seconds']:.1f}"]
                   for r in figures["remeshed"] for row in r["schemes"]])
    text += f"\n**Too soft.** The scans that sag most, asked for with a modulus {float(figures['refused'][0]['choices']['softer']):g} times too small. What is named as the smallest modulus that carries the load is tried, and 5 % less.\n\n"
    text += table(["object", "nodes", "E asked for [Pa]", "refused in [s]", "iterations", "smallest E named [Pa]", "found at 0.95 / 1 of it"],
                  [[r["choices"]["object"], r["nodes"], f"{float(r['choices']['youngs_modulus']) / float(r['choices']['softer']):.3g}", f"{row['seconds']:.1f}", row["iterations"],
                    *([f"{row['least_youngs_modulus']['named']:.3g}", " / ".join("yes" if n["found"] else "no" for n in row["least_youngs_modulus"]["near"])] if "least_youngs_modulus" in row else ["", found_or_why(row)])]
                   for r in figures["refused"] for row in r["schemes"]])
    return text + f"\nMeasured on {machine(figures)}.\n"


def sagging_leaf():
    figures = results("oracle-sag")
    if not figures:
        return "Not run yet.\n"
    names = {"together": "together (default)", "in-turns": "in turns", "scan-load-free": "scan taken for load-free; linear tetrahedra, half as many steps, one start"}
    fits = figures["fits"]
    how_it_ended = lambda f: "yes" if f["converged"] else "no, interrupted" if f["exit_code"] == 130 else "no"
    # Of fits that were stopped, or paused for others, wall time says nothing.
    time_of = lambda f: f"{f['wall_seconds']:.0f}" if f["wall_seconds"] else f"{f['processor_seconds']:.0f} of one processor" if f.get("processor_seconds") else "in several runs, not counted"
    any_fit = next(iter(fits.values()))
    text = (f"The leaf is {1e3 * any_fit['size']:.0f} mm long and sags by up to {1e3 * any_fit['true_sag_greatest']:.0f} mm, {1e3 * any_fit['true_sag_rms']:.0f} mm rms. Vertices of the load-free surface "
            "are compared with the true ones, one by one, over the leaf's length; so is what the model's own sag under gravity, from its load-free shape, over the true sag.\n\n")
    rows = []
    for name, f in fits.items():
        p = f["parameters"]
        E = p["youngs_modulus"]
        rows.append([names.get(name, name), f["commit"][:7], with_truth(E, 1e-6), percent(E["value"] / E["truth"] - 1), with_truth(p["poisson_ratio"]), with_truth(p["mass_damping"]),
                     with_truth(p["stiffness_damping"], 1e3), f"{percent(f['load_free_rms'], False)} / {percent(f['load_free_greatest'], False)}", percent(f["sag_error"], False),
                     percent(f["static_rms"], False), f"{1e3 * f['surface_rms']:.2f}", time_of(f), how_it_ended(f)])
    text += table(["shape and material", "program", "E [MPa] (truth)", "error", "nu (truth)", "mass damping [1/s] (truth)", "stiffness damping [ms] (truth)", "load-free shape off, rms / greatest",
                   "sag off", "static shape off, rms of the length", "surface rms [mm]", "time [s]", "converged"], rows)
    missing = [name for key, name in names.items() if key not in fits]
    if missing:
        text += f"\nNot run: {'; '.join(missing)}.\n"
    if "scan-load-free" in fits:
        text += ("\nThe fit that takes the scan for load-free differs from the first in elements, steps and starts, too" +
                 (", and was interrupted: its figures are those of its best point so far" if fits["scan-load-free"]["exit_code"] == 130 else "") + ". It shows where such a fit leads, not what the shape alone changes.\n")
    f = fits.get("together")
    if f:
        E = f["parameters"]["youngs_modulus"]
        text += "\n" + table(["target", "here", ""], [
            ["load-free shape to 1 % of the size", f"{percent(f['load_free_greatest'], False)} at most", judged(f["load_free_greatest"] <= 0.01)],
            ["Young's modulus within 15 %", percent(E["value"] / E["truth"] - 1), judged(abs(E["value"] / E["truth"] - 1) <= 0.15)],
            ["the model's sag within 5 %", percent(f["sag_error"], False), judged(f["sag_error"] <= 0.05)]])
    return text + f"\nMeasured on {machine(figures)}.\n"


def by_modes(run):
    """Of the starts of the bar that sags, those that its vibrations' frequencies lead to."""
    return "" if run["start"] in ([2.0, 0.5], [3.0, 3.0]) else ", by its modes"


def two_zones():
    figures = results("two-zone-sag")
    if not figures:
        return "Not run yet.\n"
    c = figures["compared"]
    names = {"together": "together (default)", "in turns": "in turns", "scan taken for load-free": "scan taken for load-free",
             "simplex, shape before each evaluation": "Wang 2015: downhill simplex, shape before each evaluation"}
    text = (f"The bar is {1e3 * c['length']:.0f} mm long, {1e-6 * c['truth'][0]:g} MPa in its held half and {1e-6 * c['truth'][1]:g} MPa in the other, and sags by up to {1e3 * c['sag']:.0f} mm. Twenty points are followed over 0.75 s with "
            f"{1e3 * c['noise']:g} mm of noise. Fitted with {c['elements']} quadratic tetrahedra whose edges are straight in the scan; the same program made the recording with twice as many elements each way: the material law is the same, an inverse crime in that.\n\n")
    text += table(["start, times the truth", "shape and moduli", "error of the held half's modulus", "of the free half's", "load-free shape off [of the length]", "cost", "evaluations", "time [s]", "why it ended"],
                  [[f"{r['start'][0]:.3g}, {r['start'][1]:.3g}{by_modes(r)}", names[r["scheme"]], *([percent(e) if abs(e) < 10.0 else f"{1.0 + e:.0f} times too stiff" for e in r["errors"]] if r["succeeded"] else ["", ""]),
                    percent(r["shape_error"], False) if "shape_error" in r else "", f"{r['cost']:.0f}" if r["succeeded"] else "", r["evaluations"], f"{r['seconds']:.0f}", r["reason"]]
                   for r in c["runs"]])
    together, turns = ([r for r in c["runs"] if r["scheme"] == name and not by_modes(r)] for name in ("together", "in turns"))
    worst = max(abs(e) for r in together for e in r["errors"])
    text += "\n" + table(["target", "here", ""], [["both moduli within 2 %", f"{percent(worst, False)} at worst, together", judged(worst <= 0.02)]])
    text += (f"\nIn turns takes {sum(r['evaluations'] for r in turns) / sum(r['evaluations'] for r in together):.1f} times the evaluations and {sum(r['seconds'] for r in turns) / sum(r['seconds'] for r in together):.1f} times the time: "
             "with the shape held, the derivatives do not see that a softer bar has to be free of load higher up, and it ends at the most iterations allowed. Derivatives through the equilibrium are the default.\n")
    own = {r["scheme"]: r for r in c["runs"] if by_modes(r)}
    if "together" in own and len(own) > 1:
        simplex = next(r for name, r in own.items() if name != "together")
        text += (f"\nThe paper's own algorithm finds the shape before each evaluation of its simplex and begins where the vibrations' frequencies lead: {simplex['evaluations']} evaluations and {simplex['seconds']:.0f} s to "
                 f"{percent(max(map(abs, simplex['errors'])), False)} at worst, where derivatives from the same start take {own['together']['evaluations']} and {own['together']['seconds']:.0f} s to {percent(max(map(abs, own['together']['errors'])), False)}.\n")
    from_landscape(figures, IMAGES / "two-zone-sag.svg")
    text += ("\nThe cost over both moduli, as in figure 6 of the paper, each with its own load-free shape; grey: degenerate, no load-free shape sags into the scan; cross: truth.\n\n"
             "![Cost over two moduli of a bar that sags](images/two-zone-sag.svg)\n")
    return text + f"\nMeasured on {machine(figures)}.\n"


def rough_scan():
    figures = results("rough-scan")
    if not figures:
        return "Not run yet.\n"
    names = {"exact": "scan as it is", "bent": "scan bent", "corrected": f"scan bent, corrected about {figures['correction']['scan_points']} points"}
    text = (f"The bend moves vertices by {percent(figures['bend']['rms'], False)} of the ring's size rms, {percent(figures['bend']['greatest'], False)} at most. All three fits: {figures['choices']['cells']} cells, linear tetrahedra, which "
            "are too stiff for nearly incompressible solids: the first row is what the others are to be held against.\n\n")
    rows = []
    for name, f in figures["fits"].items():
        p = f["parameters"]
        E = p["youngs_modulus"]
        rows.append([names[name], f["commit"][:7], with_truth(E), percent(E["value"] / figures["fits"]["exact"]["parameters"]["youngs_modulus"]["value"] - 1), with_truth(p["poisson_ratio"]),
                     with_truth(p["mass_damping"]), with_truth(p["stiffness_damping"], 1e3), f"{percent(f['scan_off']['rms'], False)} / {percent(f['scan_off']['greatest'], False)}", f"{1e3 * f['surface_rms']:.2f}",
                     f"{f['cost']:.0f}", f"{f['wall_seconds']:.0f}", "yes" if f["converged"] else "no"])
    text += table(["", "program", "E [Pa] (truth)", "against the exact scan's", "nu (truth)", "mass damping [1/s] (truth)", "stiffness damping [ms] (truth)", "shape off the exact scan, rms / greatest", "surface rms [mm]", "cost", "time [s]", "converged"], rows)
    c, b = figures["fits"]["corrected"], figures["fits"]["bent"]
    nearer = c["scan_off"]["rms"] < b["scan_off"]["rms"]
    text += (f"\nCorrected, the surface error falls from {1e3 * b['surface_rms']:.2f} to {1e3 * c['surface_rms']:.2f} mm. The shape as a whole is {'nearer to' if nearer else 'no nearer to'} the exact scan"
             + (".\n" if nearer else ": one camera sees one side, and what it does not see moves along as the prior lets it.\n"))
    return text + f"\nMeasured on {machine(figures)}.\n"


def two_mountings():
    figures = results("two-mountings")
    if not figures:
        return "Not run yet.\n"
    truth, units = figures["truth"], {"youngs_modulus": (1e-6, "E [MPa]"), "poissons_ratio": (1.0, "nu"), "mass_damping": (1.0, "mass damping [1/s]"), "stiffness_damping": (1e3, "stiffness damping [ms]")}
    cell = lambda p, key, scale: f"{p['value'] * scale:.3g} [{p['interval'][0] * scale:.3g}, {p['interval'][1] * scale:.3g}]" + ("" if p["interval"][0] <= truth[key] <= p["interval"][1] else ", missed")
    text = table(["released", *(f"{name} (truth {truth[key] * scale:g})" for key, (scale, name) in units.items()), "verdict", "time [s]"],
                 [[mounting, *(cell(f["parameters"][key], key, scale) for key, (scale, _) in units.items()), f["verdict"], f"{f['seconds']:.0f}"] for mounting, f in figures["fits"].items()])
    text += "\nMean (greatest) distance of 300 true points from the predicted ones, over the sheet's length. The weight and gravity together move the sheet by what stands beside it, at most.\n\n"
    rows = []
    for mounting in figures["loads"]:
        for i, load in enumerate(figures["loads"][mounting][mounting]):
            rows.append([f"{mounting}, {1e3 * load['mass']:g} g", f"{1e3 * load['moved']:.0f}"] + [f"{percent(other[mounting][i]['mean'], False)} ({percent(other[mounting][i]['greatest'], False)})" for other in figures["loads"].values()])
    text += table(["weights", "moved [mm]"] + [f"material of the {name} release" for name in figures["loads"]], rows)
    return text + f"\nThe paper's pot holder: 0.007 to 2.8 % lying, 1.9 to 5.6 % upright; its hanger 0.01 to 3.5 %.\n\nMeasured on {machine(figures)}.\n"
