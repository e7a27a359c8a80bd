"""Fine references that share no code with any program: the same tetrahedra in double precision, explicit in time, with each law's stress and
each program's masses; and equilibria of the same by Newton's method. numpy and scipy.

An element's stress is the first Piola-Kirchhoff stress P(F) of a constant deformation gradient F, with lambda and mu of small strains."""
import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from bodies import GRAVITY, volumes


def cofactor(A):
    """Of each matrix; det(A) inverse(A) transposed."""
    return np.stack([np.cross(A[:, 1], A[:, 2]), np.cross(A[:, 2], A[:, 0]), np.cross(A[:, 0], A[:, 1])], axis=1)


def determinant(A, C):
    return np.einsum("ej,ej->e", A[:, 0], C[:, 0])


def rotation(A):
    """The rotation of A = R S by Newton's iteration of the polar decomposition; A must not be inverted."""
    R = A
    for _ in range(50):
        C = cofactor(R)
        next_R = 0.5 * (R + C / determinant(R, C)[:, None, None])
        if np.abs(next_R - R).max() < 1e-14:
            return next_R
        R = next_R
    return R


# Of transposed gradients A = F^T, to transposed stresses P^T: that is how the gradient's matrix gives and takes them.

def corotated(A, lam, mu):
    R = rotation(A)
    return 2 * mu * (A - R) + (lam * (np.einsum("eij,eij->e", R, A) - 3))[:, None, None] * R


def neo_hookean(A, lam, mu):
    """Energy mu / 2 (F : F - 3) - mu ln J + lambda / 2 (ln J)^2."""
    C = cofactor(A)
    J = determinant(A, C)
    return mu * A + ((lam * np.log(J) - mu) / J)[:, None, None] * C


def stable_neo_hookean(A, lam, mu):
    """Smith et al. 2018 without the logarithm: energy mu / 2 (F : F - 3) + l / 2 (J - 1 - mu / l)^2, l = lambda + mu."""
    C = cofactor(A)
    return mu * A + ((lam + mu) * (determinant(A, C) - 1) - mu)[:, None, None] * C


def stable_neo_hookean_log(A, lam, mu):
    """Smith et al. 2018, eq. 14: m = 4/3 mu and l = lambda + 5/6 mu; energy m / 2 (F : F - 3) + l / 2 (J - a)^2 - m / 2 ln(F : F + 1)."""
    m, l = 4 / 3 * mu, lam + 5 / 6 * mu
    C = cofactor(A)
    I = np.einsum("eij,eij->e", A, A)
    return (m * (1 - 1 / (I + 1)))[:, None, None] * A + (l * (determinant(A, C) - 1) - 0.75 * m)[:, None, None] * C


def saint_venant_kirchhoff(A, lam, mu):
    E = 0.5 * (A @ A.transpose(0, 2, 1) - np.eye(3))
    return (lam * np.trace(E, axis1=1, axis2=2)[:, None, None] * np.eye(3) + 2 * mu * E) @ A


LAWS = {law.__name__: law for law in (corotated, neo_hookean, stable_neo_hookean, stable_neo_hookean_log, saint_venant_kirchhoff)}


