"""The section of docs/experiments.md about real objects that are followed. Standard library only."""
from page import judged, machine, percent, results, table


def mm(value, digits=2):
    return f"{1e3 * value:.{digits}f}"


def middle(values):
    ordered = sorted(values)
    return ordered[len(ordered) // 2]


def share(value):
    return percent(value, sign=False)


def strip(name, words):
    return f"![{words}](images/{name}.png)\n\n"


def real_tracks():
    figures = results("real-tracks")
    if not figures:
        return "Not run yet.\n"
    return (ball_press(figures) + ball_after(figures) + dog(figures) + cloths(figures) +
            f"\nMeasured on {machine(figures)}.\n")


def run_of(f):
    lost = "never lost" if f["lost_at"] is None else f"lost in frame {f['lost_at']}"
    return f"{f['frames']} frames, {f['nodes']} nodes, {lost}"


def ball_press(figures):
    f = figures["press"]
    rows = f["ball"]
    of = lambda key, what: [r[key][what] for r in rows]
    text = ("**The ball.** A hand lifts and tilts it (about frames 85 to 95), puts it down and presses it. Colour, which the program does not see, tells the ball's points from the hand's: red, not the orange of skin. "
            "It leaves out the outermost pixels, whose surroundings are not red. Distances above 48 mm, such as the arm's, count as 48 mm.\n\n" +
            strip("real-ball-lift", "Frames 60 and 90: the surface that was followed with the points seen; grey points are outliers") +
            strip("real-ball-press", "Frames 120 and 150") + strip("real-ball-late", "Frames 190 and 240; the bear's foot is grey, too") +
            f"Grey: what the tracker takes for outliers. {run_of(f)}. Over the {len(rows)} frames that have a picture in colour:\n\n")
    text += table(["points", "their number", "rms [mm], median frame", "worst frame", "median distance [mm], median frame", "worst frame", f"within {mm(figures['near'], 0)} mm, median frame"],
                  [["the ball's, by colour"] + cells(rows, "ball"), ["the ball's, against the surface where it lay first"] + cells(rows, "unmoved"),
                   ["all of the owners' mask, hand and all"] + cells(rows, "all"),
                   ["explained by the tracker", "", mm(middle([r["explained_rms"] for r in rows])), mm(max(r["explained_rms"] for r in rows)), "", "", ""]])
    worst = max(rows, key=lambda r: r["ball"]["rms"])
    text += "\n" + table(["target", "here", ""], [
        ["surface error of the ball, median frame, under 4 mm", f"{mm(middle(of('ball', 'rms')))} mm rms", judged(middle(of("ball", "rms")) < 4e-3)]])
    red = middle([r["ball"]["points"] / r["all"]["points"] for r in rows])
    return text + (f"\nThe ball's worst frame is {worst['frame']}. Its volume stays within {share(min(r['volume'] for r in rows))} and {share(max(r['volume'] for r in rows))} of what it was; "
                   f"its lowest vertex is between {mm(min(r['lowest'] for r in rows), 1)} and {mm(max(r['lowest'] for r in rows), 1)} mm from the table. "
                   f"What fails: fingertips that touch the ball are taken for it. Where the hand presses hardest (frames 150 and 240) the surface keeps its height under the fingers and is not dented as deeply as they press: points of the hand and of the ball between the fingers lie inside it, so the picture shows none there. Of the points that the tracker gets, the median frame explains {share(middle([r['explained'] for r in rows]))}; of the owners' mask {share(red)} are the ball's by colour. "
                   "The surface rises into bumps of some millimetres under the fingers. How far the hidden back moves is the body's guess; nothing was seen of it.\n\n")


def cells(rows, key):
    of = lambda what: [r[key][what] for r in rows]
    return [f"{min(of('points'))} to {max(of('points'))}", mm(middle(of("rms"))), mm(max(of("rms"))), mm(middle(of("median"))), mm(max(of("median"))), share(middle(of("near")))]


def ball_after(figures):
    first, *later = figures["after"]
    text = ("**At rest again.** By frame 800 the ball was turned and moved on the table, out of sight of the recording that is followed. The surface before the press, not deformed, is laid onto the ball's points "
            "by the experiment's script (iterated closest points over one angle about the vertical and a shift along the table), not by the tracker. Frame 0 is the surface against its own frames.\n\n")
    text += table(["frame", "turned [degrees]", "moved [mm]", "points", "rms [mm]", "median distance [mm]", "90 % within [mm]"],
                  [[r["frame"], f"{r['turned']:.1f}" if "turned" in r else "", mm(r["moved"], 1) if "moved" in r else "", r["points"], mm(r["rms"]), mm(r["median"]), mm(r["ninety"])] for r in figures["after"]])
    return text + "\n" + table(["target", "here", ""], [["shape at rest after the press back within 4 mm", f"{mm(max(r['rms'] for r in later))} mm rms in the worst frame",
                                                         judged(max(r["rms"] for r in later) < 4e-3)]]) + "\n"


def dog(figures):
    f = figures["pair"]
    return ("**The dog.** Two frames; the surface is made of the first.\n\n" + strip("real-dog", "The first frame and the second") +
            f"{run_of(f)}. Distances of the second frame's points (those of the owners' mask):\n\n" +
            table(["surface", "points", "rms [mm]", "median distance [mm]", "90 % within [mm]"],
                  [[name, f[key]["points"], mm(f[key]["rms"]), mm(f[key]["median"]), mm(f[key]["ninety"])] for name, key in (("followed", "followed"), ("where it was", "unmoved"))]) +
            f"\nIts vertices move by {mm(f['travel'][0], 1)} mm in the middle and {mm(f['travel'][1], 1)} mm at the most. One step shows that the tracker takes such data, little more: no truth is known, and all of the dog's back is a guess.\n\n")


def cloths(figures):
    rows = []
    for name in ("paper", "polka"):
        f = figures[name]
        clouds = f["clouds"]
        rows.append([name, f["frames"], f["nodes"], "no" if f["lost_at"] is None else f"in frame {f['lost_at']}", share(middle([r["explained"] for r in clouds])), share(min(r["explained"] for r in clouds)),
                     mm(middle([r["median"] for r in clouds]), 1), mm(max(r["median"] for r in clouds), 1), mm(max(r["ninety"] for r in clouds), 1),
                     mm(max(r["unmoved"] for r in clouds), 1), f"{min(r['volume'] for r in clouds):.2f} to {max(r['volume'] for r in clouds):.2f}"])
    return ("**The cloths.** Played backwards, a sheet sinks onto a table that hides what it reaches. The sheet is a slab of 8 mm, forty times as thick as the cloth; half its thickness is in every distance to its surface. "
            "Frames are one robot step apart.\n\n" +
            strip("real-paper", "Paper: frames 20, 17 and 15 of the recording; the slab is drawn out downwards") +
            table(["cloth", "frames", "nodes", "lost", "explained, median frame", "least", "median distance [mm], median frame", "worst frame", "90 % within [mm], worst frame", "of the surface where it began, worst frame [mm]",
                   "volume over that at rest"], rows) + CLOTH_WORDS)


CLOTH_WORDS = ("\nThis fails. A slab that nothing is said to hold falls between frames that are a second apart: the gripper is not in the capture, and the clouds draw the slab back only where they lie on it. What they leave "
               "alone hangs down, stretches and is torn inside out; the other piece sinks after it. A sheet needs its held corner declared, elements for shells, or frames closer together.\n")
