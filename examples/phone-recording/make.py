#!/usr/bin/env python3
"""Writes the example recording of the ring as the app Stray Scanner stores one: depth/*.png in millimetres, confidence/*.png, odometry.csv
and camera_matrix.csv. For whoever has no phone at hand: examples/phone-recording/make.py FOLDER

The recording was made by another simulator with a model of a depth sensor, not by a phone. Standard library only."""
import pathlib
import shutil
import struct
import sys
import tomllib
import zlib

RING = pathlib.Path(__file__).resolve().parents[1] / "oracle-bounce-a"
VIDEO_WIDTH = 1920


def quaternion(rotation):
    """x, y, z, w of a rotation matrix whose angle is not near half a turn, or near one about a known axis."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    w = 0.5 * max(0.0, 1 + a + e + i) ** 0.5
    if w > 1e-3:
        return (h - f) / (4 * w), (c - g) / (4 * w), (d - b) / (4 * w), w
    x = 0.5 * max(0.0, 1 + a - e - i) ** 0.5
    return x, (b + d) / (4 * x), (c + g) / (4 * x), (h - f) / (4 * x)


def even_png(width, height, value):
    """A grey image of 8 bits of one value."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = (b"\0" + bytes([value]) * width) * height
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def main():
    out = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "out/phone")
    with open(RING / "capture.toml", "rb") as file:
        capture = tomllib.load(file)
    camera, timing = capture["depth"][0], capture["timing"]
    for folder in ("depth", "confidence"):
        (out / folder).mkdir(parents=True, exist_ok=True)
    scale = VIDEO_WIDTH / camera["width"]
    matrix = [[scale * camera["fx"], 0, scale * (camera["cx"] + 0.5) - 0.5], [0, scale * camera["fy"], scale * (camera["cy"] + 0.5) - 0.5], [0, 0, 1]]
    (out / "camera_matrix.csv").write_text("".join(", ".join(f"{value:.6f}" for value in row) + "\n" for row in matrix))
    pose = camera["camera_to_world"]
    place = [row[3] for row in pose[:3]] + list(quaternion([row[:3] for row in pose[:3]]))
    sure = even_png(camera["width"], camera["height"], 2)
    lines = ["timestamp, frame, x, y, z, qx, qy, qz, qw"]
    for frame in range(timing["frame_count"]):
        shutil.copyfile(RING / (camera["images"] % frame), out / f"depth/{frame:06}.png")
        (out / f"confidence/{frame:06}.png").write_bytes(sure)
        lines.append(f"{frame / timing['frame_rate']:.6f}, {frame:06}, " + ", ".join(f"{value:.9f}" for value in place))
    (out / "odometry.csv").write_text("\n".join(lines) + "\n")
    print(out)


if __name__ == "__main__":
    main()
