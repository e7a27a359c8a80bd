#!/usr/bin/env python3
"""A sheet held along one edge: a release, recorded as clouds by another simulator (other elements, another material law), and six hung
weights that a fit of the release does not see (Wang et al. 2015, figure 10 and table 3).

The release is fitted with no choice of ours; the clouds under the weights and then the true shapes are compared with the model's
equilibria. truth.json and truth/ are read for judging only. Standard library only."""
import pathlib
import re
import struct
import sys
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

SET = "oracle-load"
NAMES = ["youngs_modulus", "poisson_ratio", "mass_damping", "stiffness_damping"]


def write_points(path, points):
    path.write_text("id,x,y,z\n" + "".join(f"{i},{x:.9g},{y:.9g},{z:.9g}\n" for i, (x, y, z) in enumerate(points)))


def true_shapes(source):
    """Surface vertices [m] under each weight, in the order of the scan."""
    with zipfile.ZipFile(source / "truth/loads.npz") as archive:
        (loads, count, _), q = common.read_array(archive, "q")
        scale = common.read_array(archive, "scale")[1][0]
    value = lambda k: scale * q[k]
    return [[tuple(value(3 * (count * load + n) + d) for d in range(3)) for n in range(count)] for load in range(loads)]


def scanned(source, count):
    """The scan's vertices, doubles."""
    ply = (source / "rest.ply").read_bytes()
    values = struct.unpack_from(f"<{3 * count}d", ply, ply.index(b"end_header\n") + 11)
    return [tuple(values[3 * n:3 * n + 3]) for n in range(count)]


def judge(source, work):
    """The loads with the true surface's vertices as markers: what evaluation then tells are node distances."""
    folder = work / "judge"
    folder.mkdir(parents=True, exist_ok=True)
    shapes = true_shapes(source)
    write_points(folder / "rest.csv", scanned(source, len(shapes[0])))
    text = (source / "capture.toml").read_text()
    loads = text[text.index("[[load]]"):]
    for i, shape in enumerate(shapes):
        write_points(folder / f"{i:03}.csv", shape)
        loads = loads.replace(f'cloud = "load/{i:03}.ply"', f'markers = "{i:03}.csv"\nmarkers_rest = "rest.csv"')
    without_frames = re.sub(r"\[(timing|initial|\[cloud\])\]\n(?:.+\n)+\n", "", text[:text.index("[[load]]")])
    (folder / "capture.toml").write_text(without_frames + loads)
    if not (folder / "rest.ply").is_symlink():
        (folder / "rest.ply").symlink_to((source / "rest.ply").resolve())
    return folder


def with_material(model, out, values, finer=1.0):
    """The model's scene with another material, on a grid that is so much finer."""
    out.mkdir(parents=True, exist_ok=True)
    text = re.sub(r"volume_mesh = .*\n", "", model.read_text())  # the elements' own moduli
    for key, name in (("youngs_modulus", "youngs_modulus"), ("poissons_ratio", "poisson_ratio"), ("density", "density"), ("mass", "mass")):
        text, changes = re.subn(rf"(?m)^{key} *= *\S+", f"{key} = {values[name]['value']}", text)
        assert changes == 1, key
    text = re.sub(r"(?m)^cell_size *= *(\S+)", lambda m: f"cell_size = {float(m[1]) / finer}", text)
    (out / "model.toml").write_text(text)
    (out / "surface.ply").write_bytes((model.parent / "surface.ply").read_bytes())
    return out / "model.toml"


def figures_of(loads):
    keys = ("points", "outliers", "mean", "max", "relative_mean", "relative_max")
    return [{"name": l["name"], **{k: l[k] if isinstance(l[k], int) else common.number(l[k], 4) for k in keys}} for l in loads]


def main():
    arguments = common.arguments(__doc__)
    source, work = common.shared_data() / SET, arguments.work
    fit = common.fit(arguments.program, source, work / "fit")
    model = work / "fit/model.toml"
    result, truth = fit.pop("result"), common.read(source / "truth.json")
    values = truth["parameters"]
    seen = common.evaluate(arguments.program, model, source, work / "clouds.json")
    folder = judge(source, work)
    judged = {"fitted": model, "true material": with_material(model, work / "true", values),
              "true material, cells half as long": with_material(model, work / "true-half", values, 2.0),
              "true material, a quarter": with_material(model, work / "true-quarter", values, 4.0)}
    nodes = {name: figures_of(common.evaluate(arguments.program, path, folder, work / f"{path.parent.name}.json")["loads"])
             for name, path in judged.items()}
    common.write_results(__file__, {
        "parameters": {k: {"value": common.number(p["value"]), "std": common.number(p.get("std"), 2), "unit": p["unit"],
                           "truth": values[k]["value"]} for k, p in result["parameters"].items() if k in NAMES},
        "surface_rms": common.number(result["error"]["surface_rms"], 4), "converged": fit["exit_code"] == 0,
        "commit": result["software"]["commit"], "notes": result.get("notes", []), **fit,
        "loads": [{"mass": l["mass_kg"], "moved": common.number(l["max_displacement_from_static_m"], 4)} for l in truth["loads"]],
        "clouds": figures_of(seen["loads"]), "nodes": nodes})
    for name, loads in nodes.items():
        print(f"{name}: mean node distances " + ", ".join(f"{100 * l['relative_mean']:.2f} %" for l in loads))


if __name__ == "__main__":
    main()
