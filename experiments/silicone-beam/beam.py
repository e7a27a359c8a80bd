"""The recordings of the released beam as captures: frames, files, and what is measured on a tip's motion.

All captures share one world, the beam's: its clamp at x = -0.1 m, its free end at x = 0, z up while it is held straight. A
model fitted in one recording can so be simulated in another, although the clamp stood 2 mm and a degree elsewhere
there; gravity is turned along. Standard library only."""
import csv
import math
import pathlib
import struct

import common
from common import dot, mean

TIPS = ["tip1", "tip2", "tip3"]
MARKERS = TIPS + ["base1", "base2", "base3"]
RATE = 100.0
GRAVITY = 9.81
DENSITY = 1070.0
WEIGHT = 0.51012 / GRAVITY                # kg
EDGE = [(0.0, 0.030 * (k + 0.5) / 7, 0.030) for k in range(7)]  # along the top edge of the free end
MIDDLE = [(0.0, 0.015, 0.030)]
FOLDER = "silicone-beam-mocap"


def turn(R, v):
    return tuple(dot(row, v) for row in R)


def transpose(R):
    return [list(column) for column in zip(*R)]


def rigid_fit(origin, target):
    """R, t, rms of target = R origin + t: Horn's quaternion, by power iteration."""
    a, b = mean(origin), mean(target)
    S = [[sum((p[i] - a[i]) * (q[j] - b[j]) for p, q in zip(origin, target)) for j in range(3)] for i in range(3)]
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = S
    N = [[xx + yy + zz, yz - zy, zx - xz, xy - yx], [yz - zy, xx - yy - zz, xy + yx, zx + xz],
         [zx - xz, xy + yx, yy - xx - zz, yz + zy], [xy - yx, zx + xz, yz + zy, zz - xx - yy]]
    shift = sum(abs(v) for row in N for v in row)
    q = [1.0, 0.3, 0.2, 0.1]
    for _ in range(20000):
        new = [dot(row, q) + shift * v for row, v in zip(N, q)]
        norm = math.sqrt(dot(new, new))
        new = [v / norm for v in new]
        if max(abs(u - v) for u, v in zip(new, q)) < 1e-15:
            break
        q = new
    w, x, y, z = q
    R = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
         [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
         [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
    t = tuple(b[d] - turn(R, a)[d] for d in range(3))
    squares = [sum((u + s - v) ** 2 for u, s, v in zip(turn(R, p), t, q)) for p, q in zip(origin, target)]
    return R, t, math.sqrt(sum(squares) / len(squares))


class Recording:
    """One C3D file's markers in the beam's frame."""

    def __init__(self, name):
        data = common.shared_data() / FOLDER
        self.name = name
        frames = common.read_markers(data / f"beam_{name}.csv", MARKERS)
        with open(data / "marker_rest_positions_beam_frame.csv", newline="") as file:
            nominal = {row["marker"]: tuple(float(row[f"{c}_m"]) for c in "xyz") for row in csv.DictReader(file)}
        # Released: the mean of the tip's markers has dropped by 0.2 mm since ten frames before.
        drop = lambda k, j: sum(frames[j][m][0] - frames[k][m][0] for m in TIPS) / 3
        self.start = next(k for k in range(20, len(frames)) if drop(k, k - 10) > 2e-4) - 1
        held = {m: mean([f[m] for f in frames[self.start - 10:self.start - 1]]) for m in MARKERS}
        R, t, self.frame_rms = rigid_fit([nominal[m] for m in MARKERS], [held[m] for m in MARKERS])
        back = transpose(R)
        self.to_beam = lambda p: turn(back, tuple(u - s for u, s in zip(p, t)))
        self.gravity = turn(back, (-GRAVITY, 0.0, 0.0))
        self.rest = {m: self.to_beam(held[m]) for m in MARKERS}
        self.frames = [{m: self.to_beam(f[m]) for m in MARKERS} for f in frames]
        self.down = tuple(v / GRAVITY for v in self.gravity)

    def drop(self, positions):
        """Mean drop of the tip's markers below where they were held [m]."""
        return sum(dot(self.down, tuple(u - v for u, v in zip(positions[m], self.rest[m]))) for m in TIPS) / 3

    def settled(self, begin, end):
        """Mean positions of the tip's markers between two times after the release [s]."""
        part = self.frames[self.start + round(begin * RATE):self.start + round(end * RATE) + 1]
        return {m: mean([f[m] for f in part]) for m in TIPS}


def write_surface(path):
    """beam.stl in metres, in the beam's frame: turned by -90 degrees about y."""
    data = (common.shared_data() / FOLDER / "beam.stl").read_bytes()
    count = struct.unpack("<I", data[80:84])[0]
    index, triangles = {}, []
    for i in range(count):
        v = struct.unpack("<12f", data[84 + 50 * i:132 + 50 * i])[3:]
        corners = [(-1e-3 * v[k + 2], 1e-3 * v[k + 1], 1e-3 * v[k]) for k in (0, 3, 6)]
        triangles.append([index.setdefault(tuple(round(c, 8) for c in p), len(index)) for p in corners])
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in index]
    lines += ["f " + " ".join(str(n + 1) for n in t) for t in triangles]
    path.write_text("\n".join(lines) + "\n")


def write_markers(path, frames):
    """frames: of the capture, each positions by marker; one frame alone has no column for it."""
    track = isinstance(frames, list)
    lines = ["frame,id,x,y,z" if track else "id,x,y,z"]
    for number, positions in enumerate(frames if track else [frames]):
        lines += [(f"{number}," if track else "") + f"{m}," + ",".join(f"{v:.9g}" for v in positions[m]) for m in TIPS]
    path.write_text("\n".join(lines) + "\n")


def write_capture(folder, recording, weight=None, hung_at=EDGE, window=None, released_at=0.0, static=None, density=DENSITY):
    """A capture of the release, its frames from the last one held to `window` seconds later; or, where `static` is a
    pair of times after the release, of the mean between them as one frame at rest.
    @param weight  hung from the points `hung_at` in equal parts [kg]
    @param released_at  of the release after the last frame held [s]: simulation begins there"""
    folder.mkdir(parents=True, exist_ok=True)
    write_surface(folder / "beam.obj")
    write_markers(folder / "rest.csv", recording.rest)
    if static:
        write_markers(folder / "track.csv", [recording.settled(*static)])
        timing = {"frame_rate": RATE, "frame_count": 1, "static": True}
    else:
        frames = recording.frames[recording.start:recording.start + round(window * RATE) + 1]
        write_markers(folder / "track.csv", frames)
        times = [released_at] + [k / RATE for k in range(1, len(frames))]
        (folder / "times.txt").write_text("".join(f"{t:.6f}\n" for t in times))
        timing = {"timestamps": "times.txt", "frame_count": len(frames), "start_frame": 0}
    hung = [{"mass": common.rounded(weight / len(hung_at)), "at": common.rounded(p)} for p in hung_at] if weight else []
    return common.write_capture(
        folder, f"silicone beam, {recording.name}", object={"surface": "beam.obj", "density": density},
        world={"gravity": common.rounded(recording.gravity)}, timing=timing,
        fixed=[{"half_space": {"point": [-0.09999, 0, 0], "normal": [-1, 0, 0]}}], weight=hung,
        markers=[{"rest": "rest.csv", "track": "track.csv"}])


def read_track(path):
    """Frames of positions by marker from a file of predicted markers."""
    frames = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            frames.setdefault(int(row["frame"]), {})[row["id"]] = tuple(float(row[c]) for c in "xyz")
    return [frames[k] for k in sorted(frames)]


def solve(A, b):
    """Gaussian elimination with pivots."""
    n = len(b)
    M = [row[:] + [v] for row, v in zip(A, b)]
    for i in range(n):
        p = max(range(i, n), key=lambda k: abs(M[k][i]))
        M[i], M[p] = M[p], M[i]
        for k in range(i + 1, n):
            f = M[k][i] / M[i][i]
            M[k] = [u - f * v for u, v in zip(M[k], M[i])]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (M[i][n] - dot(M[i][i + 1:n], x[i + 1:])) / M[i][i]
    return x


def swing(times, values, begin=0.05):
    """Frequency [Hz], damping ratio and rms left of the swing a + b t + exp(-c t) (d cos wt + e sin wt) nearest to a tip's drop.

    The first twentieth of a second is left out: there the release shows, and higher modes."""
    data = [(t, v) for t, v in zip(times, values) if t >= begin]

    def misfit(f, c):
        rows = [[1.0, t, math.exp(-c * t) * math.cos(2 * math.pi * f * t), math.exp(-c * t) * math.sin(2 * math.pi * f * t)]
                for t, _ in data]
        A = [[sum(r[i] * r[j] for r in rows) for j in range(4)] for i in range(4)]
        x = solve(A, [sum(r[i] * v for r, (_, v) in zip(rows, data)) for i in range(4)])
        return sum((v - dot(x, r)) ** 2 for r, (_, v) in zip(rows, data))

    least, f, c = min((misfit(f, c), f, c) for f in [2.5 + 0.15 * k for k in range(60)] for c in (0.5, 1.5, 4.0))
    step_f, step_c = 0.08, 0.8
    while step_f > 1e-5:
        for other in ((f + step_f, c), (f - step_f, c), (f, c + step_c), (f, c - step_c)):
            if (m := misfit(*other)) < least:
                least, (f, c) = m, other
                break
        else:
            step_f, step_c = step_f / 2, step_c / 2
    return {"frequency": f, "damping_ratio": c / (2 * math.pi * f), "rms": math.sqrt(least / len(data))}
