"""Motions of a body, with derivatives by everything that they depend on."""
import dataclasses
import typing

import numpy as np

from . import _pliant

Values = typing.Union[None, np.ndarray, typing.Mapping[str, typing.Any]]


@dataclasses.dataclass(frozen=True)
class Trajectory:
    """Frames of a motion."""

    times: np.ndarray
    """[s], one a frame"""
    positions: np.ndarray
    """frames x nodes x 3 [m]"""
    velocities: np.ndarray
    """frames x nodes x 3 [m/s]; zero at rest"""
    steps: int
    """time steps that were taken"""
    body: _pliant.Body
    """what moved"""

    def at(self, points):
        """Where points of the object, m x 3 [m] at rest, are in each frame: frames x m x 3 [m]. Such as the vertices of its surface."""
        nodes, weights = self.body.weights_at(points)
        return np.einsum("fmkd,mk->fmd", self.positions[:, nodes], weights)


@dataclasses.dataclass(frozen=True)
class Gradient:
    """Derivatives of a scalar by what a motion depends on."""

    values: dict
    """by parameter name: a number, or an array"""
    theta: np.ndarray
    """the same, as one vector"""
    start: np.ndarray
    """nodes x 3, by where the nodes start [1/m]"""
    start_velocities: np.ndarray
    """nodes x 3, by how fast they start [s/m]"""
    reference: typing.Optional[np.ndarray] = None
    """nodes x 3, by where the nodes are stress-free [1/m], where it was asked for"""


