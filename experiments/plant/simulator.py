"""A simulator of elastic motion whose physics is not that of pliant's fit: 10-node tetrahedra, a compressible neo-Hookean law
    W = mu/2 (I1 - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)^2
whose small-strain limit is Hooke's law with (E(X), nu), Kelvin-Voigt damping S_v = beta (lambda tr(Edot) I + 2 mu Edot) and mass
damping, a consistent mass, BDF2 with Newton's method; the equilibrium under gravity by load stepping.

Needs numpy and scipy. Works in one thread. simulator_checks.py holds it against theory."""
import math
import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

GRAVITY = np.array([0.0, -9.81, 0.0])
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
        force, _, _, state = self.internal(x)
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
                force_, _, _, state_ = self.internal(trial)
                if state_[2].min() > 0.2 or scale < 1e-3:
                    break
                scale *= 0.5
            x, force, state = trial, force_, state_
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
            made, size, before = False, math.inf, math.inf
            now = self.turns(y)
            for k in range(40):
                slow = k > 1 and size > 0.4 * before
                if slow and not made and size > 1e-5:
                    y = guess.copy()
                before = size
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
