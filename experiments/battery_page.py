"""The sections of docs/experiments.md about many recordings at once: how far results without choices can be trusted. Standard library only."""
from page import judged, machine, percent, results, table

SHORT = {"youngs_modulus": "E", "poisson_ratio": "nu", "mass_damping": "mass damping", "stiffness_damping": "stiffness damping"}


def told(p):
    return f"{percent(p['error'])} (± {100 * p['deviation']:.1f}){'' if p['held'] else ', missed'}" if p else ""


def counts(score):
    """A row a parameter: intervals that hold the truth, errors, and what was stated."""
    return table(["over results that do not doubt themselves", "90 % intervals that hold the truth", "median error", "worst error", "rms error",
                  "stated deviation, median", "stated over rms error"],
                 [[SHORT[n], f"{p['held']} of {p['results']}", percent(p["median_error"], False), percent(p["worst_error"], False),
                   percent(p["rms_error"], False), percent(p["median_deviation"], False), f"{p['median_deviation'] / p['rms_error']:.2f}"]
                  for n, p in score["parameters"].items()])


def battery():
    figures = results("battery")
    if not figures:
        return "Not run yet.\n"
    rows, score = figures["recordings"], figures["score"]
    text = table(["recording", *(f"{s} off (± stated)" for s in SHORT.values()), "verdict", "surface rms [mm]", "over the noise, by thirds of the time", "time [s]"],
                 [[name, *(told(r["parameters"].get(n)) for n in SHORT), r["verdict"], f"{1e3 * r.get('surface_rms', 0):.2f}",
                   ", ".join(f"{x:.2f}" for x in r.get("over_noise", [])),
                   f"{r['wall_seconds']:.0f}"] for name, r in rows.items()])
    late = [(name, r["over_noise"]) for name, r in rows.items() if r.get("over_noise") and name.startswith(("drop", "tilted"))]
    if late:
        worst = max(late, key=lambda item: item[1][2])
        text += ("\nOf what meets a plane, distances are " + percent(min(x[2] for _, x in late) - 1) + f" to {percent(worst[1][2] - 1)} of the noise beyond it in the last "
                 "third of the recording, after the impacts, and "
                 f"{percent(min(x[0] for _, x in late) - 1)} to {percent(max(x[0] for _, x in late) - 1)} in the first.\n")
    text += "\n" + counts(score)
    moduli = {name: r["parameters"].get("youngs_modulus") for name, r in rows.items()}
    within = sum(p is not None and abs(p["error"]) <= 0.1 for p in moduli.values())
    astray = [name for name, r in rows.items() if r["verdict"] == "explained" and moduli[name] and abs(moduli[name]["error"]) > 0.2]
    E = score["parameters"]["youngs_modulus"]
    aims = [["refused", score["refused"], "0", score["refused"] == 0],
            ["Young's modulus within 10 %", f"{within} of {score['recordings']}", "85 %", within >= 0.85 * score["recordings"]],
            ["median error of Young's modulus", percent(E["median_error"], False), "4 %", E["median_error"] <= 0.04],
            ["not doubted, and more than 20 % off", len(astray), "0", not astray]]
    for n, p in score["parameters"].items():
        share = p["held"] / p["results"]
        aims.append([f"90 % intervals of {SHORT[n]} that hold the truth", f"{100 * share:.0f} %", "85 to 97 %", 0.85 <= share <= 0.97])
    for n, p in score["parameters"].items():
        ratio = p["median_deviation"] / p["rms_error"]
        aims.append([f"stated deviation over rms error, {SHORT[n]}", f"{ratio:.2f}", "0.5 to 2", 0.5 <= ratio <= 2])
    aims += [["time, median", f"{score['median_seconds']:.0f} s", "120 s", score["median_seconds"] <= 120],
             ["time, worst", f"{score['worst_seconds']:.0f} s", "600 s", score["worst_seconds"] <= 600]]
    text += "\n" + table(["", "reached", "aim", ""], [[*row[:3], judged(row[3])] for row in aims])
    if len(rows) < figures["captures"]:
        text += f"\nOf {figures['captures']} recordings these {len(rows)} were fitted.\n"
    return text + ("\nWhat stands for unmodelled law and damping in the intervals was set by looking at errors of this battery: they are no "
                   f"independent check of it. Measured on {machine(figures)}.\n")


def coverage():
    figures = results("coverage")
    if not figures:
        return "Not run yet.\n"
    scores = figures["score"]
    text = table(["family", "recordings", "explained", *(f"{s}: held, rms error, stated" for s in SHORT.values())],
                 [[part, s["recordings"], s["trusted"],
                   *(f"{p['held']} of {p['results']}, {percent(p['rms_error'], False)}, {percent(p['median_deviation'], False)}" if p else ""
                     for p in (s["parameters"].get(n) for n in SHORT))] for part, s in scores.items()])
    return text + (f"\n{scores['all']['recordings']} of the {figures['asked_for']} recordings that the command makes were fitted, refused ones "
                   f"({scores['all']['refused']}) among them. Measured on {machine(figures)}.\n")


def error_budget():
    figures = results("error-budget")
    if not figures:
        return "Not run yet.\n"
    recordings = figures["recordings"]
    errors = list(dict.fromkeys(error for rows in recordings.values() for error in rows))

    def cell(rows, error):
        E = rows.get(error, {}).get("parameters", {}).get("youngs_modulus")
        if not E:
            return "" if error not in rows else "no estimate"
        shown = percent(E["error"] if error == "none" else E["error"] - rows["none"]["parameters"]["youngs_modulus"]["error"])
        return (f"{shown} (± {100 * E['deviation']:.0f})" + ("" if E["held"] else ", missed")
                + ("" if rows[error]["verdict"] == "explained" else ", " + rows[error]["verdict"]))
    return (table(["one thing is wrong", *recordings], [[error, *(cell(rows, error) for rows in recordings.values())] for error in errors])
            + "\nYoung's modulus: `none` is off the truth, all others off `none`, with the deviation that the fit states; *missed*: the 90 % interval "
            f"does not hold the truth. Empty: the recording has no such thing. Measured on {machine(figures)}.\n")
