#!/usr/bin/env python3
"""A battery of recordings with known truth, fitted with no choice of ours, and how far the results can be trusted.

    run.py [PROGRAM] [--battery FOLDER] [--only NAME ...] [--work FOLDER]

Of every capture under FOLDER that has a truth.json: each parameter's error, whether its 90 % interval holds the truth, whether the
result doubts itself, and the time; then the shares over all results that do not. truth.json is read for judging only. A fit that is
in the work folder already is not run again."""
import math
import pathlib
import statistics
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

NAMES = {"youngs_modulus": "E", "poisson_ratio": "nu", "mass_damping": "mass damping", "stiffness_damping": "stiffness damping"}
WIDTH_90 = 2 * 1.6449  # of an interval of a normal number, in its deviations


def judged(result, truth):
    """By name: relative error and deviation [-], and whether the interval holds the truth."""
    rows = {}
    for name in NAMES:
        p, true = result["parameters"].get(name), truth.get(name, {}).get("value")
        if not p or not true or not p.get("estimated") or not p.get("interval_90"):
            continue
        low, high = p["interval_90"]
        rows[name] = {"error": common.number((p["value"] - true) / abs(true)), "held": low <= true <= high,
                      "deviation": common.number((high - low) / WIDTH_90 / abs(true))}
    return rows


def over_noise(result):
    """Root mean square distance over the sensor's noise in each third of a recording; nothing of fewer frames."""
    frames = result["error"].get("frames", [])
    if len(frames) < 6:
        return []
    parts = [frames[i * len(frames) // 3:(i + 1) * len(frames) // 3] for i in range(3)]
    squares = lambda part, key: sum(f["points"] * f[key] ** 2 for f in part)
    return [common.number(math.sqrt(squares(part, "rms") / squares(part, "noise")), 3) for part in parts]


def told(name, row):
    cells = [f"{NAMES[key]} {100 * p['error']:+.1f} % (± {100 * p['deviation']:.1f}{'' if p['held'] else ', missed'})"
             for key, p in row["parameters"].items()]
    return f"{name}: {', '.join(cells)}; {row['verdict']}, {row['wall_seconds']:.0f} s"


def score(rows):
    """Over the results that do not doubt themselves."""
    trusted = [r["parameters"] for r in rows.values() if r["verdict"] == "explained"]
    parameters = {}
    for name in NAMES:
        all_of = [p[name] for p in trusted if name in p]
        if not all_of:
            continue
        parameters[name] = {"results": len(all_of), "held": sum(p["held"] for p in all_of),
                            "median_error": common.number(statistics.median(abs(p["error"]) for p in all_of)),
                            "worst_error": common.number(max(abs(p["error"]) for p in all_of)),
                            "rms_error": common.number(math.sqrt(statistics.fmean(p["error"] ** 2 for p in all_of))),
                            "median_deviation": common.number(statistics.median(p["deviation"] for p in all_of))}
    seconds = [r["wall_seconds"] for r in rows.values()]
    return {"recordings": len(rows), "refused": sum(r["verdict"] == "refused" for r in rows.values()), "trusted": len(trusted),
            "parameters": parameters, "median_seconds": statistics.median(seconds), "worst_seconds": max(seconds)}


def main():
    arguments = common.arguments(__doc__, battery={"type": pathlib.Path, "help": "folder of captures"},
                                 only={"nargs": "+", "default": [], "help": "names of captures"})
    battery = arguments.battery or common.shared_data() / "battery"
    captures = [c for c in sorted(battery.glob("*")) if (c / "truth.json").exists() and (not arguments.only or c.name in arguments.only)]
    if not captures:
        raise SystemExit(f"{battery} holds no capture with a truth.json")
    rows = {}
    for capture in captures:
        try:
            figures = common.fit(arguments.program, capture, arguments.work / capture.name)
        except SystemExit as refusal:
            rows[capture.name] = {"verdict": "refused", "reason": str(refusal), "parameters": {}, "wall_seconds": 0.0}
            print(f"{capture.name}: refused\n{refusal}", flush=True)
            continue
        result = figures.pop("result")
        rows[capture.name] = {"verdict": result.get("verdict", "explained"), "wall_seconds": figures["wall_seconds"],
                              "surface_rms": common.number(result["error"].get("surface_rms") or 0.0, 4),
                              "over_noise": over_noise(result),
                              "parameters": judged(result, common.read(capture / "truth.json")["parameters"])}
        print(told(capture.name, rows[capture.name]), flush=True)
    total = score(rows)
    for name, p in total["parameters"].items():
        print(f"{NAMES[name]}: 90 % intervals hold the truth in {p['held']} of {p['results']}; error {100 * p['median_error']:.1f} % in the "
              f"median, {100 * p['worst_error']:.1f} % at worst, {100 * p['rms_error']:.1f} % rms; stated {100 * p['median_deviation']:.1f} %")
    print(f"{total['recordings']} recordings, {total['refused']} refused, {total['trusted']} explained; "
          f"{total['median_seconds']:.0f} s in the median, {total['worst_seconds']:.0f} s at worst")
    common.write_results(__file__, {"captures": len(list(battery.glob("*/truth.json"))), "recordings": rows, "score": total})


if __name__ == "__main__":
    main()
