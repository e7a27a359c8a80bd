#!/usr/bin/env python3
"""Exported models in the programs that they were written for: sag and first frequency there beside pliant's own.

    python3 -m venv exports && exports/bin/pip install -r experiments/exports/requirements.txt
    apt-get install calculix-ccx
    exports/bin/python experiments/exports/run.py build/release/apps/pliant [--models FOLDER ...] [--work DIR]

FOLDERs hold a model.toml each; left out: three recordings of the battery are fitted first, with no choice of ours. What is not installed is left out, by name. Gravity is a hundredth of the
model's where a program knows large strains alone (more where it has single precision), and its sag as many times what is seen: small motions are compared."""
import importlib.util
import math
import pathlib
import re
import shutil
import subprocess
import sys
import time
import xml.etree.ElementTree

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import common

SMALL = 0.01  # of gravity
SMALL_SAG = 0.025  # [m] of gravity where positions have single precision, which shorter ways drown in
CELLS = {"mujoco": 32, "newton": 32}  # their steps are slow on a processor; others have the mesh that the program chooses
BATTERY = ("hang-03", "release-06", "release-02")


def exported(program, model, out, to):
    """The files of a format, and what `export.json` tells; nothing where the format has no elements."""
    out.mkdir(parents=True, exist_ok=True)
    common.run(program, "export", model / "model.toml", "--to", to, "--out", out, *(["--cells", CELLS[to]] if to in CELLS else []))
    return common.read(out / "export.json") if (out / "export.json").exists() else {}


def period_and_mean(times, values):
    """Of a swing about its mean from rest: the first return, and the mean over it."""
    top = max(range(len(values)), key=lambda i: values[i] if times[i] < times[-1] else -1)
    rising = [i for i in range(1, len(values) - 1) if values[i] >= values[i - 1] and values[i] > values[i + 1]]
    first = rising[0] if rising else top
    return 2 * times[first], 0.5 * values[first]


def calculix(folder, about):
    if not shutil.which("ccx"):
        return None
    for deck in ("frequencies", *(["sag"] if about["exported"]["sag"] > 0 else [])):
        subprocess.run(["ccx", deck], cwd=folder, stdout=subprocess.DEVNULL, check=True)
    hertz = [float(line.split()[3]) for line in (folder / "frequencies.dat").read_text().splitlines()
             if re.match(r"\s+\d+\s+\S+E\S+\s+\S+E\S+\s+\S+E\S+\s+\S+E\S+\s*$", line)]
    hertz = [f for f in hertz if f > 1e-2 * about["exported"]["frequencies"][0]]  # without rigid motions
    sag = 0.0
    if (folder / "sag.dat").exists():
        for line in (folder / "sag.dat").read_text().splitlines():
            words = line.split()
            if len(words) == 4 and words[0].isdigit():
                sag = max(sag, math.sqrt(sum(float(w) ** 2 for w in words[1:])))
    version = subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout.split()
    return {"version": version[-1] if version else "", "frequencies": hertz[:6], "sag": sag}


def mujoco(folder, about):
    try:
        import mujoco as mj
        import numpy as np
    except ImportError:
        return None
    model = mj.MjModel.from_xml_path(str(folder / "model.xml"))
    data = mj.MjData(model)
    result = {"version": mj.__version__, "timestep": model.opt.timestep}
    if about["exported"]["sag"] == 0:
        return result  # falls: nothing to compare
    model.opt.gravity[:] = SMALL * model.opt.gravity
    mj.mj_forward(model, data)
    rest = data.xpos.copy()
    times, moved = [0.0], [0.0]
    begin = time.monotonic()
    while data.time < 1.2 / about["exported"]["frequencies"][0]:
        mj.mj_step(model, data)
        times.append(data.time)
        moved.append(float(np.linalg.norm(data.xpos - rest, axis=1).max()))
    period, mean = period_and_mean(times, moved)
    return {**result, "frequencies": [1 / period], "sag": mean / SMALL, "ms_per_step": 1e3 * (time.monotonic() - begin) / len(times)}


def newton(folder, about):
    """By the scene that was exported, on the processor: from rest under little gravity, half a period is where it is farthest."""
    try:
        import newton as nt
        import numpy as np
        import warp as wp
    except ImportError:
        return None
    wp.config.quiet = True
    spec = importlib.util.spec_from_file_location("scene", folder / "scene.py")
    scene = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(scene)
    result = {"version": nt.__version__, "sweeps": scene.SWEEPS, "step": scene.STEP}
    if not about["held_nodes"]:
        return result
    part = min(1.0, SMALL_SAG / about["exported"]["sag"])
    model = scene.build(gravity=part, device="cpu")
    rest = model.particle_q.numpy().copy()
    times, moved = [0.0], [0.0]

    def on_step(now, positions):
        times.append(now)
        moved.append(float(np.linalg.norm(positions - rest, axis=1).max()))

    begin = time.monotonic()
    scene.run(model, 0.65 / about["exported"]["frequencies"][0], on_step)
    smooth = np.convolve(moved, np.ones(15) / 15, mode="same")[:-7].tolist()  # of single precision's steps
    period, mean = period_and_mean(times, smooth)
    return {**result, "gravity": part, "frequencies": [1 / period], "sag": mean / part, "ms_per_step": 1e3 * (time.monotonic() - begin) / len(times)}


