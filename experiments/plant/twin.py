#!/usr/bin/env python3
"""A plant that exists only in this simulator, and its recording by three depth sensors: a stem held in its pot, three thick leaves,
five moduli. It sags under its weight, is scanned, pulled aside by a dead load, and let go.

The physics is not that of pliant's fit: 10-node tetrahedra, a compressible neo-Hookean law
    W = mu/2 (I1 - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)^2
whose small-strain limit is Hooke's law with (E(X), nu), Kelvin-Voigt damping S_v = beta (lambda tr(Edot) I + 2 mu Edot) and mass
damping, a consistent mass, BDF2 with Newton's method; the equilibrium under gravity by load stepping.

Needs numpy, scipy and gmsh: pip install numpy scipy gmsh. Works in one thread.

    twin.py --out DIR      write the recording (a capture with truth.json and truth/)
    twin.py --verify FILE  check the simulator against beam theory, differences and the balance of energy; write the figures"""
import argparse
import json
import math
import os
import pathlib
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

GRAVITY = np.array([0.0, -9.81, 0.0])

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
}


# --- the solver -------------------------------------------------------------------------------------------------------------------

EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))  # outward


def quadrature(degree):
    """Barycentric points and weights (of one) on a tetrahedron; degree 2 or 4."""
    if degree == 2:
        a, b = (5 + 3 * math.sqrt(5)) / 20, (5 - math.sqrt(5)) / 20
        return np.full((4, 4), b) + (a - b) * np.eye(4), np.full(4, 0.25)
    a1, w1, a2, w2, b1, w3 = 0.31088591926330060980, 0.11268792571801585080, 0.092735250310891226402, 0.073493043116361949544, 0.045503704125649649492, 0.042546020777081466438
    points, weights = [], []
    for a, w in ((a1, w1), (a2, w2)):
        for k in range(4):
            point = [a] * 4
            point[k] = 1 - 3 * a
            points.append(point)
            weights.append(w)
    for i in range(4):
        for j in range(i):
            point = [b1] * 4
            point[i] = point[j] = 0.5 - b1
            points.append(point)
            weights.append(w3)
    return np.array(points), np.array(weights)


def shape(points):
    """Values (q, 10) and derivatives by barycentric coordinates (q, 10, 4) of the quadratic functions."""
    values = np.concatenate([points * (2 * points - 1)] + [4 * points[:, [i]] * points[:, [j]] for i, j in EDGES], axis=1)
    slopes = np.zeros((len(points), 10, 4))
    for k in range(4):
        slopes[:, k, k] = 4 * points[:, k] - 1
    for n, (i, j) in enumerate(EDGES):
        slopes[:, 4 + n, i] = 4 * points[:, j]
        slopes[:, 4 + n, j] = 4 * points[:, i]
    return values, slopes


def quadratic(corners, tetrahedra):
    """Nodes (N, 3) and elements (n, 10) with nodes in the middle of straight edges."""
    ends = np.sort(np.concatenate([tetrahedra[:, list(e)] for e in EDGES]), axis=1)
    edges, index = np.unique(ends, axis=0, return_inverse=True)
    nodes = np.concatenate([corners, corners[edges].mean(axis=1)])
    return nodes, np.concatenate([tetrahedra, len(corners) + index.reshape(len(EDGES), -1).T], axis=1)


def cofactor(F):
    a, b, c = F[..., 0], F[..., 1], F[..., 2]  # columns
    return np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-1)


def factor(upper):
    """Solves by a symmetric matrix of which the upper triangle is given."""
    whole = (upper + scipy.sparse.triu(upper, 1).T).tocsc()
    return scipy.sparse.linalg.splu(whole, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}).solve


