#!/usr/bin/env python3
"""Checks of the simulator against beam theory, central differences and the balance of energy.

    simulator_checks.py FILE    write the figures (JSON)

Needs numpy and scipy."""
import argparse
import json
import math
import pathlib

from simulator import Body, quadratic  # first: it sets the number of threads

import numpy as np
import scipy.sparse
import scipy.sparse.linalg


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
    parser.add_argument("file", type=pathlib.Path, help="of the figures")
    file = parser.parse_args().file
    figures = verify()
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(figures, indent=1) + "\n")
    print(json.dumps(figures, indent=1))


if __name__ == "__main__":
    main()