def gmsh(folder, about):
    try:
        import meshio
    except ImportError:
        return None
    mesh = meshio.read(folder / "mesh.msh")
    kind = "tetra10" if about["quadratic"] else "tetra"
    return {"version": f"meshio {meshio.__version__}", "nodes": len(mesh.points), "held": int((mesh.point_data["held"] > 0).sum()), "elements": len(mesh.cells_dict[kind])}


def usd(folder, about):
    try:
        from pxr import Usd, UsdGeom
    except ImportError:
        return None
    stage = Usd.Stage.Open(str(folder / "model.usda"))
    mesh = UsdGeom.TetMesh(stage.GetPrimAtPath("/object/mesh"))
    return {"version": ".".join(str(n) for n in Usd.GetVersion()), "nodes": len(mesh.GetPointsAttr().Get()),
            "elements": len(mesh.GetTetVertexIndicesAttr().Get()), "inverted": len(UsdGeom.TetMesh.FindInvertedElements(mesh))}


def febio(folder, about):
    """FEBio is in no registry: what stands in the file is counted, section by section, and its loads are read."""
    root = xml.etree.ElementTree.parse(folder / "motion.feb").getroot()
    mesh = root.find("Mesh")
    return {"version": f"spec {root.get('version')}, counted", "nodes": len(mesh.find("Nodes")), "elements": sum(len(part) for part in mesh.findall("Elements")),
            "held": len((mesh.findtext("NodeSet") or "").split(",")) if about["held_nodes"] else 0, "materials": len(root.find("Material"))}


def sofa(folder, about):
    """SOFA is in no registry either."""
    node = xml.etree.ElementTree.parse(folder / "model.scn").getroot().find("Node")
    topology, fixed = node.find("TetrahedronSetTopologyContainer"), node.find("FixedProjectiveConstraint")
    return {"version": "scene, counted", "nodes": len(topology.get("position").split()) // 3, "elements": len(topology.get("tetrahedra").split()) // 4,
            "held": len(fixed.get("indices").split()) if fixed is not None else 0, "moduli": len(node.find("TetrahedronFEMForceField").get("youngModulus").split())}


def frames(to):
    def read(folder, about):
        """Frames by another reader than ours: how many, and how far the surface moves."""
        try:
            import meshio
            import numpy as np
        except ImportError:
            return None
        meshes = [meshio.read(file) for file in sorted((folder / "frames").glob(f"*.{to}"))]
        first = meshes[0]
        moved = max(float(np.linalg.norm(mesh.points - first.points, axis=1).max()) for mesh in meshes)
        return {"version": f"meshio {meshio.__version__}", "nodes": len(first.points), "elements": len(first.cells_dict["triangle"]), "frames": len(meshes), "mm moved at most": common.number(1e3 * moved, 3)}
    return read


PROGRAMS = {"calculix": calculix, "mujoco": mujoco, "newton": newton, "gmsh": gmsh, "usd": usd, "febio": febio, "sofa": sofa,
            "ply": frames("ply"), "obj": frames("obj"), "vtu": frames("vtu")}
KEPT = ("elements", "nodes", "quadratic", "moduli_were_multiplied_by", "poissons_ratio", "steps_below", "model", "exported")


def main():
    arguments = common.arguments(__doc__, models={"type": pathlib.Path, "nargs": "+", "default": []},
                                 only={"nargs": "+", "default": list(PROGRAMS), "help": "formats"})
    if not arguments.models:
        for name in BATTERY:
            common.fit(arguments.program, common.shared_data() / "battery" / name, arguments.work / name)
            arguments.models.append(arguments.work / name)
    file = HERE / "results.json"
    models = common.read(file).get("models", {}) if file.exists() else {}
    for model in arguments.models:
        for to in arguments.only:
            folder = arguments.work / model.name / to
            about = exported(arguments.program, model, folder, to)
            seen = PROGRAMS[to](folder, about)
            if seen is None:
                print(f"{to}: not installed, left out")
                continue
            models.setdefault(model.name, {})[to] = {**{k: about[k] for k in KEPT if k in about}, "seen": seen}
            print(model.name, to, seen, "pliant:", about.get("exported"), flush=True)
            common.write_results(__file__, {"small": SMALL, "models": models})


if __name__ == "__main__":
    main()
