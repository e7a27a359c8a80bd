"""The sections of docs/experiments.md about twins of the paper's real recordings, and about plans. Standard library only."""
from page import machine, percent, results, table


def interval(p, scale=1.0):
    low, high = (scale * end for end in p["interval_90"])
    return f"{scale * p['value']:.4g} [{low:.4g}, {high:.4g}] ({scale * p['truth']:g}{'' if p['held'] else ', missed'})"


def twins():
    figures = results("twins")
    if not figures:
        return "Not run yet.\n"
    rows = []
    for name, r in figures["twins"].items():
        p = r["parameters"]
        plane = f"{r['plane_deg']:.2g} degrees, {1e3 * r['plane_m']:.2g} mm" if "plane_deg" in r else "given"
        rows.append([name, interval(p["youngs_modulus"]), percent(p["youngs_modulus"]["value"] / p["youngs_modulus"]["truth"] - 1), interval(p["poisson_ratio"]), interval(p["mass_damping"]),
                     interval(p["stiffness_damping"], 1e3), interval(p["friction"]), f"{r['gravity']:.4g} ({percent(r['gravity_error'])})", plane, r["verdict"], f"{r['wall_seconds']:.0f}"])
    text = table(["twin", "E [Pa] (truth)", "error", "nu (truth)", "mass damping [1/s] (truth)", "stiffness damping [ms] (truth)", "friction (truth)", "gravity [m/s^2]", "plane off by", "verdict",
                  "time with the prediction [s]"], rows)
    for r in figures["twins"].values():
        text += "".join(f"\n{note}\n" for note in r["notes"])
    text += ("\nGoals: Young's modulus within 15 %, gravity within 3 %, the plane within 2 degrees and 5 mm, intervals that hold the truth, 5 minutes. The paper's teddy took 18 starts of 50 iterations and 40 minutes on a GPU. "
             "Young's modulus varies smoothly over the twins; the truth is its mean.\n\nThe second throw, its own start, ground and friction estimated and the material kept:\n\n")
    text += table(["model of", "frames", "surface rms [mm]", "over the part that was fitted of the first [mm]", "noise [mm]"],
                  [[name, r["predicted"]["frames"], f"{1e3 * r['predicted']['surface_rms']:.2f}", f"{1e3 * r['predicted']['surface_rms_of_part']:.2f}", f"{1e3 * r['predicted']['noise']:.2f}"]
                   for name, r in figures["twins"].items()])
    text += "\nThe best five starts of each, on the coarse grid over all frames, as the paper's tables 3 and 4 list them:\n\n"
    text += table(["twin", "cost", "gravity [m/s^2]", "E [Pa]", "mass damping [1/s]", "stiffness damping [ms]", "friction", "why it ended"],
                  [[name, f"{s['cost']:.0f}", f"{s['gravity']:.4g}", f"{s['youngs_modulus']:.4g}", f"{s['mass_damping']:.3g}", f"{1e3 * s['stiffness_damping']:.3g}", f"{s['friction']:.2g}", s["reason"]]
                   for name, r in figures["twins"].items() for s in r["starts"]])
    return text + f"\nMeasured on {machine(figures)}.\n"


def plans():
    figures = results("recording-plans")
    if not figures:
        return "Not run yet.\n"
    words = {"youngs_modulus": "Young's modulus", "poissons_ratio": "Poisson's ratio", "mass_damping": "mass damping", "stiffness_damping": "stiffness damping"}
    cell = lambda p: f"{100 * p['half_width']:.0f} % ({p['cause']})" if p else ""
    text = table(["recording", *words.values()], [[name, *(cell(r.get(key)) for key in words)] for name, r in figures["plans"].items()])
    return text + f"\nMeasured on {machine(figures)}.\n"
