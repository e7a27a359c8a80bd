"""The section of docs/experiments.md about photographs, from dots to a prediction. Standard library only."""
from page import machine, percent, results, table


def photo_chain():
    figures = results("photo-chain")
    if not figures:
        return "Not run yet.\n"
    text = (f"Of {figures['markers']} markers {min(figures['seen'])} to {max(figures['seen'])} were seen under a press; rms between cameras at most {max(figures['rms_pixels']):g} pixels; "
            f"forces read from the log at most {max(abs(a - b) for a, b in figures['forces']):.2g} N off. Truth: E = {figures['truth']['youngs_modulus']:g} Pa, nu = {figures['truth']['poissons_ratio']:g}, exponent {figures['truth']['exponent_1']:g}.\n\n")
    rows = []
    for name, f in figures["fits"].items():
        p = f["parameters"]
        for r in f["predicted"]:
            rows.append([name, *(f"{p[key][0]:g} +- {p[key][1]:g}" for key in ("youngs_modulus", "poissons_ratio", "exponent_1")), f"{1e3 * r['depth']:g}", f"{1e3 * r['rms']:.2f} ({percent(r['rms'] / r['moved'], sign=False)})",
                         f"{1e3 * r['max']:.2f}", percent(r["force"] / r["true_force"] - 1)])
    text += table(["fitted to", "E [Pa]", "nu", "exponent", "other probe pressed [mm]", "surface rms [mm] (of the greatest motion)", "greatest [mm]", "force off by"], rows)
    return text + ("\nThe rms is over vertices that truly moved by more than a tenth of the greatest motion. The fit's elements are linear tetrahedra, a press fit's default; the truth's are quadratic and smaller: both fits have that error. "
                   f"The surface is predicted as well from photographs as from exact markers; the force is not, whose exponent the photographs tell less well.\n\nMeasured on {machine(figures)}.\n")
