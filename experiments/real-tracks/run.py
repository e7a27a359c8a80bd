#!/usr/bin/env python3
"""Real objects that hands and a robot move, followed by `pliant track` with no choice of ours.

A knobbly ball that a hand lifts, tilts and presses (one depth camera); a plush dog, two frames; two cloths. Rest surfaces
are made of the recordings' own frames by `pliant scan` (see the prepare.py of plush-press, plush-pair and cloth-lift).
There is no truth: what is measured is how far the object's points are from the surface that was followed. Colours tell
which points are the ball's and which the hand's; the program does not see them. Standard library only."""
import math
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
import ball
import common
import png
import rest_captures

PREPARED = ("plush-press", "plush-pair", "cloth-lift")
BALL_FRAMES = range(40, 250, 5)  # those with a picture in colour, from the first touch
LATER = range(800, 961, 80)
NEAR = 0.004                     # [m]
EVERY = 7                        # of the dog's points
IMAGES = common.ROOT / "docs/images"
PICTURES = {"real-ball-lift": ("press", (60, 90)), "real-ball-press": ("press", (120, 150)), "real-ball-late": ("press", (190, 240)),
            "real-dog": ("move", (0, 1)), "real-paper": ("paper", (0, 3, 5))}


def capture_of(work, name):
    source = next(s for s in PREPARED if (work / s / name / "capture.toml").exists())
    return work / source / name


def surface_of(capture):
    text = (capture / "capture.toml").read_text()
    return capture / text.split('surface = "')[1].split('"')[0]


def track(program, capture, out):
    """Follows a recording and all vertices of its surface; not again where it was done. The frames' figures."""
    if not (out / "figures.json").exists():
        out.mkdir(parents=True, exist_ok=True)
        ball.write_points(out / "rest.csv", rest_captures.vertices(surface_of(capture)))
        run = common.run(program, "track", capture, "--points", out / "rest.csv", "--out", out, allowed=(0, 3))
        (out / "figures.json").write_text(common.json.dumps(run))
    found = common.read(out / "track.json")
    frames = [f for f in found["frames"] if f["points"] > 0]
    return {"nodes": found["nodes"], "frames": len(found["frames"]), "lost_at": found["lost_at"],
            "least_confidence": common.number(min(f["confidence"] for f in frames), 3),
            "explained": [common.number(g(f["explained"] for f in frames), 3) for g in (min, common.median, max)],
            "explained_rms": [common.number(g(f["surface_rms"] for f in frames), 3) for g in (common.median, max)],
            "of_frame": {f["frame"]: {"explained": common.number(f["explained"], 3), "rms": common.number(f["surface_rms"], 3)}
                         for f in frames}}


def of_distances(distances):
    ordered = sorted(distances)
    return {"points": len(ordered), "rms": common.number(ball.rms(ordered), 3), "median": common.number(common.median(ordered), 3),
            "ninety": common.number(ordered[int(0.9 * (len(ordered) - 1))], 3),
            "near": common.number(sum(d < NEAR for d in ordered) / len(ordered), 3)}


def volume(vertices, triangles):
    total = 0.0
    for a, b, c in triangles:
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = vertices[a], vertices[b], vertices[c]
        total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return total / 6.0


def press(program, work):
    capture, data = capture_of(work, "press"), rest_captures.shared_data() / "plush-press-rgbd"
    out = work / "tracks/press"
    figures = track(program, capture, out)
    rest, triangles = rest_captures.vertices(surface_of(capture)), ball.read_triangles(surface_of(capture))
    plane = common.read(work / "plush-press/scan/rest/scan.json")["plane"]
    places = ball.read_track(out / "points.csv", len(rest), BALL_FRAMES)
    unmoved, whole, rows = ball.Surface(rest, triangles), volume(rest, triangles), []
    for frame in BALL_FRAMES:
        surface = ball.Surface(places[frame], triangles)
        points, is_ball = ball.pixels(data, frame)
        distances = [surface.distance(p) for p in points]
        own = [p for p, yes in zip(points, is_ball) if yes]
        own_distances = [d for d, yes in zip(distances, is_ball) if yes]
        heights = [common.dot([p[d] - plane["point"][d] for d in range(3)], plane["normal"]) for p in surface.vertices]
        rows.append({"frame": frame, "all": of_distances(distances), "ball": of_distances(own_distances),
                     "unmoved": of_distances([unmoved.distance(p) for p in own]),
                     "explained": figures["of_frame"][frame]["explained"], "explained_rms": figures["of_frame"][frame]["rms"],
                     "volume": common.number(volume(surface.vertices, triangles) / whole, 4),
                     "lowest": common.number(min(heights), 3), "highest": common.number(max(heights), 3)})
        print(f"{frame}: ball {1e3 * rows[-1]['ball']['rms']:.2f} mm rms, {1e3 * rows[-1]['ball']['median']:.2f} median; all of the mask "
              f"{1e3 * rows[-1]['all']['rms']:.2f}, {1e3 * rows[-1]['all']['median']:.2f}; explained {rows[-1]['explained']}, "
              f"volume {rows[-1]['volume']}, lowest {1e3 * rows[-1]['lowest']:.1f} mm", flush=True)
    figures.pop("of_frame")
    return {**figures, "ball": rows}


