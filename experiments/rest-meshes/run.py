#!/usr/bin/env python3
"""Volume meshes that other programs made: what `pliant mesh` says of each, and how far each sags under gravity when one end
is held, with its own linear elements and with mid nodes on their edges. Standard library only."""
import base64
import json
import math
import pathlib
import re
import struct
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import common

# Length of the file's unit [m], by the folder's description; where that says nothing, such that the object is hand-sized.
MESHES = {"liver.msh": 0.1, "liver2.msh": 0.1, "Armadillo_Tetra_4406.vtu": 0.01, "squirrel10.vtu": 1.0,
          "finger.vtk": 1e-3, "trunk.vtk": 1e-3, "cylinder1513.vtk": 1.0}
ASSUMED_UNITS = ["Armadillo_Tetra_4406.vtu"]
DENSITY, POISSON, GRAVITY = 1000.0, 0.45, 9.81
STIFFNESS = 1000.0  # Young's modulus over the weight of a column as long as the object


def array(text, name):
    """A binary array of a .vtu that the program wrote."""
    found = re.search(rf'<DataArray type="(\w+)" Name="{re.escape(name)}"[^>]*>([^<]*)<', text)
    raw = base64.b64decode(found[2])[8:]
    code = {"Float64": "d", "Float32": "f"}[found[1]]
    return struct.unpack(f"<{len(raw) // struct.calcsize(code)}{code}", raw)


def sag(program, folder, extent):
    """Greatest displacement [m] under gravity across the longest axis, a tenth of which is held at its low end."""
    points = array((folder / "mesh.vtu").read_text(), "points")
    axis = extent.index(max(extent))
    least = min(points[axis::3])
    down = 2 if axis != 2 else 1
    unit = lambda d, sign: [sign * float(k == d) for k in range(3)]
    modulus = STIFFNESS * DENSITY * GRAVITY * extent[axis]
    point = [0.0, 0.0, 0.0]
    point[axis] = least + 0.1 * extent[axis]
    figures = json.loads((folder / "mesh.json").read_text())
    (folder / "model.toml").write_text(f"""format = "model/1"
name = "sag"
[object]
volume_mesh = "mesh.vtu"
density = {DENSITY}
mass = {DENSITY * figures["volume"]!r}
[material]
youngs_modulus = {modulus!r}
poissons_ratio = {POISSON}
[world]
gravity = {[GRAVITY * v for v in unit(down, -1.0)]}
[simulation]
cell_size = {max(extent) / 12!r}
grid_origin = [0.0, 0.0, 0.0]
[[fixed]]
half_space = {{ point = {point}, normal = {unit(axis, -1.0)} }}
""")
    done = subprocess.run([str(program), "simulate", str(folder / "model.toml"), "--out", str(folder / "sag")], capture_output=True, text=True)
    if done.returncode != 0:
        return {"failure": done.stderr.strip().replace(str(folder) + "/", "").splitlines()[-1]}
    text = next((folder / "sag/frames").glob("*.vtu")).read_text()
    name = next(n for n in re.findall(r'Name="([^"]*)"', text) if n.startswith("displacement"))
    u = array(text, name)
    return {"sag": common.number(max(math.dist((0, 0, 0), u[i:i + 3]) for i in range(0, len(u), 3)) / extent[axis], 4)}


def main():
    arguments = common.arguments(__doc__)
    meshes = {}
    for name, unit in MESHES.items():
        for order in ("linear", "quadratic"):
            folder = arguments.work / f"{name}-{order}"
            words = ["mesh", common.shared_data() / "rest-meshes" / name, "--unit", unit, "--out", folder]
            done = subprocess.run([str(arguments.program), *map(str, words), *(["--quadratic"] if order == "quadratic" else [])],
                                  capture_output=True, text=True)
            if done.returncode != 0:
                meshes[name] = {"failure": done.stderr.strip().replace(str(common.shared_data()) + "/", "")}
                break
            figures = json.loads((folder / "mesh.json").read_text())
            entry = meshes.setdefault(name, {"unit": unit, "unit_is_assumed": name in ASSUMED_UNITS, **figures})
            entry[order] = sag(arguments.program, folder, figures["extent"])
    surfaces = sorted(p.name for p in (common.shared_data() / "rest-meshes").iterdir() if p.suffix in (".obj", ".stl"))
    common.write_results(__file__, {"stiffness": STIFFNESS, "poisson_ratio": POISSON, "density": DENSITY, "meshes": meshes, "surfaces": surfaces})


if __name__ == "__main__":
    main()
