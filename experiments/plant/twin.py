#!/usr/bin/env python3
"""A plant that exists only in a simulator of other physics than a fit's (simulator.py), and its recording by three depth sensors: a
stem held in its pot, three thick leaves, five moduli. It sags under its weight, is scanned, pulled aside by a dead load, and let go.

Needs numpy, scipy and gmsh: pip install numpy scipy gmsh. Works in one thread.

    twin.py --out DIR      write the recording (a capture with truth.json and truth/)"""
import argparse
import json
import math
import pathlib
import time

from simulator import EDGES, FACES, Body, quadratic  # first: it sets the number of threads

import numpy as np

# The truth: fixed before any fit.
TRUTH = {
    "poisson_ratio": 0.38, "density": 360.0, "mass_damping": 0.3, "stiffness_damping": 0.003,
    "stem": {"from_y": -0.03, "length": 0.33, "radius": [0.0085, 0.0062], "lean_deg": 5.0, "youngs_modulus": [9.0e6, 6.0e6]},
    # of each leaf: height at which it leaves the stem, azimuth and elevation, length, width, thickness, how its end is bent off its
    # plane (upwards) [m], Young's modulus
    "leaves": {
        "low leaf": {"y": 0.115, "azimuth_deg": 205.0, "elevation_deg": 14.0, "length": 0.165, "width": 0.046, "thickness": 0.0060, "bend": 0.010, "youngs_modulus": 3.2e6},
        "middle leaf": {"y": 0.190, "azimuth_deg": 320.0, "elevation_deg": 35.0, "length": 0.160, "width": 0.044, "thickness": 0.0062, "bend": -0.008, "youngs_modulus": 2.0e6},
        "top leaf": {"y": 0.262, "azimuth_deg": 80.0, "elevation_deg": 45.0, "length": 0.140, "width": 0.040, "thickness": 0.0062, "bend": 0.012, "youngs_modulus": 2.8e6},
    },
    "blend": [0.010, 0.035],  # from stem to leaf the logarithm of the modulus goes over these distances from the stem's axis [m]
    "pull": {"y": 0.245, "radius": 0.014, "direction": [0.80, -0.15, 0.58], "moves": 0.060},
    "frame_rate": 30.0, "frame_count": 250, "start_frame": 4, "substeps": 12, "cell": 0.0078, "seed": 4711,
    "surface_noise": 0.00025,  # of the scan along its normals [m], alike over some 20 mm
}


# --- the plant --------------------------------------------------------------------------------------------------------------------

def stem_axis():
    lean = math.radians(TRUTH["stem"]["lean_deg"])
    return np.array([math.sin(lean), math.cos(lean), 0.0])


def on_axis(y):
    axis = stem_axis()
    return axis * y / axis[1]


def stem_radius(along):
    r0, r1 = TRUTH["stem"]["radius"]
    return r0 + (r1 - r0) * np.clip(along / TRUTH["stem"]["length"], 0, 1)


def stem_base():
    return on_axis(TRUTH["stem"]["from_y"])


