"""Pictures as PNG. Standard library only."""
import struct
import zlib

SAMPLES = {0: 1, 2: 3, 6: 4}  # of a pixel, by the kind of colour: grey, (r, g, b), (r, g, b, a)


def read(path, bits=8, colours=(0,)):
    """Width, height and rows of pixels: numbers where they have one sample, else tuples.

    `colours`: the kinds that are allowed; of 16 bits grey alone."""
    content = path.read_bytes()
    width, height, found, colour = struct.unpack_from(">IIBB", content, 16)
    assert found == bits and colour in colours, f"{path}: not a {bits}-bit PNG of the kind asked for"
    size = SAMPLES[colour] * bits // 8
    at, packed = 8, b""
    while at < len(content):
        length, kind = struct.unpack_from(">I4s", content, at)
        if kind == b"IDAT":
            packed += content[at + 8:at + 8 + length]
        at += length + 12
    raw, stride, rows = zlib.decompress(packed), size * width, []
    before = bytearray(stride)
    for v in range(height):
        kind, row = raw[v * (stride + 1)], bytearray(raw[v * (stride + 1) + 1:(v + 1) * (stride + 1)])
        unfilter(kind, row, before, size)
        if bits == 16:
            rows.append(struct.unpack(f">{width}H", row))
        else:
            rows.append(list(row) if size == 1 else [tuple(row[i:i + size]) for i in range(0, stride, size)])
        before = row
    return width, height, rows


def read_depth(path):
    """Width, height and rows of a 16-bit grey picture."""
    return read(path, bits=16)


def read_colours(path):
    """Width, height and rows of (r, g, b) or (r, g, b, a)."""
    return read(path, colours=(2, 6))


def unfilter(kind, row, before, size):
    """Undoes a row's filter in place; `size`: bytes a pixel."""
    for i in range(len(row) if kind else 0):
        a, b, c = row[i - size] if i >= size else 0, before[i], before[i - size] if i >= size else 0
        if kind == 4:
            p = a + b - c
            add = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
        else:
            add = (a, b, (a + b) // 2)[kind - 1]
        row[i] = (row[i] + add) & 255


def write(path, width, height, colour, filtered, level=-1):
    """An 8-bit picture of rows of bytes, each with its filter before it."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, colour, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(filtered, level)) + chunk(b"IEND", b""))