class Tetrahedra:
    """Forces and masses of a body's elements, held nodes left out of the unknowns."""

    def __init__(self, body, law, consistent):
        self.law, (self.lam, self.mu) = LAWS[law], body.lame
        self.nodes, self.free, n, e = body.nodes, body.free, len(body.nodes), len(body.elements)
        self.volumes = volumes(body.nodes, body.elements)
        inverse = np.linalg.inv(body.nodes[body.elements[:, 1:]] - body.nodes[body.elements[:, :1]])  # rows: gradients of corners 1 to 3, transposed
        of_corner = np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2)  # e x 3 directions x 4 corners
        rows = np.repeat(np.arange(3 * e), 4)
        self.gradient = scipy.sparse.csr_array((of_corner.ravel(), (rows, np.repeat(body.elements, 3, axis=0).ravel())), shape=(3 * e, n))
        self.back = -self.gradient.T.tocsr()[self.free]
        share = body.density * self.volumes
        corners = np.repeat(body.elements, 4, axis=1).ravel(), np.tile(body.elements, (1, 4)).ravel()
        kernel = (np.ones((4, 4)) + np.eye(4)) / 20 if consistent else np.eye(4) / 4
        mass = scipy.sparse.csr_array(((share[:, None, None] * kernel).ravel(), corners), shape=(n, n))
        self.weight = (mass @ np.ones(n))[self.free, None] * np.array(GRAVITY)
        mass = mass[self.free][:, self.free].tocsc()
        self.inverse_mass = scipy.sparse.linalg.splu(mass).solve if consistent else lambda f, m=mass.diagonal()[:, None]: f / m

    def forces(self, x):
        """Of the free nodes, gravity with them [N], at positions of all [m]."""
        A = (self.gradient @ x).reshape(-1, 3, 3)
        P = self.law(A, self.lam, self.mu) * self.volumes[:, None, None]
        return self.back @ P.reshape(-1, 3) + self.weight

    def stiffness(self):
        """Of small strains, of the free nodes' coordinates."""
        size, x = len(self.free), scipy.sparse.identity(3)
        D = []
        for i in range(3):
            for j in range(3):
                A = np.zeros((1, 3, 3))
                A[0, j, i] = 1.0  # of the displacement gradient (i, j), transposed
                E = 0.5 * (A[0] + A[0].T)
                D.append((self.lam * np.trace(E) * np.eye(3) + 2 * self.mu * E).T.ravel())
        # G: coordinates to transposed gradients, element by element (j, i)
        G = scipy.sparse.kron(self.gradient[:, self.free], x, format="csr")
        order = [3 * j + i for i in range(3) for j in range(3)]
        D = np.array(D)[np.argsort(order)]
        blocks = scipy.sparse.kron(scipy.sparse.diags(self.volumes), D)
        return (G.T @ blocks @ G).tocsc(), size


def motion(body, law, consistent, step):
    """Positions at the compared times, times x nodes x 3 [m], by the velocity form of Verlet's scheme: second order, no damping of its own.
    Throws FloatingPointError where the step is too long."""
    mesh, x = Tetrahedra(body, law, consistent), body.nodes.copy()
    v = np.tile(np.array(body.velocity), (len(mesh.free), 1))
    a = mesh.inverse_mass(mesh.forces(x))
    out = []
    for _ in body.times:
        for _ in range(body.steps_between(step)):
            v += 0.5 * step * a
            x[mesh.free] += step * v
            a = mesh.inverse_mass(mesh.forces(x))
            v += 0.5 * step * a
        if not np.isfinite(x).all():
            raise FloatingPointError(f"{body.name}, {law}: the motion is lost at steps of {step} s; take shorter ones")
        out.append(x.copy())
    return np.array(out)


def equilibrium(body, law, tolerance=1e-10):
    """Positions at rest under gravity, nodes x 3 [m]: Newton's method in four steps of gravity, its systems solved by conjugate gradients with
    central differences of the forces, preconditioned by the stiffness of small strains. To a force of so much of the weight."""
    mesh, x = Tetrahedra(body, law, consistent=False), body.nodes.copy()
    stiffness, size = mesh.stiffness()
    inverse = scipy.sparse.linalg.splu(stiffness)
    whole = mesh.weight
    for part in (0.25, 0.5, 0.75, 1.0):
        mesh.weight = part * whole
        for _ in range(50):
            force = mesh.forces(x)
            if np.linalg.norm(force) < tolerance * np.linalg.norm(whole):
                break

            def product(d, x=x):
                scale = 1e-6 / max(np.abs(d).max(), 1e-300)
                ends = []
                for sign in (1, -1):
                    moved = x.copy()
                    moved[mesh.free] += sign * scale * d.reshape(size, 3)
                    ends.append(mesh.forces(moved))
                return (ends[1] - ends[0]).ravel() / (2 * scale)

            operator = scipy.sparse.linalg.LinearOperator((3 * size, 3 * size), matvec=product)
            change, _ = scipy.sparse.linalg.cg(operator, force.ravel(), maxiter=400,  # its tolerance, 1e-5, has two names
                                               M=scipy.sparse.linalg.LinearOperator((3 * size, 3 * size), matvec=inverse.solve))
            step = 1.0
            while step > 1e-3:
                moved = x.copy()
                moved[mesh.free] += step * change.reshape(size, 3)
                with np.errstate(invalid="ignore"):
                    after = np.linalg.norm(mesh.forces(moved))
                if after < np.linalg.norm(force):
                    break
                step /= 2
            x = moved
        else:
            raise FloatingPointError(f"{body.name}, {law}: no equilibrium found")
    return x
