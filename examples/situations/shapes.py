"""Closed surfaces of implicit shapes: marching tetrahedra (Doi and Koide 1991). Standard library only."""
import math

CORNERS = [(i & 1, i >> 1 & 1, i >> 2 & 1) for i in range(8)]
TETRAHEDRA = [(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)]


def sub(a, b):
    return [x - y for x, y in zip(a, b)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def rod(a, b, radius):
    """Signed distance of a rod with round ends; the radius may be another at b."""
    radii = radius if isinstance(radius, tuple) else (radius, radius)
    along = sub(b, a)
    length = dot(along, along)

    def distance(p):
        s = min(1.0, max(0.0, dot(sub(p, a), along) / length))
        return math.dist(p, [x + s * d for x, d in zip(a, along)]) - (radii[0] + s * (radii[1] - radii[0]))
    return distance


def ellipsoid(centre, half, axes=((1, 0, 0), (0, 1, 0), (0, 0, 1))):
    def distance(p):
        q = sub(p, centre)
        scaled = [dot(q, axis) / h for axis, h in zip(axes, half)]
        k = math.hypot(*scaled)
        return (k - 1.0) * min(half) if k < 1e-9 else (k - 1.0) * k / math.hypot(*(s / h for s, h in zip(scaled, half)))
    return distance


def box(centre, half, edge):
    def distance(p):
        q = [abs(x) - h + edge for x, h in zip(sub(p, centre), half)]
        return math.hypot(*(max(x, 0.0) for x in q)) + min(max(q), 0.0) - edge
    return distance


def union(*parts, blend=0.0):
    """The nearest; `blend` [m] rounds the corners between them."""
    def distance(p):
        values = [part(p) for part in parts]
        nearest = min(values)
        if blend <= 0.0:
            return nearest
        return nearest - blend * math.log(sum(math.exp((nearest - v) / blend) for v in values))
    return distance


def surface(function, low, high, spacing):
    """Vertices and triangles where the function is zero, triangles counter-clockwise seen from outside."""
    count = [int(math.ceil((h - l) / spacing)) + 1 for l, h in zip(low, high)]
    at = lambda i, j, k: (low[0] + i * spacing, low[1] + j * spacing, low[2] + k * spacing)
    values = {(i, j, k): function(at(i, j, k)) for i in range(count[0]) for j in range(count[1]) for k in range(count[2])}
    vertices, numbers, triangles = [], {}, []

    def vertex(a, b):
        key = (a, b) if a < b else (b, a)
        if key not in numbers:
            fa, fb = values[key[0]], values[key[1]]
            s = min(0.95, max(0.05, fa / (fa - fb)))
            pa, pb = at(*key[0]), at(*key[1])
            numbers[key] = len(vertices)
            vertices.append([x + s * (y - x) for x, y in zip(pa, pb)])
        return numbers[key]

    for i in range(count[0] - 1):
        for j in range(count[1] - 1):
            for k in range(count[2] - 1):
                cell = [(i + a, j + b, k + c) for a, b, c in CORNERS]
                inside = [values[c] < 0.0 for c in cell]
                if all(inside) or not any(inside):
                    continue
                for tet in TETRAHEDRA:
                    here = [cell[c] for c in tet]
                    within = [c for c in here if values[c] < 0.0]
                    outside = [c for c in here if values[c] >= 0.0]
                    if len(within) == 1 or len(outside) == 1:
                        one, others = (within[0], outside) if len(within) == 1 else (outside[0], within)
                        faces = [[vertex(one, other) for other in others]]
                    elif len(within) == 2:
                        (a, b), (c, d) = within, outside
                        quad = [vertex(a, c), vertex(a, d), vertex(b, d), vertex(b, c)]
                        faces = [quad[:3], [quad[0], quad[2], quad[3]]]
                    else:
                        continue
                    inner = [sum(at(*c)[x] for c in within) / len(within) for x in range(3)]
                    for face in faces:
                        p = [vertices[v] for v in face]
                        u, w = sub(p[1], p[0]), sub(p[2], p[0])
                        normal = [u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]]
                        triangles.append(face if dot(normal, sub(p[0], inner)) > 0.0 else face[::-1])
    return vertices, triangles


def write_obj(path, mesh):
    vertices, triangles = mesh
    with open(path, "w") as out:
        for v in vertices:
            out.write("v %.6f %.6f %.6f\n" % tuple(v))
        for t in triangles:
            out.write("f %d %d %d\n" % tuple(i + 1 for i in t))