def leaf_frame(leaf):
    """Root on the stem's axis, and unit vectors: along the leaf, across, and its upper normal."""
    azimuth, elevation = math.radians(leaf["azimuth_deg"]), math.radians(leaf["elevation_deg"])
    out = np.array([math.cos(azimuth), 0.0, -math.sin(azimuth)])
    along = math.cos(elevation) * out + math.sin(elevation) * np.array([0.0, 1.0, 0.0])
    across = np.cross(along, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    return on_axis(leaf["y"]), along, across, np.cross(across, along)


def leaf_places(leaf, points):
    """Along, across and off the flat leaf's plane, from its root; and how far beyond the stem a point is along it."""
    root, along, across, normal = leaf_frame(leaf)
    local = (points - root) @ np.stack([along, across, normal], axis=1)
    elevation = math.radians(leaf["elevation_deg"])
    radius = stem_radius((root - stem_base()) @ stem_axis())
    begin = radius / math.cos(elevation) + 0.5 * leaf["thickness"] * math.tan(elevation) + 0.001
    return local, begin


def inside_leaf(leaf, points, slack=1e-6):
    local, begin = leaf_places(leaf, points)
    a, b = 0.5 * leaf["length"], 0.5 * leaf["width"]
    return (np.abs(local[:, 2]) < 0.5 * leaf["thickness"] + slack) & (((local[:, 0] - a) / a)**2 + (local[:, 1] / b)**2 < 1 + 1e-3) & (local[:, 0] > begin)


def shaped(points):
    """Flat leaves are bent and get thinner towards their ends."""
    points = points.copy()
    for leaf in TRUTH["leaves"].values():
        mine = inside_leaf(leaf, points, 1e-5)
        local, begin = leaf_places(leaf, points[mine])
        normal = leaf_frame(leaf)[3]
        s = (local[:, 0] - begin) / (leaf["length"] - begin)
        points[mine] += np.outer(leaf["bend"] * s**2 - 0.35 * s**2 * (3 - 2 * s) * local[:, 2], normal)
    return points


def plant_mesh():
    """Corners and tetrahedra of the plant as it is free of load."""
    import gmsh
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    occ, stem = gmsh.model.occ, TRUTH["stem"]
    base, axis, (r0, r1) = stem_base(), stem_axis(), stem["radius"]
    bodies = [(3, occ.addCone(*base, *(axis * stem["length"]), r0, r1))]
    for leaf in TRUTH["leaves"].values():
        root, along, across, normal = leaf_frame(leaf)
        middle = root + 0.5 * leaf["length"] * along - 0.5 * leaf["thickness"] * normal
        disk = occ.addDisk(*middle, 0.5 * leaf["length"], 0.5 * leaf["width"], zAxis=normal, xAxis=along)
        bodies += [e for e in occ.extrude([(2, disk)], *(leaf["thickness"] * normal)) if e[0] == 3]
    whole, _ = occ.fuse(bodies[:1], bodies[1:])
    below = occ.addBox(-0.1, -0.1, -0.1, 0.2, 0.1, 0.2)
    above = occ.addBox(-0.5, 0.0, -0.5, 1.0, 1.0, 1.0)
    pot, _ = occ.intersect(whole, [(3, below)], removeObject=False)
    plant, _ = occ.intersect(whole, [(3, above)], removeObject=True)
    occ.fragment(pot, plant)
    occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMax", TRUTH["cell"])
    gmsh.option.setNumber("Mesh.MeshSizeMin", 0.5 * TRUTH["cell"])
    gmsh.option.setNumber("Mesh.RandomSeed", 1)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.optimize("Netgen")
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    types, _, nodes = gmsh.model.mesh.getElements(3)
    assert list(types) == [4]
    gmsh.finalize()
    place = np.zeros(int(tags.max()) + 1, int)
    place[tags.astype(int)] = np.arange(len(tags))
    tetrahedra = place[nodes[0].astype(int).reshape(-1, 4)]
    used, tetrahedra = np.unique(tetrahedra, return_inverse=True)
    corners, tetrahedra = coordinates.reshape(-1, 3)[used], tetrahedra.reshape(-1, 4)
    corners = shaped(corners)
    edges = corners[tetrahedra[:, 1:]] - corners[tetrahedra[:, :1]]
    volume = np.linalg.det(edges) / 6
    turned = volume < 0
    tetrahedra[turned] = tetrahedra[turned][:, [0, 2, 1, 3]]
    return corners, tetrahedra


def quality(corners, tetrahedra):
    """6 sqrt(2) V / l_rms^3 of each: 1 of a regular one."""
    p = corners[tetrahedra]
    volume = np.linalg.det(p[:, 1:] - p[:, :1]) / 6
    lengths = np.stack([np.linalg.norm(p[:, i] - p[:, j], axis=1) for i, j in EDGES], axis=1)
    return 6 * math.sqrt(2) * volume / np.sqrt((lengths**2).mean(axis=1))**3, lengths.mean()


def unbent(leaf, points):
    """Distance along a leaf and whether points of the shaped plant belong to it (as flat leaves are bent by less than this allows)."""
    local, begin = leaf_places(leaf, points)
    s = np.clip((local[:, 0] - begin) / (leaf["length"] - begin), 0, 1)
    off = local[:, 2] - leaf["bend"] * s**2
    a, b = 0.5 * leaf["length"], 0.5 * leaf["width"]
    return local[:, 0], (np.abs(off) < 0.6 * leaf["thickness"]) & (((local[:, 0] - a) / a)**2 + (local[:, 1] / b)**2 < 1.02) & (local[:, 0] > 0.5 * begin)


def modulus_at(points):
    """Young's modulus: along the stem its logarithm is linear; to a leaf it goes over smoothly where the leaf begins."""
    stem = TRUTH["stem"]
    share = np.clip((points[:, 1] - 0.0) / 0.29, 0, 1)
    low, high = np.log(stem["youngs_modulus"])
    log = low + (high - low) * share
    for leaf in TRUTH["leaves"].values():
        along, mine = unbent(leaf, points)
        t = np.clip((along - TRUTH["blend"][0]) / (TRUTH["blend"][1] - TRUTH["blend"][0]), 0, 1)
        t = np.where(mine, t * t * (3 - 2 * t), 0)
        log = log + (math.log(leaf["youngs_modulus"]) - log) * t
    return np.exp(log)


ZONES = ("stem, lower half", "stem, upper half", *TRUTH["leaves"])


def zones_of(points):
    """0, 1: the stem below and above y = 0.15 m; 2, ...: a leaf from its blend's middle on."""
    zone = np.where(points[:, 1] < 0.15, 0, 1)
    for k, leaf in enumerate(TRUTH["leaves"].values()):
        along, mine = unbent(leaf, points)
        zone[mine & (along > sum(TRUTH["blend"]) / 2)] = 2 + k
    return zone


def boundary(elements):
    """Triangles (6-node faces split into four) of the surface, as vertices' node numbers and triangles of vertices."""
    middle = {tuple(sorted(e)): 4 + n for n, e in enumerate(EDGES)}
    faces, splits = [], []
    for a, b, c in FACES:
        ab, bc, ca = middle[tuple(sorted((a, b)))], middle[tuple(sorted((b, c)))], middle[tuple(sorted((a, c)))]
        faces.append(elements[:, [a, b, c]])
        splits.append(elements[:, [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]])
    faces, splits = np.concatenate(faces), np.concatenate(splits)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    triangles = splits[first[count == 1]].reshape(-1, 3)
    vertices, triangles = np.unique(triangles, return_inverse=True)
    return vertices, triangles.reshape(-1, 3)


def plant():
    corners, tetrahedra = plant_mesh()
    nodes, elements = quadratic(corners, tetrahedra)
    held = nodes[:, 1] < 1e-9
    body = Body(nodes, elements, held, modulus_at, TRUTH["poisson_ratio"], TRUTH["density"], TRUTH["mass_damping"], TRUTH["stiffness_damping"])
    return body, corners, tetrahedra


def pulled(body, rest):
    """The equilibrium under gravity and a dead load that moves a patch of the stem by what the truth says; and the load."""
    pull = TRUTH["pull"]
    direction = np.array(pull["direction"]) / np.linalg.norm(pull["direction"])
    axis = stem_axis()
    off = body.X - on_axis(pull["y"])
    patch = (np.abs(off @ axis) < pull["radius"]) & (np.linalg.norm(off - np.outer(off @ axis, axis), axis=1) < 0.008)
    share = np.where(patch, np.asarray(body.M.sum(axis=1)).ravel(), 0)
    share /= share.sum()
    moved = lambda x: float(np.linalg.norm(share @ (x - rest)))
    force, x, step, known = 0.0, rest, 0.02, [(0.0, 0.0)]
    while abs(moved(x) - pull["moves"]) > 1e-5:
        if len(known) > 1:
            (m0, f0), (m1, f1) = known[-2:]
            step = float(np.clip((pull["moves"] - m1) * (f1 - f0) / (m1 - m0), -0.03, 0.03))
        force += step
        x = body.equilibrium(x, body.weight + force * np.outer(share, direction), 1e-9)
        known.append((moved(x), force))
    return x, force * direction, np.flatnonzero(patch)


# --- sensors ----------------------------------------------------------------------------------------------------------------------

class Camera:
    width, height, f = 280, 280, 300.0

    def __init__(self, azimuth_deg, elevation_deg, distance, target, random):
        a, e = math.radians(azimuth_deg), math.radians(elevation_deg)
        back = np.array([math.cos(e) * math.cos(a), math.sin(e), -math.cos(e) * math.sin(a)])
        z = -back
        x = np.cross(z, [0.0, 1.0, 0.0])
        x /= np.linalg.norm(x)
        self.axes, self.eye = np.stack([x, np.cross(z, x), z]), target + distance * back  # rows: right, down, forward
        axis = random.normal(size=3)
        axis /= np.linalg.norm(axis)
        angle = math.radians(0.2 * abs(random.normal()) + 0.05)
        K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        self.turn = np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K
        self.shift = random.normal(size=3) * 0.0004
        self.target, self.angle_deg = target, math.degrees(angle)

    def see(self, vertices, triangles, random):
        """Points that the camera reports, in what it takes for world coordinates."""
        p = (vertices - self.eye) @ self.axes.T
        u = self.f * p[:, 0] / p[:, 2] + 0.5 * (self.width - 1)
        v = self.f * p[:, 1] / p[:, 2] + 0.5 * (self.height - 1)
        t = p[triangles]
        normal = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
        size = np.linalg.norm(normal, axis=1)
        front = np.einsum("ni,ni->n", normal, t[:, 0]) < -1e-12
        uu, vv = u[triangles[front]], v[triangles[front]]
        t, normal = t[front], normal[front] / size[front, None]
        low_u, low_v = np.ceil(uu.min(axis=1)).astype(int), np.ceil(vv.min(axis=1)).astype(int)
        span = max(int((np.floor(uu.max(axis=1)) - low_u).max()), int((np.floor(vv.max(axis=1)) - low_v).max()), 0) + 1
        area = (uu[:, 1] - uu[:, 0]) * (vv[:, 2] - vv[:, 0]) - (uu[:, 2] - uu[:, 0]) * (vv[:, 1] - vv[:, 0])
        pixels, depths, owners = [], [], []
        for i in range(span):
            for j in range(span):
                x, y = low_u + i, low_v + j
                inside = (area != 0) & (x >= 0) & (y >= 0) & (x < self.width) & (y < self.height)
                for a, b in ((0, 1), (1, 2), (2, 0)):
                    inside &= ((uu[:, b] - uu[:, a]) * (y - vv[:, a]) - (vv[:, b] - vv[:, a]) * (x - uu[:, a])) * np.sign(area) >= 0
                who = np.flatnonzero(inside)
                ray = np.stack([(x[who] - 0.5 * (self.width - 1)) / self.f, (y[who] - 0.5 * (self.height - 1)) / self.f, np.ones(len(who))], axis=1)
                depths.append(np.einsum("ni,ni->n", normal[who], t[who, 0]) / np.einsum("ni,ni->n", normal[who], ray))
                pixels.append(y[who] * self.width + x[who])
                owners.append(who)
        pixels, depths, owners = map(np.concatenate, (pixels, depths, owners))
        order = np.lexsort((depths, pixels))
        pixels, depths, owners = pixels[order], depths[order], owners[order]
        first = np.concatenate([[True], pixels[1:] != pixels[:-1]])
        pixels, depths, owners = pixels[first], depths[first], owners[first]
        place = np.stack([pixels % self.width, pixels // self.width], axis=1).astype(float)
        ray = np.concatenate([(place - 0.5 * (self.width - 1)) / self.f, np.ones((len(place), 1))], axis=1)
        long = np.linalg.norm(ray, axis=1)
        facing = -np.einsum("ni,ni->n", normal[owners], ray) / long
        seen = random.random(len(facing)) < np.clip((facing - 0.12) / 0.2, 0, 1)  # grazing pixels are lost
        ray, long, depths = ray[seen], long[seen], depths[seen]
        ray[:, :2] += random.normal(size=(len(ray), 2)) * 0.25 / self.f
        distance = depths * long + random.normal(size=len(ray)) * 0.0012
        wild = random.random(len(ray)) < 0.01
        distance[wild] += random.normal(size=wild.sum()) * 0.04
        local = ray / np.linalg.norm(ray, axis=1, keepdims=True) * distance[:, None]
        world = local @ self.axes + self.eye
        return (world - self.target) @ self.turn.T + self.target + self.shift


# --- files ------------------------------------------------------------------------------------------------------------------------

def write_mesh(path, vertices, triangles):
    head = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\nproperty double x\nproperty double y\nproperty double z\n"
            f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
    faces = np.empty(len(triangles), dtype=[("n", "u1"), ("v", "<i4", 3)])
    faces["n"], faces["v"] = 3, triangles
    path.write_bytes(head.encode() + vertices.astype("<f8").tobytes() + faces.tobytes())


def write_cloud(path, points):
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    path.write_bytes(head.encode() + points.astype("<f4").tobytes())


def smooth_noise(points, size, length, random):
    """A random function of places, of that deviation and about that correlation length."""
    k = random.normal(size=(200, 3)) / length
    phase = random.random(200) * 2 * math.pi
    return size * math.sqrt(2 / 200) * np.cos(points @ k.T + phase).sum(axis=1)


def normals(vertices, triangles):
    out = np.zeros_like(vertices)
    t = vertices[triangles]
    face = np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
    for k in range(3):
        np.add.at(out, triangles[:, k], face)
    return out / np.linalg.norm(out, axis=1, keepdims=True)


CAPTURE = """format = "capture/1"
name = "a plant scanned while it sags, then pulled aside and let go"

[object]
surface = "rest.ply"
mass = {mass}
shape_is = "static"
surface_noise = {surface_noise}

[world]
gravity = [0.0, -9.81, 0.0]

[timing]
frame_rate = {frame_rate}
frame_count = {frame_count}
start_frame = {start_frame}

[[fixed]]
box = {{ min = [-0.05, -0.05, -0.05], max = [0.05, 0.0, 0.05] }}

[initial]
released = true

[[cloud]]
points = "clouds/%06d.ply"
noise = 0.0016
"""


def record(out):
    begin = time.monotonic()
    out.mkdir(parents=True, exist_ok=True)
    (out / "clouds").mkdir(exist_ok=True)
    (out / "truth").mkdir(exist_ok=True)
    random = np.random.default_rng(TRUTH["seed"])
    body, corners, tetrahedra = plant()
    fairness, edge = quality(corners, tetrahedra)
    print(f"{len(tetrahedra)} tetrahedra, {len(body.X)} nodes, smallest quality {fairness.min():.3f}, mass {body.mass:.4f} kg", flush=True)
    rest = body.settle()
    held, force, patch = pulled(body, rest)
    vertices, triangles = boundary(body.elements)
    print(f"{len(vertices)} vertices; sag {1e3 * np.linalg.norm(rest - body.X, axis=1).max():.1f} mm; pull {np.linalg.norm(force):.3f} N; {time.monotonic() - begin:.0f} s", flush=True)
    scan = rest[vertices]
    scan = scan + normals(scan, triangles) * smooth_noise(scan, TRUTH["surface_noise"], 0.02, random)[:, None]
    scan[~body.free.reshape(-1, 3)[vertices].any(axis=1), 1] = np.minimum(scan[~body.free.reshape(-1, 3)[vertices].any(axis=1), 1], 0.0)
    write_mesh(out / "rest.ply", scan, triangles)
    write_mesh(out / "truth/reference.ply", body.X[vertices], triangles)
    write_mesh(out / "truth/static.ply", rest[vertices], triangles)
    write_mesh(out / "truth/pulled.ply", held[vertices], triangles)
    centres = body.X[body.elements[:, :4]].mean(axis=1)
    zone = zones_of(centres)
    with open(out / "truth/cells.csv", "w") as file:
        file.write("x,y,z,volume,youngs_modulus,zone\n")
        for c, v, e, z in zip(centres, body.volume, body.E_mean, zone):
            file.write(f"{c[0]:.6g},{c[1]:.6g},{c[2]:.6g},{v:.6g},{e:.6g},{z}\n")
    target = np.array([0.01, 0.17, 0.0])
    cameras = [Camera(a, e, 0.78, target, random) for a, e in ((15.0, 18.0), (135.0, 25.0), (255.0, 12.0))]
    rate, count, start, substeps = (TRUTH[k] for k in ("frame_rate", "frame_count", "start_frame", "substeps"))
    frames, points, energy = [held[vertices]] * (start + 1), [], [body.energies(held, np.zeros_like(held))]
    watch, taken = {}, 0.0
    for n, (t, x, v) in enumerate(body.swing(held, 1 / (rate * substeps), (count - start - 1) * substeps, watch=watch)):
        e = body.energies(x, v)
        taken += 0.5 * (energy[-1][3] + e[3]) / (rate * substeps) if n else e[3] / (rate * substeps)
        energy.append(e)
        if (n + 1) % substeps == 0:
            frames.append(x[vertices])
            if len(frames) % 10 == 0:
                print(f"frame {len(frames)}: {time.monotonic() - begin:.0f} s, {watch}", flush=True)
    for k, frame in enumerate(frames):
        cloud = np.concatenate([camera.see(frame, triangles, random) for camera in cameras])
        points.append(len(cloud))
        write_cloud(out / f"clouds/{k:06d}.ply", cloud)
    np.savez_compressed(out / "truth/trajectory.npz", q=np.round(np.array(frames) / 1e-5).astype("<i4"), scale=np.array([1e-5]))
    (out / "capture.toml").write_text(CAPTURE.format(mass=round(body.mass, 7), surface_noise=TRUTH["surface_noise"], frame_rate=rate, frame_count=count, start_frame=start))
    total = lambda e: e[0] + e[1] + e[2]
    tips = {}
    for name, leaf in TRUTH["leaves"].items():
        root, along, _, normal = leaf_frame(leaf)
        tip = root + leaf["length"] * along + leaf["bend"] * normal
        node = np.argmin(np.linalg.norm(body.X - tip, axis=1))
        on = np.argmin(np.linalg.norm(body.X[vertices] - tip, axis=1))
        course = np.array([f[on] for f in frames]) - rest[vertices][on]
        tips[name] = {"sags_by": float(np.linalg.norm(rest[node] - body.X[node])), "pulled_by": float(np.linalg.norm(course[0])),
                      "moves_in_seconds": {str(s): float(np.linalg.norm(course[start + 30 * s - 8:start + 30 * s + 8], axis=1).max()) for s in (1, 2, 4, 6, 7)}}
    size = body.X[vertices].max(axis=0) - body.X[vertices].min(axis=0)
    zones = []
    for z, name in enumerate(ZONES):
        mine = zone == z
        log = (body.volume[mine] * np.log(body.E_mean[mine])).sum() / body.volume[mine].sum()
        zones.append({"name": name, "mean": float((body.volume[mine] * body.E_mean[mine]).sum() / body.volume[mine].sum()), "mean_of_log": float(math.exp(log)),
                      "volume": float(body.volume[mine].sum())})
    truth = {
        "seed": TRUTH["seed"], "parameters": {
            "poisson_ratio": {"value": TRUTH["poisson_ratio"]}, "density": {"value": TRUTH["density"]}, "mass": {"value": body.mass},
            "mass_damping": {"value": TRUTH["mass_damping"]}, "stiffness_damping": {"value": TRUTH["stiffness_damping"]}},
        "zones": zones, "truth": TRUTH, "size": size.tolist(), "tips": tips, "pull_N": force.tolist(), "patch_nodes": len(patch),
        "cameras": [{"rotation_deg": c.angle_deg, "translation_m": c.shift.tolist()} for c in cameras],
        "mesh": {"tetrahedra": len(tetrahedra), "nodes": len(body.X), "surface_vertices": len(vertices), "mean_edge": float(edge), "smallest_quality": float(fairness.min())},
        "points_a_frame": [int(min(points)), int(np.mean(points)), int(max(points))],
        "energy_J": {"columns": ["kinetic", "elastic", "gravity"], "first": energy[0][:3], "last": energy[-1][:3], "taken_by_damping": taken,
                     "not_accounted_share": float((total(energy[0]) - total(energy[-1]) - taken) / (total(energy[0]) - total(energy[-1])))},
        "newton": watch, "seconds": time.monotonic() - begin}
    (out / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")
    print(json.dumps({k: truth[k] for k in ("tips", "size", "points_a_frame", "energy_J", "seconds")}, indent=1))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder of the recording")
    parser.add_argument("--cell", type=float, help="edge of a tetrahedron [m]")
    arguments = parser.parse_args()
    if arguments.cell:
        TRUTH["cell"] = arguments.cell
    record(arguments.out)


if __name__ == "__main__":
    main()
