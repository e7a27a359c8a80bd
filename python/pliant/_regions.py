"""Parts of space, obstacles and forces of a motion. Metres, newtons, seconds, world coordinates."""
import dataclasses
import typing

import numpy as np

Vector = typing.Sequence[float]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Box:
    """An axis-aligned box [m] in which the object is held; displacement [m] is where it is held from where it rests."""

    least: Vector
    greatest: Vector
    displacement: Vector = (0.0, 0.0, 0.0)

    def _numbers(self):
        return "box", [np.asarray(self.least, float), np.asarray(self.greatest, float)], np.asarray(self.displacement, float)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Ball:
    """A ball [m] in which the object is held."""

    centre: Vector
    radius: float
    displacement: Vector = (0.0, 0.0, 0.0)

    def _numbers(self):
        return "ball", [np.asarray(self.centre, float), np.array([float(self.radius)])], np.asarray(self.displacement, float)


@dataclasses.dataclass(frozen=True, kw_only=True)
class HalfSpace:
    """Half of space in which the object is held; the normal points into it."""

    point: Vector
    normal: Vector
    displacement: Vector = (0.0, 0.0, 0.0)

    def _numbers(self):
        return "half_space", [np.asarray(self.point, float), np.asarray(self.normal, float)], np.asarray(self.displacement, float)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Plane:
    """An obstacle: the object stays on the side to which the normal points. Coulomb friction [-]."""

    point: Vector
    normal: Vector
    friction: float = 0.0

    def _numbers(self):
        return np.asarray(self.point, float), np.asarray(self.normal, float), float(self.friction)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Force:
    """A force [N] on a patch of the surface about `at`, of that radius [m].

    `force` is one vector, or one a time of `times` [s], by monotone cubics in between. How strong it is, a factor, is the
    parameter `strength@1`, `strength@2`, ... of the motion, in the order of the forces, and has a derivative.
    """

    at: Vector
    radius: float
    force: typing.Any
    times: typing.Any = None

    def _numbers(self):
        times = np.zeros(1) if self.times is None else np.asarray(self.times, float)
        return np.asarray(self.at, float), float(self.radius), times, np.atleast_2d(np.asarray(self.force, float))
