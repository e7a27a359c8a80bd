"""Fitted models and recordings."""
import dataclasses
import pathlib

import numpy as np

from . import _pliant
from ._motion import Motion


class Model:
    """A fitted elastic object, ready to be simulated.

    :param path: `model.toml`, or the folder of a fit
    :raises InputError: where a file is missing or wrong, with its place
    """

    def __init__(self, path):
        path = pathlib.Path(path)
        self._model = _pliant.Model(path / "model.toml" if path.is_dir() else path)

    name = property(lambda self: self._model.name)
    youngs_modulus = property(lambda self: self._model.youngs_modulus, doc="[Pa]; the mean by volume where elements differ")
    poissons_ratio = property(lambda self: self._model.poissons_ratio, doc="[-]")
    mass_damping = property(lambda self: self._model.mass_damping, doc="Rayleigh, [1/s]")
    stiffness_damping = property(lambda self: self._model.stiffness_damping, doc="[s]")
    density = property(lambda self: self._model.density, doc="[kg/m^3]")
    mass = property(lambda self: self._model.mass, doc="[kg]")
    law = property(lambda self: self._model.law, doc="of great strains: ogden, neo_hookean, linear or sampled; empty: by element's mean strain")
    element_moduli = property(lambda self: self._model.element_moduli, doc="Young's modulus of each element [Pa]")

    @property
    def vertices(self):
        """n x 3 [m], of its surface, stress-free"""
        return self._model.vertices

    @property
    def triangles(self):
        """m x 3 vertices, counter-clockwise from outside"""
        return self._model.triangles

    @property
    def body(self):
        """Its elements, stress-free."""
        return self._model.body()

    def motion(self, situation=None, *, duration=None) -> Motion:
        """The model as its recording was, or in a situation: wind, rain, hands, led regions, obstacles, gravity over time.

        :param situation: file of a situation (docs/formats.md)
        :param duration: [s], in place of the file's
        """
        return Motion._of_model(self._model, situation, duration)

    def with_values(self, *, youngs_modulus=None, poissons_ratio=None, mass_damping=None, stiffness_damping=None):
        """The same model of another material. Where moduli differ from element to element all are scaled alike."""
        other = Model.__new__(Model)
        other._model = self._model.with_values(youngs_modulus, poissons_ratio, mass_damping, stiffness_damping)
        return other

    def save(self, folder):
        """Writes model.toml, surface.ply and model.vtu."""
        self._model.save(folder)

    def simulate(self, out, *, situation=None, duration=None):
        """Simulates and writes trajectory.pvd (ParaView) and fields.html into a folder (the command `pliant simulate`)."""
        self._model.simulate(out, situation, duration or 0.0)

    def export(self, to, out, *, linear=False, cells=None, result=None):
        """Writes the model for another simulator (the command `pliant export`).

        :param to: one of `export_formats`
        :param linear: linear tetrahedra also where the format takes quadratic ones
        :param cells: along the object's longest axis, of a mesh laid anew; left out: chosen so that frequencies agree
        :param result: result.json of the fit, for the values and intervals of card.json
        :returns: files; what moduli were multiplied by; frequencies [Hz] and sag [m] of the model and of what was written; notes
        """
        return self._model.export(to, out, linear, cells, result)

    def __repr__(self):
        return f"<pliant.Model {self.name!r}: E {self.youngs_modulus:.4g} Pa, nu {self.poissons_ratio:.3g}>"


def export_formats():
    """Formats of `Model.export`, each with the program that reads it."""
    return _pliant.export_formats()


@dataclasses.dataclass(frozen=True)
class ObservedFrame:
    """What sensors saw of the object in a frame."""

    frame: int
    points: np.ndarray
    """n x 3 [m], world coordinates, on the object's surface"""
    noise: np.ndarray
    """n standard deviations [m], along the surface's normal"""


class Capture:
    """A recording, read and validated.

    :param path: its folder, or its capture.toml
    :raises InputError: with every problem found, each with its place
    """

    def __init__(self, path):
        self._capture = _pliant.Capture(path)

    name = property(lambda self: self._capture.name)
    folder = property(lambda self: self._capture.folder)
    sha256 = property(lambda self: self._capture.sha256, doc="of capture.toml and the surfaces' files")
    frame_rate = property(lambda self: self._capture.frame_rate, doc="[Hz]; 0: times say all")
    frame_count = property(lambda self: self._capture.frame_count)
    start_frame = property(lambda self: self._capture.start_frame, doc="the first in which the object moves freely")
    times = property(lambda self: np.array(self._capture.times), doc="[s] of each frame")
    mass = property(lambda self: self._capture.mass, doc="[kg], or None")
    gravity = property(lambda self: self._capture.gravity, doc="[m/s^2], or None where it is to be estimated")
    cameras = property(lambda self: self._capture.cameras, doc="names of depth cameras")
    has_clouds = property(lambda self: self._capture.has_clouds)
    press_count = property(lambda self: self._capture.press_count)
    vertices = property(lambda self: self._capture.vertices, doc="n x 3 [m], of the surface at rest; None: there is none")
    triangles = property(lambda self: self._capture.triangles, doc="m x 3 vertices, counter-clockwise from outside")

    def observed(self, *, points_per_frame=0):
        """What sensors saw of the object, frame by frame: background, obstacles and flying pixels left out.

        :param points_per_frame: at most so many, evenly spread; 0: all
        """
        return [ObservedFrame(f["frame"], f["points"], f["noise"]) for f in self._capture.observed(points_per_frame)]

    def __repr__(self):
        return f"<pliant.Capture {self.name!r}: {self.frame_count} frames>"
