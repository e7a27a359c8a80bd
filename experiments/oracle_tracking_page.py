"""The section of docs/experiments.md about two ways from clouds to a material. Standard library only."""
from page import judged, machine, percent, results, table



def clouds():
    figures = results("oracle-tracking")
    if not figures:
        return "Not run yet.\n"
    text = ("The same recordings as above, of another simulator. The tracked motion's way follows the object and fits its motion, in turns; the points' way fits what was seen of the surface itself. "
            "`automatic` is `pliant fit` without any choice: both from four fifths of the frames, and the one that predicts the others better finished with all.\n\n")
    rows = []
    for name, fit in figures["fits"].items():
        E = fit["parameters"]["youngs_modulus"]
        judged_by = percent(fit["error"]) if "error" in fit else ", ".join(f"{z['mean'] / 1e3:.0f} kPa ({percent(z['mean'] / z['truth'] - 1)})" for z in fit["zones"])
        kept = fit["tracking"]["kept"] if fit.get("tracking") else "points"
        rows.append([name, f"{E['value'] / 1e3:.0f} ± {E['std'] / 1e3:.0f}" if E.get("std") else f"{E['value'] / 1e3:.0f}", judged_by, kept, f"{1e3 * fit['surface_rms']:.2f}", f"{fit['wall_seconds']:.0f} / {fit['processor_seconds']:.0f}", fit.get("commit", "")[:7]])
    text += table(["recording, way", "E [kPa]", "against the truth; zones from above", "kept", "surface rms [mm]", "time / of processor [s]", "program"], rows)
    for name, fit in figures["fits"].items():
        held = (fit.get("tracking") or {}).get("held_out_frames")
        if held:
            said = ", ".join(f"{way} {v['cost']:.4g} ({1e3 * v['surface_rms']:.2f} mm)" for way, v in held.items() if v and v["cost"] is not None)
            text += f"\n{name}: cost of the frames left out: {said}.\n"
    tracks = figures["tracks"]
    if tracks:
        loops = figures["loops"]
        rows = []
        for wrong, t in tracks.items():
            loop = loops.get(wrong)
            after = loop["track_after"] if loop else None
            rows.append([wrong, f"{100 * t['mean']:.2f} % / {100 * t['worst_frame']:.2f} %", "yes" if t["lost"] else "no",
                         percent(loop["error"]) if loop else "", f"{100 * after['mean']:.2f} % / {100 * after['worst_frame']:.2f} %" if after else ""])
        text += ("\nTracking with a wrong material, and the loop from there. Node errors against the truth's surface over the object's size: mean / worst frame.\n\n" +
                 table(["tracked with", "node error", "lost", "E after the loop, against the truth", "node error, tracked with that"], rows))
        true = tracks["true material"]["mean"]
        met = all(abs(l["error"]) <= 0.1 and l["track_after"]["mean"] <= 1.1 * true for l in loops.values())
        text += f"\nAim: E within 10 %, and a track no more than 10 % worse than that with the true material: {judged(met)}.\n"
    return text + f"\nMeasured on {machine(figures)}.\n"
