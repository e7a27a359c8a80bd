#!/usr/bin/env python3
"""Twins of the real recordings of Weiss et al. 2020 (its tables 1 to 5): a toy that is let go with a spin, a pillow that is thrown on a
ramp that no camera sees. Fitted with no choice of ours; a second throw of each is predicted. truth.json is read for judging only."""
import math
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

NAMES = ("youngs_modulus", "poisson_ratio", "mass_damping", "stiffness_damping", "friction")


def length(v):
    return math.sqrt(common.dot(v, v))


def plane_errors(found, truth):
    """Angle of the normals [deg], and how far the true point lies from the found plane [m]."""
    n, m = found["normal"], truth["normal"]
    cosine = common.dot(n, m) / length(n) / length(m)
    off = common.dot([a - b for a, b in zip(truth["point"], found["point"])], n) / length(n)
    return common.number(math.degrees(math.acos(max(-1.0, min(1.0, cosine)))), 3), common.number(abs(off), 3)


def judged(result, truth):
    parameters = {}
    for name in NAMES:
        p = result["parameters"][name]
        if not p["estimated"]:
            continue
        true = truth[name]["value"]
        parameters[name] = {"value": common.number(p["value"]), "truth": common.number(true), "interval_90": common.rounded(p["interval_90"], 4),
                            "held": p["interval_90"][0] <= true <= p["interval_90"][1]}
    gravity = result["parameters"]["gravity"]["value"]
    row = {"parameters": parameters, "gravity": common.number(length(gravity)), "gravity_error": common.number(length(gravity) / length(truth["gravity"]["value"]) - 1.0, 3),
           "verdict": result["verdict"], "notes": [n for n in result["notes"] if n.startswith("No parameters explain")],
           "surface_rms": common.number(result["error"]["surface_rms"], 3), "frames": len(result["error"]["frames"])}
    if result["parameters"]["plane"]["estimated"]:
        row["plane_deg"], row["plane_m"] = plane_errors(result["parameters"]["plane"]["value"], truth["plane"]["value"])
    starts = sorted((s for s in result["starts"] if s["cost"] is not None), key=lambda s: s["cost"])[:5]
    row["starts"] = [{"cost": common.number(s["cost"]),
                      "gravity": common.number(length([s["final"][f"gravity.{c}"] for c in "xyz"])), "reason": s["reason"],
                      **{name: common.number(s["final"][name]) for name in ("youngs_modulus", "mass_damping", "stiffness_damping", "friction")}} for s in starts]
    return row


def over(frames):
    """Root mean square distance of all points [m]."""
    return common.number(math.sqrt(sum(f["points"] * f["rms"] ** 2 for f in frames) / sum(f["points"] for f in frames)), 3)


def main():
    arguments = common.arguments(__doc__)
    rows = {}
    for name in ("twin-teddy", "twin-pillow"):
        capture = common.shared_data() / name
        if not capture.exists():
            print(f"{name}: no {capture}; left out")
            continue
        figures = common.fit(arguments.program, capture, arguments.work / name, more=("--hold-out", common.shared_data() / f"{name}-b"))
        row = judged(figures["result"], common.read(capture / "truth.json")["parameters"])
        row["wall_seconds"] = figures["wall_seconds"]
        frames = figures["result"]["held_out"]["error"]["frames"]
        row["predicted"] = {"frames": len(frames), "surface_rms": over(frames), "surface_rms_of_part": over(frames[:row["frames"]]),
                            "noise": common.number(frames[0]["noise"], 3)}
        rows[name] = row
        print(name, row, flush=True)
    common.write_results(__file__, {"twins": rows})


if __name__ == "__main__":
    main()
