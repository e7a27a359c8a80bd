"""Closed surfaces of the pressed bodies: a head over a skull, a pillow. Standard library only."""
import math


def sphere(subdivisions):
    """Directions and triangles of an icosahedron that is cut so often."""
    t = (1 + math.sqrt(5)) / 2
    points = [unit(p) for p in ((-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t), (0, -1, -t), (0, 1, -t),
                                (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1))]
    triangles = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
                 (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(subdivisions):
        middles, finer = {}, []

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(points)
                points.append(unit(tuple((x + y) / 2 for x, y in zip(points[a], points[b]))))
            return middles[key]

        for a, b, c in triangles:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        triangles = finer
    return points, triangles


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return tuple(x / length for x in v)


def write_obj(path, surface):
    points, triangles = surface
    path.write_text("".join(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in points) + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in triangles))


SKULL = (0.065, 0.09, 0.08)  # semi-axes [m]: x to the left, y up, z to the front


def skull(direction, offset=0.0):
    return tuple((axis + offset) * d for axis, d in zip(SKULL, direction))


def head(direction):
    """The skin over the skull: a layer of 11 mm, thicker on cheeks, nose and chin."""
    thickness = 0.011
    for place, width, height in (((0.55, -0.3, 0.75), 0.45, 0.005), ((-0.55, -0.3, 0.75), 0.45, 0.005), ((0.0, -0.1, 1.0), 0.18, 0.012), ((0.0, -0.75, 0.7), 0.3, 0.004)):
        angle = math.acos(max(-1.0, min(1.0, sum(a * b for a, b in zip(direction, unit(place))))))
        thickness += height * math.exp(-(angle / width)**2)
    return skull(direction, thickness)


def pillow(direction, half=(0.14, 0.045, 0.10)):
    """A cushion: a superellipsoid with corners drawn out, thinner at its seam."""
    x, y, z = direction
    flat = (abs(x)**3 + abs(z)**3 + abs(y)**2.2 + 1e-12)
    scale = flat**(-1.0 / 2.6)
    return tuple(h * scale * d for h, d in zip(half, direction))


def surface(shape, subdivisions):
    points, triangles = sphere(subdivisions)
    return [shape(p) for p in points], triangles