def after(work):
    """The shape before the press, laid onto the ball's points after it."""
    data, scan = rest_captures.shared_data() / "plush-press-rgbd", work / "plush-press/scan/rest"
    surface = ball.Surface(rest_captures.vertices(scan / "rest.ply"), ball.read_triangles(scan / "rest.ply"))
    up = common.read(scan / "scan.json")["plane"]["normal"]
    points, is_ball = ball.pixels(data, 0)
    before = [p for p, yes in zip(points, is_ball) if yes]
    rows = [{"frame": 0, **of_distances([surface.distance(p) for p in before])}]
    for frame in LATER:
        points, is_ball = ball.pixels(data, frame)
        lies = ball.lay(surface, common.mean(before), [p for p, yes in zip(points, is_ball) if yes], up)
        rows.append({"frame": frame, **of_distances(lies["distances"]), "turned": common.number(math.degrees(lies["angle"]), 3),
                     "moved": common.number(math.hypot(*lies["shift"]), 3)})
        print(f"{frame}: {1e3 * rows[-1]['rms']:.2f} mm rms, {1e3 * rows[-1]['median']:.2f} median", flush=True)
    return rows


def pair(program, work):
    capture, data = capture_of(work, "move"), rest_captures.shared_data() / "plush-depth-pair"
    out = work / "tracks/move"
    figures = track(program, capture, out)
    figures.pop("of_frame")
    rest, triangles = rest_captures.vertices(surface_of(capture)), ball.read_triangles(surface_of(capture))
    points = dog_points(data)
    moved = ball.Surface(ball.read_track(out / "points.csv", len(rest), [1])[1], triangles)
    unmoved = ball.Surface(rest, triangles)
    travel = sorted(math.dist(a, b) for a, b in zip(rest, moved.vertices))
    return {**figures, "followed": of_distances([moved.distance(p) for p in points]),
            "unmoved": of_distances([unmoved.distance(p) for p in points]),
            "travel": [common.number(travel[len(travel) // 2], 3), common.number(travel[-1], 3)]}


def dog_points(data):
    width, height, depth = png.read_depth(data / "snoopy_depth_000051.png")
    mask = png.read(data / "snoopy_omask_000051.png")[2]
    f, cx, cy, points = 517.0, 320.0, 240.0, []
    for v in range(height):
        for u in range(v % EVERY, width, EVERY):
            if depth[v][u] and mask[v][u]:
                z = 1e-3 * depth[v][u]
                points.append(((u - cx) / f * z, (v - cy) / f * z, z))
    return points


def cloth(program, work, name):
    capture = capture_of(work, name)
    out = work / "tracks" / name
    figures = track(program, capture, out)
    count = figures["frames"]
    rest, triangles = rest_captures.vertices(surface_of(capture)), ball.read_triangles(surface_of(capture))
    places, rows = ball.read_track(out / "points.csv", len(rest), range(count)), []
    unmoved, whole = ball.Surface(rest, triangles), volume(rest, triangles)
    for frame in range(count):
        points = common.read_vertices(capture / f"clouds/{frame:03d}.ply")[::9]
        surface = ball.Surface(places[frame], triangles)
        rows.append({"frame": frame, **of_distances([surface.distance(p) for p in points]),
                     "unmoved": of_distances([unmoved.distance(p) for p in points])["median"],
                     "explained": figures["of_frame"][frame]["explained"],
                     "volume": common.number(volume(surface.vertices, triangles) / whole, 4)})
    print(f"{name}: median of medians {1e3 * common.median([r['median'] for r in rows]):.2f} mm", flush=True)
    figures.pop("of_frame")
    return {**figures, "clouds": rows}


def write_strip(path, sources):
    """Pictures side by side, at half their size."""
    strips = []
    for source in sources:
        width, height, rows = png.read_colours(source)
        strips.append([[tuple((rows[v][u][k] + rows[v][u + 1][k] + rows[v + 1][u][k] + rows[v + 1][u + 1][k]) // 4 for k in range(3))
                        for u in range(0, width - 1, 2)] for v in range(0, height - 1, 2)])
    raw, before = b"", None
    for v in range(len(strips[0])):
        row = bytes(x for strip in strips for pixel in strip[v] for x in pixel)
        raw += b"\2" + bytes((x - y) & 255 for x, y in zip(row, before or bytes(len(row))))
        before = row
    png.write(path, sum(len(strip[0]) for strip in strips), len(strips[0]), 2, raw, level=9)


def main():
    arguments = common.arguments(__doc__)
    program, work = arguments.program, arguments.work.resolve()
    for name in PREPARED:
        if not (work / name).exists():
            subprocess.run([sys.executable, str(HERE.parent / name / "prepare.py"), str(program), "--work", str(work / name)], check=True)
    figures = {"near": NEAR, "press": press(program, work), "after": after(work), "pair": pair(program, work),
               "paper": cloth(program, work, "paper"), "polka": cloth(program, work, "polka")}
    for name, (folder, frames) in PICTURES.items():
        write_strip(IMAGES / f"{name}.png", [work / f"tracks/{folder}/pictures/{frame:06d}.png" for frame in frames])
    common.write_results(__file__, figures)


if __name__ == "__main__":
    main()
