#!/usr/bin/env python3
"""The bodies that all programs step, meshed by pliant: a clamped bar let go under gravity, and a torus that falls on a floor.

Usage: bodies.py BUILD WORK [--small]
  Writes WORK/NAME/body.npz, and the same body as `pliant export` writes it, in WORK/NAME/PROGRAM. Needs numpy and pliant's Python package."""
import dataclasses
import math
import pathlib
import subprocess
import sys

import numpy as np

BAR = {"youngs_modulus": 1e6, "poissons_ratio": 0.4, "density": 1000.0, "velocity": (0.0, 0.0, 0.0), "floor": False,
       "times": (0.1, 0.2, 0.3, 0.4, 0.5)}
TORUS = {"youngs_modulus": 4000.0, "poissons_ratio": 0.35, "density": 100.0, "velocity": (0.0, -1.5, 0.0), "floor": True,
         "times": (0.025, 0.05, 0.075, 0.1, 0.125, 0.15)}
GRAVITY = (0.0, -9.81, 0.0)  # [m/s^2]
HELD = 1e-6  # [m] the bar's end, from x = 0
RING, TUBE, TILT_DEG, GAP = 0.1, 0.04, 20.0, 0.005  # [m] of the torus; GAP between it and the floor, y = 0, at the start
EXPORTS = {"bar": (("mujoco",), ("newton",), ("calculix", "--linear")), "torus": (("mujoco",), ("newton",))}


@dataclasses.dataclass
class Body:
    """Linear tetrahedra, stress-free, without damping, and how they start. SI."""
    name: str
    folder: pathlib.Path
    nodes: np.ndarray  # n x 3 [m]
    elements: np.ndarray  # e x 4
    surface: np.ndarray  # t x 3, triangles of the boundary
    held: np.ndarray  # nodes that stay where they are
    youngs_modulus: float
    poissons_ratio: float
    density: float
    velocity: tuple  # of all nodes at the start [m/s]
    floor: bool  # the plane y = 0, without friction
    times: tuple  # at which positions are compared [s]

    @property
    def free(self):
        return np.setdiff1d(np.arange(len(self.nodes)), self.held)

    @property
    def lame(self):
        """lambda and mu [Pa]."""
        E, nu = self.youngs_modulus, self.poissons_ratio
        return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))

    def steps_between(self, step):
        """Steps of a length from one compared time to the next. Throws where it is no divisor."""
        count = round(self.times[0] / step)
        if not math.isclose(count * step, self.times[0], rel_tol=1e-9):
            raise ValueError(f"step of {step} s: expected a part of {self.times[0]} s")
        return count


def load(folder):
    folder = pathlib.Path(folder)
    data = np.load(folder / "body.npz")
    given = BAR if folder.name == "bar" else TORUS
    return Body(folder.name, folder, data["nodes"], data["elements"], data["surface"], data["held"], given["youngs_modulus"],
                given["poissons_ratio"], given["density"], given["velocity"], given["floor"], tuple(data["times"]))


def torus_surface(small):
    """A closed triangle mesh of the tilted torus above the floor: vertices [m] and triangles."""
    around, along = (24, 12) if small else (96, 48)
    u, v = np.meshgrid(2 * np.pi * np.arange(around) / around, 2 * np.pi * np.arange(along) / along, indexing="ij")
    r = RING + TUBE * np.cos(v)
    points = np.stack([r * np.cos(u), TUBE * np.sin(v), r * np.sin(u)], axis=-1).reshape(-1, 3)
    c, s = math.cos(math.radians(TILT_DEG)), math.sin(math.radians(TILT_DEG))
    points = points @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T
    points[:, 1] += GAP - points[:, 1].min()
    i, j = (a.ravel() for a in np.meshgrid(np.arange(around), np.arange(along), indexing="ij"))
    at = lambda a, b: (a % around) * along + b % along
    return points, np.concatenate([np.stack([at(i, j), at(i, j + 1), at(i + 1, j)], 1), np.stack([at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)], 1)])


def boundary(elements):
    """Triangles of the boundary, facing outwards."""
    faces = elements[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


def made(name, small):
    """The body by pliant: nodes, elements, held nodes."""
    import pliant
    if name == "bar":
        body = pliant.Body.box([0, 0, 0], [1, 0.25, 0.25], (6, 2, 2) if small else (20, 5, 5), quadratic=False)
        return body.nodes, body.elements, np.flatnonzero(body.nodes[:, 0] < HELD)
    body = pliant.Body.of_surface(*torus_surface(small), cells=6 if small else 14, element="tetrahedra")
    return body.nodes, body.elements, np.array([], int)


def write_model(folder, body, mass):
    """The body as a model of pliant's, for `pliant export`."""
    with open(folder / "mesh.msh", "w") as file:
        file.write(f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{len(body.nodes)}\n")
        file.writelines(f"{n + 1} {x!r} {y!r} {z!r}\n" for n, (x, y, z) in enumerate(body.nodes.tolist()))
        file.write(f"$EndNodes\n$Elements\n{len(body.elements)}\n")
        file.writelines(f"{e + 1} 4 2 0 1 {' '.join(str(n + 1) for n in nodes)}\n" for e, nodes in enumerate(body.elements.tolist()))
        file.write("$EndElements\n")
    fixed = f"[[fixed]]\nbox = {{ min = [-1, -1, -1], max = [{HELD}, 1, 1] }}\n" if len(body.held) else ""
    (folder / "model.toml").write_text(
        f'format = "model/1"\nname = "{body.name}"\n[object]\nvolume_mesh = "mesh.msh"\nmass = {mass!r}\ndensity = {body.density}\n[material]\n'
        f"youngs_modulus = {body.youngs_modulus}\npoissons_ratio = {body.poissons_ratio}\n[world]\ngravity = {list(GRAVITY)}\n"
        f"[simulation]\ncell_size = 0.05\ngrid_origin = [0.0, 0.0, 0.0]\nsubsteps = 1\nnewmark_theta = 0.51\n{fixed}")


def volumes(nodes, elements):
    edges = nodes[elements[:, 1:]] - nodes[elements[:, :1]]
    return np.linalg.det(edges) / 6


def main(build, work, small):
    for name, given in (("bar", BAR), ("torus", TORUS)):
        folder = work / name
        folder.mkdir(parents=True, exist_ok=True)
        nodes, elements, held = made(name, small)
        np.savez(folder / "body.npz", nodes=nodes, elements=elements, surface=boundary(elements), held=held,
                 times=given["times"][:1] if small else given["times"])
        body = load(folder)
        write_model(folder, body, body.density * float(volumes(nodes, elements).sum()))
        for to in EXPORTS[name]:
            subprocess.run([build / "apps/pliant", "export", folder / "model.toml", "--to", *to, "--out", folder / to[0]], check=True,
                           stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    sys.path.insert(0, str(pathlib.Path(sys.argv[1]) / "python"))
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), "--small" in sys.argv)