class Body:
    def __init__(self, nodes, elements, held, E, nu, density, alpha=0.0, beta=0.0):
        """`E` is called with points (m, 3) and gives Young's modulus there."""
        self.X, self.elements, self.alpha, self.beta = nodes, elements, alpha, beta
        points, weights = quadrature(2)
        values, slopes = shape(points)
        corners = nodes[elements[:, :4]]
        edges = (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)  # columns: edges
        volume = np.linalg.det(edges) / 6
        assert volume.min() > 0
        inverse = np.linalg.inv(edges)
        barycentric = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)  # (n, 4, 3)
        self.volume = volume
        self.G = np.einsum("qak,nkj->nqaj", slopes, barycentric)
        self.w = volume[:, None] * weights
        at = np.einsum("qa,nai->nqi", values, nodes[elements])
        modulus = E(at.reshape(-1, 3)).reshape(at.shape[:2])
        self.E_mean = modulus.mean(axis=1)
        self.mu = modulus / (2 * (1 + nu))
        self.la = modulus * nu / ((1 + nu) * (1 - 2 * nu))
        n, count = len(elements), len(nodes)
        fine, fine_weights = quadrature(4)
        N = shape(fine)[0]
        block = np.einsum("q,qa,qb->ab", fine_weights, N, N)
        element_mass = density * volume[:, None, None] * block
        rows = np.repeat(elements, 10, axis=1).ravel()
        columns = np.tile(elements, (1, 10)).ravel()
        self.M = scipy.sparse.csr_matrix((element_mass.ravel(), (rows, columns)), shape=(count, count))
        self.mass = float(self.M.sum())
        self.free = np.ones(3 * count, bool)
        self.free.reshape(-1, 3)[held] = False
        number = np.full(3 * count, -1)
        number[self.free] = np.arange(self.free.sum())
        self.size = int(self.free.sum())
        # the fixed pattern of the upper triangle
        dof = (3 * elements[:, :, None] + np.arange(3)).reshape(n, 30)
        self.dof = dof
        own = number[dof]
        i, j = np.repeat(own, 30, axis=1), np.tile(own, (1, 30))
        self.kept = ((i >= 0) & (j >= 0) & (i <= j)).ravel()
        key = i.ravel()[self.kept].astype(np.int64) * self.size + j.ravel()[self.kept]
        unique, self.slot = np.unique(key, return_inverse=True)
        self.entries = len(unique)
        self.pattern = ((unique % self.size).astype(np.int32), np.searchsorted(unique // self.size, np.arange(self.size + 1)).astype(np.int32))
        self.element_mass = np.einsum("nab,ij->naibj", element_mass, np.eye(3)).reshape(n, 900)
        self.weight = (self.M.sum(axis=1).A1 if hasattr(self.M.sum(axis=1), "A1") else np.asarray(self.M.sum(axis=1)).ravel())[:, None] * GRAVITY

    def gather(self, forces):
        """Element forces (n, 10, 3) to nodes."""
        return np.bincount(self.dof.ravel(), forces.reshape(-1), minlength=self.X.size).reshape(-1, 3)

    def gradient(self, nodal):
        return np.matmul(nodal[self.elements].transpose(0, 2, 1)[:, None], self.G)  # (n, q, 3, 3)

    def internal(self, x, v=None):
        """Internal forces at places x and velocities v; and the elastic energy, and the power that the Kelvin-Voigt stress takes."""
        F = self.gradient(x)
        C = cofactor(F)
        J = (F[..., 0] * C[..., 0]).sum(axis=-1)
        mu, la = self.mu[..., None, None], self.la[..., None, None]
        P = mu * F + ((la + mu) * (J - 1)[..., None, None] - mu) * C
        energy = (self.w * (0.5 * self.mu * ((F * F).sum(axis=(-2, -1)) - 3) - self.mu * (J - 1) + 0.5 * (self.la + self.mu) * (J - 1)**2)).sum()
        power, S = 0.0, None
        if v is not None and self.beta:
            H = np.matmul(F.swapaxes(-1, -2), self.gradient(v))
            rate = 0.5 * (H + H.swapaxes(-1, -2))
            S = self.beta * (la * np.trace(rate, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) + 2 * mu * rate)
            P = P + np.matmul(F, S)
            power = (self.w * (S * rate).sum(axis=(-2, -1))).sum()
        forces = np.matmul(self.G, (self.w[..., None, None] * P).swapaxes(-1, -2)).sum(axis=1)
        return self.gather(forces), energy, power, (F, C, J, S)

    def tangent(self, state, viscous=0.0, mass=0.0):
        """Upper triangle of mass * M + dP/dF + viscous * that of the Kelvin-Voigt stress; what turns with the velocity is left out."""
        F, C, J, S = state
        n, q = J.shape
        mu, la = self.mu, self.la
        K = np.zeros((n, 30, 30))
        e = np.zeros((3, 3, 3))
        e[0, 1, 2] = e[1, 2, 0] = e[2, 0, 1] = 1
        e[0, 2, 1] = e[2, 1, 0] = e[1, 0, 2] = -1
        eye = np.eye(3)
        for k in range(q):
            Fk, Ck = F[:, k], C[:, k]
            A = np.einsum("n,nij,nkl->nijkl", la[:, k] + mu[:, k], Ck, Ck)
            A += np.einsum("n,ikm,jlo,nmo->nijkl", (la[:, k] + mu[:, k]) * (J[:, k] - 1) - mu[:, k], e, e, Fk, optimize=True)
            A += np.einsum("n,ik,jl->nijkl", mu[:, k], eye, eye)
            if viscous and S is not None:
                b = viscous * self.beta
                A += b * np.einsum("n,nij,nkl->nijkl", la[:, k], Fk, Fk)
                B = np.einsum("nim,nkm->nik", Fk, Fk)
                A += b * (np.einsum("n,nik,jl->nijkl", mu[:, k], B, eye) + np.einsum("n,nil,nkj->nijkl", mu[:, k], Fk, Fk))
                A += np.einsum("ik,njl->nijkl", eye, S[:, k])
            G = self.G[:, k]
            half = np.matmul(A.transpose(0, 1, 3, 2, 4).reshape(n, 27, 3), G.transpose(0, 2, 1))  # (i k j), b
            half = half.reshape(n, 3, 3, 3, 10).transpose(0, 3, 1, 2, 4).reshape(n, 3, 90)  # j, (i k b)
            full = np.matmul(G, half).reshape(n, 10, 3, 3, 10).transpose(0, 1, 2, 4, 3)  # a, i, b, k
            K += self.w[:, k, None, None] * full.reshape(n, 30, 30)
        values = K.reshape(n, 900) + (mass * self.element_mass if mass else 0.0)
        data = np.bincount(self.slot, values.ravel()[self.kept], minlength=self.entries)
        return scipy.sparse.csr_matrix((data, *self.pattern), shape=(self.size, self.size))

    def equilibrium(self, x, loads, tolerance=1e-9, most=60):
        """Newton's method with halved steps from x under nodal loads."""
        force, energy, _, state = self.internal(x)
        for _ in range(most):
            residual = (loads - force).ravel()[self.free]
            solve = factor(self.tangent(state))
            step = np.zeros(x.size)
            step[self.free] = solve(residual)
            step = step.reshape(-1, 3)
            size, scale = np.abs(step).max(), 1.0
            if size > 0.02:
                scale = 0.02 / size
            while True:
                trial = x + scale * step
                force_, energy_, _, state_ = self.internal(trial)
                if state_[2].min() > 0.2 or scale < 1e-3:
                    break
                scale *= 0.5
            x, force, energy, state = trial, force_, energy_, state_
            if scale == 1.0 and size < tolerance:
                return x
        raise RuntimeError("no equilibrium")

    def settle(self, steps=8):
        """The equilibrium under gravity by load stepping."""
        x = self.X.copy()
        for k in range(steps):
            x = self.equilibrium(x, self.weight * (k + 1) / steps, 1e-9 if k == steps - 1 else 1e-4)
        return x

    def turns(self, x):
        """Rotation of each node's neighbourhood."""
        F = self.gradient(x).mean(axis=1) * self.volume[:, None, None]
        sums = np.stack([np.bincount(self.elements.ravel(), np.repeat(F[:, i, j], 10), minlength=len(x)) for i in range(3) for j in range(3)], axis=1)
        u, _, v = np.linalg.svd(sums.reshape(-1, 3, 3))
        return u @ v

    def energies(self, x, v):
        force, elastic, power, _ = self.internal(x, v)
        Mv = self.M @ v
        kinetic = 0.5 * (v * Mv).sum()
        return kinetic, elastic, -(self.weight * (x - self.X)).sum(), power + self.alpha * 2 * kinetic

    def swing(self, x, step, steps, tolerance=2e-8, watch=None):
        """Free motion from rest at x: yields (time, places, velocities) after each step. BDF2; the first step is implicit Euler's.

        A factorisation is used as long as Newton's method converges; it is turned along with each node's neighbourhood."""
        h = step
        xs, vs = [x.copy()] * 3, [np.zeros_like(x)] * 3
        solve = None
        for n in range(steps):
            if n == 0:
                c, guess = 1 / h, xs[0]
                velocity = lambda y: (y - xs[0]) / h
                acceleration = lambda w: (w - vs[0]) / h
            else:
                c, guess = 1.5 / h, 3 * xs[0] - 3 * xs[1] + xs[2] if n > 1 else 2 * xs[0] - xs[1]
                velocity = lambda y: (1.5 * y - 2 * xs[0] + 0.5 * xs[1]) / h
                acceleration = lambda w: (1.5 * w - 2 * vs[0] + 0.5 * vs[1]) / h
            y = guess.copy()
            made, before = False, math.inf
            now = self.turns(y)
            for k in range(40):
                slow = k > 1 and size > 0.4 * before
                if slow and not made and size > 1e-5:
                    y = guess.copy()
                before = size if k else math.inf
                w = velocity(y)
                force, _, _, state = self.internal(y, w)
                residual = (self.weight - force - self.M @ (acceleration(w) + self.alpha * w)).ravel()[self.free]
                if n <= 1 and k == 0 or (not made and (k >= 7 or slow)):
                    solve = factor(self.tangent(state, c, c * c + self.alpha * c))
                    made, then = True, now
                turn = now @ then.swapaxes(1, 2)
                delta = np.zeros(y.shape)
                delta.ravel()[self.free] = residual
                delta = np.einsum("nji,nj->ni", turn, delta)
                delta.ravel()[self.free] = solve(delta.ravel()[self.free])
                delta = np.einsum("nij,nj->ni", turn, delta)
                y += delta
                size = np.abs(delta).max()
                if size < tolerance:
                    break
            else:
                raise RuntimeError(f"step {n}: Newton's method stands at {size:g} m")
            if watch is not None:
                watch["iterations"] = watch.get("iterations", 0) + k + 1
                watch["factors"] = watch.get("factors", 0) + made
            xs, vs = [y, *xs[:2]], [velocity(y), *vs[:2]]
            yield (n + 1) * h, y, vs[0]


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
    scan = scan + normals(scan, triangles) * smooth_noise(scan, 0.00025, 0.02, random)[:, None]
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
    (out / "capture.toml").write_text(CAPTURE.format(mass=round(body.mass, 7), frame_rate=rate, frame_count=count, start_frame=start))
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


# --- checks -----------------------------------------------------------------------------------------------------------------------

def beam_mesh(length, width, height, n):
    """A bar of boxes of six tetrahedra each."""
    x, y, z = (np.linspace(0, s, k + 1) for s, k in zip((length, height, width), n))
    corners = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    at = lambda i, j, k: (i * (n[1] + 1) + j) * (n[2] + 1) + k
    tetrahedra = []
    for i in range(n[0]):
        for j in range(n[1]):
            for k in range(n[2]):
                for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)):
                    p, path = [i, j, k], [at(i, j, k)]
                    for axis in order:
                        p[axis] += 1
                        path.append(at(*p))
                    tetrahedra.append(path)
    tetrahedra = np.array(tetrahedra)
    p = corners[tetrahedra]
    turned = np.linalg.det(p[:, 1:] - p[:, :1]) < 0
    tetrahedra[turned] = tetrahedra[turned][:, [0, 2, 1, 3]]
    return corners, tetrahedra


