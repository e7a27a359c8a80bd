"""The section of docs/experiments.md about objects that are tracked. Standard library only."""
from page import judged, machine, results, table

BOUND = 0.01  # of the object's size


def share(value):
    return f"{100 * value:.2f} %"


def swinging():
    figures = results("tracking")
    if not figures:
        return "Not run yet.\n"
    recordings = figures["recordings"]
    first = recordings[0]
    text = (f"Noise of {1e3 * first['noise']:g} mm, {100 * first['outliers']:g} % outliers, {first['choices']['frames']} frames at 30 Hz, of which the first three are held. The truth is of quadratic tetrahedra, moves by Newton's method in "
            "steps of a quarter of a frame, and is seen by rays; the tracker has other elements and one step a frame. The physics are the same (an inverse crime in that). Errors are the mean distance of the tracked nodes from where "
            "the same points of the true body are, over the object's size: mean of all frames / worst frame.\n\n")
    factors = [track["modulus_factor"] for track in first["tracks"]]
    rows = []
    for r in recordings:
        c = r["choices"]
        rows.append([c["object"], c["elements"], f"{r['nodes']}", f"{r['points']}", c["hidden"] + " third", share(r["fastest"])] +
                    [f"{share(t['mean_error'])} / {share(t['worst_error'])}" + ("" if t["lost_at"] is None else f", lost in frame {t['lost_at']}") for t in r["tracks"]] +
                    [f"{r['tracks'][0]['seconds_per_frame']:.2f}"])
    names = {1: "true modulus", 0.1: "a tenth of it", 10: "ten times it"}
    text += table(["object", "elements", "nodes", "points a frame", "hidden", "fastest motion between frames"] + [names.get(f, f"{f:g} times") for f in factors] + ["time a frame [s]"], rows)
    asked = [t for r in recordings if r["choices"]["hidden"] == "middle" for t in r["tracks"] if t["modulus_factor"] == 1]
    met = all(t["worst_error"] < BOUND and t["lost_at"] is None for t in asked)
    text += f"\nAim: mean node error below 1 % of the size in every frame, and no loss of track with motion of 10 % of the size between frames, the middle hidden and the modulus true: {judged(met)}.\n"
    beyond = [f"{r['choices']['object']} ({r['choices']['elements']}, {r['choices']['hidden']} hidden, {r['choices']['motion']}) with {t['modulus_factor']:g} times the modulus in {t['frames_beyond_one_percent']}"
              for r in recordings for t in r["tracks"] if t["frames_beyond_one_percent"]]
    text += "Frames beyond 1 %: " + ("; ".join(beyond) if beyond else "none") + ".\n"
    text += "\nA hanging bar of a tenth of the modulus is 1.1 % longer in the mean by its own weight, and that is what it is off by: how far a surface has slid along itself shows in its ends alone. `pliant track` takes a modulus, where none is given, under which the weight hardly shows.\n"
    return text + f"\nMeasured on {machine(figures)}.\n"
