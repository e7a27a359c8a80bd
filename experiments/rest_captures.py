"""Captures whose rest surface is made of a recording's own frames by `pliant scan`. Standard library only.

The recordings' images stay where they are: captures refer to them by relative paths."""
import argparse
import json
import os
import pathlib
import struct
import subprocess
import sys

import common
import png

ROOT = pathlib.Path(__file__).resolve().parent.parent


def shared_data():
    """The folder of shared recordings: PLIANT_SHARED_DATA, or beside the source tree."""
    data = pathlib.Path(os.environ.get("PLIANT_SHARED_DATA", ROOT.parent / "shared/data")).resolve()
    if not data.is_dir():
        sys.exit(f"no folder {data}: set PLIANT_SHARED_DATA to the shared recordings")
    return data


def arguments(description, name):
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", nargs="?", type=pathlib.Path, default=ROOT / "build/release/apps/pliant",
                        help="the pliant binary")
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "build/captures" / name,
                        help="folder for the captures; outside of version control")
    parsed = parser.parse_args()
    parsed.program, parsed.work = parsed.program.resolve(), parsed.work.resolve()
    return parsed


def pattern(folder, data, name):
    """A pattern of images of the shared recordings, relative to a capture's folder."""
    return os.path.relpath(data / name, folder)


def refer(link, target):
    """A file of the recording under another name: frames that are renumbered."""
    link.parent.mkdir(parents=True, exist_ok=True)
    link.unlink(missing_ok=True)
    link.symlink_to(os.path.relpath(target, link.parent))


def depth_camera(name, size, pinhole, images, masks):
    """Sensors of a capture: one camera whose readings are millimetres and whose axes are the world's; `pinhole` is fx, fy,
    cx, cy."""
    return {"depth": [{"name": name, **dict(zip(("width", "height"), size)), **dict(zip(("fx", "fy", "cx", "cy"), pinhole)),
                       "camera_to_world": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "images": images,
                       "depth_scale": 1000.0, "masks": masks}]}


def write_capture(folder, name, sensors, frames, up, surface=None, density=None, plane=None, static=False, start=0,
                  frame_rate=30.0):
    """Writes capture.toml; `sensors` are its blocks `depth` or `cloud`. The frame rate is nominal: the recordings state none;
    the density is a guess: nobody weighed the objects."""
    plane = [{"point": common.rounded(plane["point"], 6), "normal": common.rounded(plane["normal"], 6), "known": True}] if plane else []
    world = {"gravity": common.rounded([-9.81 * x for x in up], 6)} if surface else {"up": common.rounded(up, 6)}
    common.write_capture(
        folder, name, object={"surface": os.path.relpath(surface, folder) if surface else None, "density": density},
        world=world, timing={"frame_rate": frame_rate, "frame_count": frames, "start_frame": start, "static": static},
        plane=plane, **sensors)


def call(program, *words):
    done = subprocess.run([str(program), *map(str, words)], capture_output=True, text=True)
    print(done.stdout, end="")
    if done.returncode != 0:
        sys.exit(f"pliant {' '.join(map(str, words))} returned {done.returncode}\n{done.stderr}")


def scan(program, folder, *options):
    """Runs `pliant scan`; returns its figures. The surface is `folder`/rest/rest.ply."""
    call(program, "scan", folder, "--out", folder / "rest", *options)
    return json.loads((folder / "rest/scan.json").read_text())


def check(program, folder):
    call(program, "check", folder, "--out", folder / "look")


def vertices(path):
    """Vertices of a PLY as `pliant scan` writes it."""
    header, data = path.read_bytes().split(b"end_header\n", 1)
    count = int(header.split(b"element vertex ")[1].split(b"\n")[0])
    return [struct.unpack_from("<ddd", data, 25 * i) for i in range(count)]


def write_mask(path, width, rows):
    png.write(path, width, len(rows), 0, b"".join(b"\0" + bytes(row) for row in rows))


def mask_of_box(image, pinhole, box, plane, clearance=0.004):
    """255 where the reading lies in a box of the camera's axes and above the plane, both in camera axes [m]; depth in
    millimetres."""
    width, height, rows = image
    fx, fy, cx, cy = pinhole
    low, high = box
    n, offset = plane["normal"], sum(a * b for a, b in zip(plane["point"], plane["normal"])) + clearance
    mask = [bytearray(width) for _ in range(height)]
    for v in range(height):
        for u, raw in enumerate(rows[v]):
            z = 1e-3 * raw
            if not low[2] <= z <= high[2]:
                continue
            x, y = (u - cx) / fx * z, (v - cy) / fy * z
            if low[0] <= x <= high[0] and low[1] <= y <= high[1] and n[0] * x + n[1] * y + n[2] * z > offset:
                mask[v][u] = 255
    return mask


def box_of(points, margin):
    return [min(p[k] for p in points) - margin for k in range(3)], [max(p[k] for p in points) + margin for k in range(3)]