class Motion:
    """A body in a scene: how it moves, or where it comes to rest.

    Made of a body and keywords, or by `Model.motion`. Its parameters have names and values, which may be given anew for
    each run: `names` lists them. Calls release the interpreter's lock; those of one motion take turns.

    :param body: a `Body`
    :param times: [s] of each frame; or `frame_rate` [Hz] and `frame_count`
    :param youngs_modulus: [Pa], a number, or one a control of the body
    :param poissons_ratio: [-], -1 .. 0.5
    :param density: [kg/m^3]
    :param mass_damping: Rayleigh, [1/s]
    :param stiffness_damping: Rayleigh, or Kelvin and Voigt's, [s]
    :param gravity: [m/s^2]
    :param linear_velocity: of the centre of mass at the start [m/s]
    :param angular_velocity: about it [rad/s]
    :param planes: obstacles, `Plane`
    :param fixed: where the object is held: `Box`, `Ball`, `HalfSpace`
    :param forces: `Force`
    :param is_static: frames see the equilibrium; there are no velocities
    :param law: "neo_hookean" in each element's mean strain, or "corotated"
    :param damping: "kelvin_voigt" on the rate of the Green strain, or "rayleigh"
    :param integrator: "lagged" (semi-implicit) or "newton" (fully implicit)
    :param steps: time steps per default step; 2 halves the step
    :raises ValueError: where an argument has the wrong shape or value, with its name
    """

    def __init__(self, body, *, times=None, frame_rate=None, frame_count=None, youngs_modulus, poissons_ratio=0.3, density, mass_damping=0.0,
                 stiffness_damping=0.0, gravity=(0.0, -9.81, 0.0), linear_velocity=(0.0, 0.0, 0.0), angular_velocity=(0.0, 0.0, 0.0), planes=(),
                 fixed=(), forces=(), is_static=False, law="neo_hookean", damping="kelvin_voigt", integrator="lagged", steps=1.0):
        for name, value, allowed in (("law", law, ("neo_hookean", "corotated")), ("damping", damping, ("kelvin_voigt", "rayleigh")),
                                     ("integrator", integrator, ("lagged", "newton"))):
            if value not in allowed:
                raise ValueError(f"{name}: expected {' or '.join(allowed)}, got {value!r}")
        if times is None:
            if is_static and frame_rate is None and frame_count is None:
                times = np.zeros(1)
            elif frame_rate is None or frame_count is None:
                raise ValueError("times: expected the time of each frame, or frame_rate and frame_count")
            else:
                times = np.arange(frame_count) / frame_rate
        moduli = np.broadcast_to(np.asarray(youngs_modulus, float), (body.controls,)) if np.ndim(youngs_modulus) == 0 else youngs_modulus
        self._motion = _pliant.Motion.of_body(
            body, times, moduli, poissons_ratio, density, mass_damping, stiffness_damping, gravity, linear_velocity, angular_velocity,
            [plane._numbers() for plane in planes], [region._numbers() for region in fixed], [force._numbers() for force in forces], is_static,
            law == "corotated", damping == "rayleigh", integrator == "newton", steps)
        self._read_blocks()

    @classmethod
    def _of_model(cls, model, situation, duration):
        self = cls.__new__(cls)
        self._motion = _pliant.Motion.of_model(model, situation, duration or 0.0)
        self._read_blocks()
        return self

    def _read_blocks(self):
        self._blocks = {name: (slice(first, first + size), size, unit) for name, first, size, unit in self._motion.blocks}

    @property
    def body(self):
        """The body that moves."""
        return self._motion.body

    @property
    def times(self):
        """[s] of each frame"""
        return np.array(self._motion.times)

    @property
    def longest_step(self):
        """[s] that a time step has at most"""
        return self._motion.max_dt

    @property
    def names(self):
        """Parameters, in the order in which the vector `theta` holds them."""
        return list(self._blocks)

    def unit(self, name):
        """Unit of a parameter."""
        return self._blocks[self._known(name)][2]

    def slice(self, name):
        """Where a parameter stands in `theta`."""
        return self._blocks[self._known(name)][0]

    def _known(self, name):
        if name not in self._blocks:
            raise ValueError(f"{name}: expected a parameter of the motion, one of {', '.join(self._blocks)}")
        return name

    @property
    def values(self):
        """The parameters as the motion has them: name to number, or to an array."""
        return self.named(self._motion.theta)

    def named(self, theta):
        """The same for a vector of all parameters."""
        theta = np.asarray(theta, float)
        return {name: float(theta[at][0]) if size == 1 else theta[at].copy() for name, (at, size, _) in self._blocks.items()}

    def theta(self, values: Values = None):
        """All parameters as one vector: as the motion has them, but for `values`, which are by name, or a whole vector."""
        if values is not None and not isinstance(values, typing.Mapping):
            return np.asarray(values, float)
        theta = self._motion.theta
        for name, value in (values or {}).items():
            at, size, _ = self._blocks[self._known(name)]
            given = np.asarray(value, float)
            if given.size != size:
                raise ValueError(f"{name}: expected an array of shape ({size},), got {given.shape}")
            theta[at] = given.ravel()
        return theta

    def run(self, values: Values = None, *, start=None, start_velocities=None, reference=None, frames=None) -> Trajectory:
        """Simulates.

        :param values: parameters by name where they are others than the motion's, or a vector of all
        :param start: nodes x 3, where the nodes start [m]; left out: where they rest, or in the equilibrium that they are let go from
        :param start_velocities: nodes x 3 [m/s], beside the velocity of the whole
        :param reference: nodes x 3, where the nodes are stress-free [m]; tetrahedra
        :param frames: how many, from the first
        :raises SimulationError: where there is no such motion
        """
        frames = len(self._motion.times) if frames is None else frames
        out = self._motion.run(self.theta(values), start, start_velocities, reference, frames)
        return Trajectory(self.times[:frames], out["positions"], out["velocities"], out["steps"], self.body)

    def gradient(self, cotangent, values: Values = None, *, start=None, start_velocities=None, reference=None, with_reference=None) -> Gradient:
        """Derivatives of a scalar by the adjoint method: one more run, and one backwards, whatever their number.

        :param cotangent: frames x nodes x 3, the scalar's derivative by positions; fewer frames end the motion sooner
        :param with_reference: also by where the nodes are stress-free; left out: where `reference` is given

        The other arguments are those of `run`.
        """
        if with_reference is None:
            with_reference = reference is not None
        out = self._motion.gradient(self.theta(values), cotangent, start, start_velocities, reference, with_reference)
        return Gradient(self.named(out["theta"]), out["theta"], out["start"], out["start_velocities"], out.get("reference"))

    def __repr__(self):
        return f"<pliant.Motion: {self.body.nodes.shape[0]} nodes, {len(self._motion.times)} frames, parameters {', '.join(self._blocks)}>"
