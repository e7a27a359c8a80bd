"""The knobbly ball against its own pixels: which of them are the ball's, how far they are from a surface, and how it lies
when it is at rest again. Standard library only."""
import csv
import math
import pathlib
import struct

import common
import png

PINHOLE = (275.0, 275.0, 160.0, 120.0)
SHADES = 2  # pixels to each side whose majority must be red, too


def pixels(data, frame):
    """Points [m] of the owners' mask in a frame, and whether each is as red as the ball; None where there is no picture in
    colour. Skin is yellower than the ball: a pixel is the ball's where it and most of those about it are red and at least
    as blue as they are green."""
    width, height, depth = png.read_depth(data / f"depth/{frame:06d}.png")
    mask = png.read_colours(data / f"mask_ball/{frame:06d}.png")[2]
    picture = data / f"color/{frame:06d}.png"
    red = None
    if picture.exists():
        colours = png.read_colours(picture)[2]
        red = [[r - g > 40 and b - g > -5 for r, g, b in row] for row in colours]
    fx, fy, cx, cy = PINHOLE
    points, is_ball = [], []
    for v in range(SHADES, height - SHADES):
        for u in range(SHADES, width - SHADES):
            if depth[v][u] == 0 or mask[v][u][3] == 0:
                continue
            z = 1e-3 * depth[v][u]
            points.append(((u - cx) / fx * z, (v - cy) / fy * z, z))
            if red:
                about = sum(sum(row[u - SHADES:u + SHADES + 1]) for row in red[v - SHADES:v + SHADES + 1])
                is_ball.append(red[v][u] and about >= 0.7 * (2 * SHADES + 1) ** 2)
    return points, is_ball if red else None


class Surface:
    """Distances to a triangle mesh: to the triangles about the nearest vertex."""

    def __init__(self, vertices, triangles, cell=0.006):
        self.vertices, self.cell, self.about = vertices, cell, [[] for _ in vertices]
        for t in triangles:
            for v in t:
                self.about[v].append(t)
        self.cells = {}
        for i, p in enumerate(vertices):
            self.cells.setdefault(self.cell_of(p), []).append(i)

    def cell_of(self, p):
        return tuple(math.floor(x / self.cell) for x in p)

    def nearest_vertex(self, p, farthest=8):
        a, b, c = self.cell_of(p)
        best, index = math.inf, -1
        for ring in range(farthest):
            if index >= 0 and best <= ((ring - 1) * self.cell) ** 2:
                break
            for i in range(a - ring, a + ring + 1):
                for j in range(b - ring, b + ring + 1):
                    on_side = max(abs(i - a), abs(j - b)) == ring
                    for k in range(c - ring, c + ring + 1) if on_side else {c - ring, c + ring}:
                        for v in self.cells.get((i, j, k), ()):
                            q = self.vertices[v]
                            d = (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2
                            if d < best:
                                best, index = d, v
        return index

    def nearest(self, p):
        """The nearest place of the surface; None beyond a few cells."""
        v = self.nearest_vertex(p)
        if v < 0:
            return None
        return min((closest(p, *(self.vertices[i] for i in t)) for t in self.about[v]), key=lambda q: math.dist(p, q))

    def distance(self, p):
        q = self.nearest(p)
        return 8 * self.cell if q is None else math.dist(p, q)


def closest(p, a, b, c):
    """The place of a triangle that is nearest to p (Ericson 2005, section 5.1.5)."""
    sub = lambda u, v: (u[0] - v[0], u[1] - v[1], u[2] - v[2])
    dot = lambda u, v: u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
    along = lambda u, v, t: (u[0] + t * v[0], u[1] + t * v[1], u[2] + t * v[2])
    ab, ac, ap = sub(b, a), sub(c, a), sub(p, a)
    d1, d2 = dot(ab, ap), dot(ac, ap)
    if d1 <= 0 and d2 <= 0:
        return a
    bp = sub(p, b)
    d3, d4 = dot(ab, bp), dot(ac, bp)
    if d3 >= 0 and d4 <= d3:
        return b
    cp = sub(p, c)
    d5, d6 = dot(ab, cp), dot(ac, cp)
    if d6 >= 0 and d5 <= d6:
        return c
    vc, vb, va = d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4
    if vc <= 0 <= d1 and d3 <= 0:
        return along(a, ab, d1 / (d1 - d3))
    if vb <= 0 <= d2 and d6 <= 0:
        return along(a, ac, d2 / (d2 - d6))
    if va <= 0 and d4 >= d3 and d5 >= d6:
        return along(b, sub(c, b), (d4 - d3) / ((d4 - d3) + (d5 - d6)))
    whole = va + vb + vc
    return along(along(a, ab, vb / whole), ac, vc / whole)


def read_triangles(path):
    """Of a PLY surface as `pliant scan` writes it."""
    data = pathlib.Path(path).read_bytes()
    end = data.index(b"end_header\n") + 11
    head = data[:end].decode().splitlines()
    of = {line.split()[1]: int(line.split()[2]) for line in head if line.startswith("element")}
    at = len(data) - 13 * of["face"]
    return [struct.unpack_from("<iii", data, at + 13 * i + 1) for i in range(of["face"])]


def write_points(path, vertices):
    with open(path, "w") as file:
        file.write("id,x,y,z\n")
        file.writelines(f"v{i},{p[0]:.9g},{p[1]:.9g},{p[2]:.9g}\n" for i, p in enumerate(vertices))


def read_track(path, count, frames):
    """Places [m] of all points in the given frames: {frame: [(x, y, z)]}."""
    wanted, found = {str(f) for f in frames}, {}
    with open(path) as file:
        next(file)
        for line in file:
            frame, name, x, y, z = line.split(",")
            if frame in wanted:
                found.setdefault(int(frame), [None] * count)[int(name[1:])] = (float(x), float(y), float(z))
    return found


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values)) if values else None


