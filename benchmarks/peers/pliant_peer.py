"""pliant, by its Python package. A simulation runs in one thread."""
import numpy as np

import pliant
from bodies import HELD
from measured import Clock, Outcome

STEPS = {"bar": (0.02, 0.01, 0.005, 0.0025, 0.00125), "torus": (0.005, 0.0025, 0.00125, 0.000625)}
METHODS = {
    "bar": {
        "neo-Hookean": {"law": "stable_neo_hookean", "consistent": True},
        "corotated": {"law": "corotated", "consistent": True},
        "neo-Hookean, fully implicit": {"law": "stable_neo_hookean", "consistent": True},
    },
    "torus": {"neo-Hookean": {"finest": {"step": 0.000078125}}},
}
EQUILIBRIA = {"corotated": {"law": "corotated"}}


def version():
    return pliant.__version__


def runs(body, method):
    return [{"step": step} for step in STEPS[body][:2 if "implicit" in method else None]]


def motion(body, method, **more):
    own = pliant.Body.of_tetrahedra(body.nodes, body.elements)
    return pliant.Motion(own, youngs_modulus=body.youngs_modulus, poissons_ratio=body.poissons_ratio, density=body.density,
                         linear_velocity=body.velocity, planes=[pliant.Plane(point=[0, 0, 0], normal=[0, 1, 0])] if body.floor else [],
                         fixed=[pliant.Box(least=[-1, -1, -1], greatest=[HELD, 1, 1])] if len(body.held) else [],
                         law="corotated" if "corotated" in method else "neo_hookean", **more)


def run(body, method, settings):
    times = np.concatenate([[0.0], body.times])
    integrator = "newton" if "implicit" in method else "lagged"
    default = motion(body, method, times=times).longest_step
    with Clock() as start:  # a frame's steps are the fewest that are no longer than the longest
        made = motion(body, method, times=times, integrator=integrator, steps=(1 - 1e-9) * default / settings["step"])
    with Clock() as clock:
        trajectory = made.run()
    return Outcome(trajectory.positions[1:], trajectory.steps, clock.processor_s, clock.wall_s, start.processor_s)


def equilibrium(body, method, _):
    with Clock() as start:
        made = motion(body, method, is_static=True)
    with Clock() as clock:
        trajectory = made.run()
    return Outcome(trajectory.positions, 0, clock.processor_s, clock.wall_s, start.processor_s)
