import os
import pathlib

import numpy as np
import pytest

import pliant

ROOT = pathlib.Path(__file__).resolve().parents[2]
RING = ROOT / "examples/oracle-bounce-a"


def bar(**choices):
    """A bar of few elements, held at one end, that a force bends as it falls."""
    body = choices.pop("body", None) or pliant.Body.box([0, 0, 0], [0.2, 0.04, 0.04], [3, 1, 1], quadratic=choices.pop("quadratic", False))
    given = dict(frame_rate=30, frame_count=4, youngs_modulus=2e4, poissons_ratio=0.3, density=900, mass_damping=0.3, stiffness_damping=2e-3,
                 fixed=[pliant.Box(least=[-0.01, -1, -1], greatest=[0.001, 1, 1])],
                 forces=[pliant.Force(at=[0.2, 0.02, 0.02], radius=0.02, force=[0, 0, 0.02])], law="corotated", damping="rayleigh")
    return pliant.Motion(body, **{**given, **choices})


def thrown(**choices):
    """A small cube that flies and meets the floor."""
    body = pliant.Body.box([-0.03, 0.01, -0.03], [0.03, 0.07, 0.03], [1, 1, 1], quadratic=False)
    given = dict(frame_rate=60, frame_count=4, youngs_modulus=2e4, density=300, mass_damping=0.3, stiffness_damping=2e-3, linear_velocity=[0.3, -0.8, 0.1], angular_velocity=[1.0, 2.0, -3.0],
                 planes=[pliant.Plane(point=[0, 0, 0], normal=[0, 1, 0], friction=0.2)])
    return pliant.Motion(body, **{**given, **choices})


@pytest.fixture
def rng():
    return np.random.default_rng(7)


@pytest.fixture(scope="session")
def ring_fit(tmp_path_factory):
    """A quick fit of the example, and what was told on the way."""
    out = tmp_path_factory.mktemp("ring")
    lines, events = [], []
    result = pliant.fit(RING, out, settings=QUICK, on_line=lines.append, on_event=lambda event, line: events.append(event))
    return result, lines, events


# Coarse and short: what is tested is the way through, not how good the estimate is.
QUICK = {"cells": 6, "coarse_cells": 6, "starts": 1, "most_starts": 1, "budget": 0, "alternatives": False, "points_per_frame": 200, "max_iterations": 8}


@pytest.fixture(scope="session")
def program():
    path = os.environ.get("PLIANT_PROGRAM")
    if not path:
        pytest.skip("PLIANT_PROGRAM does not name the program")
    return path