def verify():
    figures = {}
    L, b, h, E, nu, rho = 0.2, 0.012, 0.008, 2.0e6, 0.0, 300.0
    corners, tetrahedra = beam_mesh(L, b, h, (24, 1, 2))
    nodes, elements = quadratic(corners, tetrahedra)
    even = lambda points: np.full(len(points), E)
    make = lambda **more: Body(nodes, elements, nodes[:, 0] < 1e-9, even, nu, rho, **more)
    body = make()
    inertia, area = b * h**3 / 12, b * h
    tip = np.argmax(nodes[:, 0])
    # an end load so small that the beam stays straight
    share = np.where(nodes[:, 0] > L - 1e-9, 1.0, 0.0)
    share /= share.sum()
    force = 1e-4
    loads = np.outer(share * force, [0.0, -1.0, 0.0])
    x = body.equilibrium(nodes.copy(), loads)
    found = -(share @ (x - nodes))[1]
    shear = E / (2 * (1 + nu))
    theory = force * L**3 / (3 * E * inertia) + force * L / (shear * area * 5 / 6)
    figures["tip_deflection"] = {"found": found, "beam_theory": theory, "off": found / theory - 1}
    # first frequencies of bending, by the linear problem and by a small swing
    x0 = nodes.copy()
    state = body.internal(x0)[3]
    upper = body.tangent(state)
    K = upper + scipy.sparse.triu(upper, 1).T
    M = scipy.sparse.kron(body.M, scipy.sparse.identity(3)).tocsr()[body.free][:, body.free]
    values = np.sort(scipy.sparse.linalg.eigsh(K, 3, M, sigma=0, which="LM", return_eigenvectors=False))
    euler = lambda thick: 1.8751041**2 / (2 * math.pi * L**2) * math.sqrt(E * thick**2 / 12 / rho)
    figures["first_frequency"] = {"found": math.sqrt(values[0]) / (2 * math.pi), "beam_theory": euler(h), "off": math.sqrt(values[0]) / (2 * math.pi) / euler(h) - 1}
    # the swing after an end load is taken away: period by crossings, decay against alpha/2 + beta w^2/2; without gravity
    alpha, beta = 0.3, 0.003
    body = make(alpha=alpha, beta=beta)
    body.weight = body.weight * 0
    x = body.equilibrium(nodes.copy(), loads)
    h_step, steps = 1 / 360, 720
    course, times = [], []
    for t, y, v in body.swing(x, h_step, steps):
        course.append((share @ (y - nodes))[1])
        times.append(t)
    course, times = np.array(course), np.array(times)
    cross = [times[i] + h_step * course[i] / (course[i] - course[i + 1]) for i in range(len(course) - 1) if course[i] < 0 <= course[i + 1]]
    period = (cross[-1] - cross[0]) / (len(cross) - 1)
    figures["swing"] = {"frequency": 1 / period, "off": (1 / period) / figures["first_frequency"]["found"] - 1, "step_s": h_step}
    peaks = [i for i in range(1, len(course) - 1) if course[i] < course[i - 1] and course[i] <= course[i + 1] and course[i] < 0]
    def height(i):
        a, b_, c = course[i - 1:i + 2]
        return -(b_ - (a - c)**2 / (8 * (a - 2 * b_ + c)))
    rate = -math.log(height(peaks[-1]) / height(peaks[1])) / (times[peaks[-1]] - times[peaks[1]])
    omega = 2 * math.pi / period
    figures["decay"] = {"found": rate, "theory": 0.5 * (alpha + beta * omega**2), "off": rate / (0.5 * (alpha + beta * omega**2)) - 1}
    # a large swing under gravity: energy that is lost against what the dampings take
    body = make(alpha=alpha, beta=beta)
    x = body.settle()
    figures["large_sag_of_length"] = float(np.linalg.norm(x[tip] - nodes[tip]) / L)
    x = body.equilibrium(x, body.weight + np.outer(share * 0.02, [0.0, 0.5, 0.87]))
    energy, taken = [body.energies(x, np.zeros_like(x))], 0.0
    for n, (t, y, v) in enumerate(body.swing(x, h_step, 720)):
        energy.append(body.energies(y, v))
        taken += (0.5 * (energy[-2][3] + energy[-1][3]) if n else energy[-1][3]) * h_step
    lost = sum(energy[0][:3]) - sum(energy[-1][:3])
    figures["energy"] = {"lost": lost, "taken_by_damping": taken, "off": taken / lost - 1}
    # derivatives, and turned by any rotation
    random = np.random.default_rng(1)
    x = nodes + random.normal(size=nodes.shape) * 2e-4
    force0, _, _, state = body.internal(x)
    upper = body.tangent(state)
    d = random.normal(size=nodes.shape) * (body.free.reshape(-1, 3))
    eps = 1e-8
    numeric = (body.internal(x + eps * d)[0] - body.internal(x - eps * d)[0]) / (2 * eps)
    exact = (upper + scipy.sparse.triu(upper, 1).T) @ d.ravel()[body.free]
    figures["tangent"] = float(np.abs(numeric.ravel()[body.free] - exact).max() / np.abs(exact).max())
    Q, _ = np.linalg.qr(random.normal(size=(3, 3)))
    Q *= np.sign(np.linalg.det(Q))
    v = random.normal(size=nodes.shape)
    spin = np.array([[0, -1.0, 2.0], [1.0, 0, -0.5], [-2.0, 0.5, 0]])
    a = body.internal(x, v)[0] @ Q.T
    b_ = body.internal(x @ Q.T, v @ Q.T + (x @ Q.T) @ spin.T)[0]
    figures["turned"] = float(np.abs(a - b_).max() / np.abs(a).max())
    return figures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, help="folder of the recording")
    parser.add_argument("--verify", type=pathlib.Path, metavar="FILE", help="check the simulator and write the figures")
    parser.add_argument("--cell", type=float, help="edge of a tetrahedron [m]")
    arguments = parser.parse_args()
    if arguments.cell:
        TRUTH["cell"] = arguments.cell
    if arguments.verify:
        figures = verify()
        arguments.verify.parent.mkdir(parents=True, exist_ok=True)
        arguments.verify.write_text(json.dumps(figures, indent=1) + "\n")
        print(json.dumps(figures, indent=1))
    if arguments.out:
        record(arguments.out)


if __name__ == "__main__":
    main()