def turned(p, angle, axis, about, shift):
    """p turned by an angle about an axis through a place, then shifted."""
    r = [p[d] - about[d] for d in range(3)]
    along = sum(r[d] * axis[d] for d in range(3))
    cross = (axis[1] * r[2] - axis[2] * r[1], axis[2] * r[0] - axis[0] * r[2], axis[0] * r[1] - axis[1] * r[0])
    c, s = math.cos(angle), math.sin(angle)
    return tuple(about[d] + c * r[d] + s * cross[d] + (1 - c) * along * axis[d] + shift[d] for d in range(3))


def lay(surface, middle, points, up, rounds=60, trimmed=0.95):
    """How a rigid surface lies on a table so that it passes through points: its angle about the vertical [rad] and its
    shift along the table [m], by iterated closest points; and the distances that are left [m]. It is turned about
    `middle`, the middle of what was seen of it before it moved. Of each round's points the farthest are passed over."""
    level = tuple(a / math.hypot(*up) for a in up)
    first = (1.0, 0.0, 0.0)
    u = tuple(first[d] - common.dot(first, level) * level[d] for d in range(3))
    u = tuple(x / math.hypot(*u) for x in u)
    v = (level[1] * u[2] - level[2] * u[1], level[2] * u[0] - level[0] * u[2], level[0] * u[1] - level[1] * u[0])
    centre = common.mean(points)
    angle, shift = 0.0, tuple(common.dot([centre[d] - middle[d] for d in range(3)], u) * u[d] +
                                      common.dot([centre[d] - middle[d] for d in range(3)], v) * v[d] for d in range(3))
    left = []
    for _ in range(rounds):
        # Points are brought into the axes of the surface at rest.
        pairs = []
        for p in points:
            q = turned(tuple(p[d] - shift[d] for d in range(3)), -angle, level, middle, (0.0, 0.0, 0.0))
            s = surface.nearest(q)
            if s is not None:
                pairs.append((math.dist(q, s), p, turned(s, angle, level, middle, shift)))
        pairs.sort(key=lambda t: t[0])
        left = [t[0] for t in pairs] + [8 * surface.cell] * (len(points) - len(pairs))
        kept = pairs[:int(trimmed * len(pairs))]
        a, b = common.mean([t[1] for t in kept]), common.mean([t[2] for t in kept])
        sine = cosine = 0.0
        for _, p, s in kept:
            pu, pv = (common.dot([p[d] - a[d] for d in range(3)], w) for w in (u, v))
            su, sv = (common.dot([s[d] - b[d] for d in range(3)], w) for w in (u, v))
            cosine += su * pu + sv * pv
            sine += su * pv - sv * pu
        turn = math.atan2(sine, cosine)
        # The surface is turned about the middle of its places, then shifted: both along the table.
        at = tuple(middle[d] + shift[d] for d in range(3))
        at_turned = turned(at, turn, level, b, (0.0, 0.0, 0.0))
        step = [a[d] - b[d] + at_turned[d] - at[d] for d in range(3)]
        along_u, along_v = common.dot(step, u), common.dot(step, v)
        shift = tuple(shift[d] + along_u * u[d] + along_v * v[d] for d in range(3))
        angle += turn
        if abs(turn) < 1e-5 and math.hypot(along_u, along_v) < 1e-6:
            break
    return {"angle": angle, "shift": shift, "distances": left, "place": lambda p: turned(p, angle, level, middle, shift)}
