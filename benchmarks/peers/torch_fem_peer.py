"""torch-fem, which has statics of solids and no motion. Double precision; its own choice of a linear solver (direct at these sizes)."""
import importlib.metadata
import os

import torch
import torchfem.materials
import torchfem.solid

from bodies import GRAVITY
from measured import Clock, Outcome, Unreached

METHODS = {}
EQUILIBRIA = {"Saint Venant and Kirchhoff": {"law": "saint_venant_kirchhoff"}, "neo-Hookean": {"law": "stable_neo_hookean"}}
INCREMENTS = (1, 4)  # of gravity: it halves those that do not converge by itself


def version():
    return f"{importlib.metadata.version('torch-fem')}, PyTorch {torch.__version__}"


def saint_venant_kirchhoff(F, params):
    lam, mu = params[..., 0], params[..., 1]
    E = 0.5 * (F.transpose(-1, -2) @ F - torch.eye(3))
    return 0.5 * lam * torch.einsum("...ii", E) ** 2 + mu * (E * E).sum((-1, -2))


def stable_neo_hookean(F, params):
    lam, mu = params[..., 0], params[..., 1]
    J = torch.linalg.det(F)
    return 0.5 * mu * ((F * F).sum((-1, -2)) - 3) - mu * (J - 1) + 0.5 * (lam + mu) * (J - 1) ** 2


def equilibrium(body, method, settings):
    torch.set_default_dtype(torch.float64)
    torch.set_num_threads(int(os.environ.get("OMP_NUM_THREADS", "1")))
    psi = {"saint_venant_kirchhoff": saint_venant_kirchhoff, "stable_neo_hookean": stable_neo_hookean}[EQUILIBRIA[method]["law"]]
    with Clock() as start:
        material = torchfem.materials.Hyperelastic3D(psi, list(body.lame), body.density)
        model = torchfem.solid.Solid(torch.tensor(body.nodes), torch.tensor(body.elements, dtype=torch.long), material)
        model.constraints[torch.tensor(body.held)] = True
        model.forces = model.integrate_body_load(body.density * torch.tensor(GRAVITY))
    with Clock() as clock:
        try:
            moved = model.solve(increments=torch.linspace(0, 1, settings["increments"] + 1), max_iter=30)[0]
        except RuntimeError as error:
            raise Unreached(f"torch-fem: {error}") from error
    return Outcome((torch.tensor(body.nodes) + moved)[None].numpy(), 0, clock.processor_s, clock.wall_s, start.processor_s)
