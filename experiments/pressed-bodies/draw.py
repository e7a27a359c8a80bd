"""A surface in colours as PNG, by a depth buffer. Standard library only."""
import math
import struct
import zlib


def turned(point, right, up, towards):
    return tuple(sum(a * b for a, b in zip(point, axis)) for axis in (right, up, towards))


def surface(path, points, triangles, colours, view, width=420, height=420, box=None):
    """Draws triangles, one colour (r, g, b) each, as they are seen against a direction.

    view: unit vectors to the right, up, and towards the eye. box: low and high corner of what is seen across the view [m]."""
    seen = [turned(p, *view) for p in points]
    if box is None:
        box = [[f(p[d] for p in seen) for d in range(2)] for f in (min, max)]
    scale = 0.94 * min(width / (box[1][0] - box[0][0]), height / (box[1][1] - box[0][1]))
    middle = [(a + b) / 2 for a, b in zip(*box)]
    pixels, depths = bytearray(b"\xff" * (3 * width * height)), [-math.inf] * (width * height)
    light = (-0.3, 0.5, 0.81)
    for triangle, colour in zip(triangles, colours):
        corners = [((seen[i][0] - middle[0]) * scale + width / 2, height / 2 - (seen[i][1] - middle[1]) * scale, seen[i][2]) for i in triangle]
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = corners
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area >= 0:  # faces away: y points down in a picture
            continue
        a, b, c = (seen[i] for i in triangle)
        u, v = [y - x for x, y in zip(a, b)], [y - x for x, y in zip(a, c)]
        normal = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        length = math.sqrt(sum(n * n for n in normal)) or 1.0
        bright = 0.45 + 0.55 * max(0.0, sum(n * l for n, l in zip(normal, light)) / length)
        shade = bytes(min(255, round(bright * channel)) for channel in colour)
        for y in range(max(0, math.floor(min(ay, by, cy))), min(height, math.ceil(max(ay, by, cy)) + 1)):
            for x in range(max(0, math.floor(min(ax, bx, cx))), min(width, math.ceil(max(ax, bx, cx)) + 1)):
                q = ((bx - x) * (cy - y) - (cx - x) * (by - y)) / area
                r = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) / area
                s = 1.0 - q - r
                if min(q, r, s) < -1e-6:
                    continue
                z = q * az + r * bz + s * cz
                if z > depths[y * width + x]:
                    depths[y * width + x] = z
                    pixels[3 * (y * width + x):3 * (y * width + x) + 3] = shade
    return width, height, pixels


def beside(pictures):
    """Pictures of one height, from left to right."""
    height = pictures[0][1]
    rows = bytearray()
    for y in range(height):
        for width, _, pixels in pictures:
            rows += pixels[3 * y * width:3 * (y + 1) * width]
    return sum(p[0] for p in pictures), height, rows


def write(path, picture):
    width, height, pixels = picture
    raw = b"".join(b"\0" + bytes(pixels[3 * width * y:3 * width * (y + 1)]) for y in range(height))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))
