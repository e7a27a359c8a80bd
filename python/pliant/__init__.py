"""pliant turns a recording of a soft object into an elastic model that can be simulated.

Captures, bodies, motions with gradients, fits, models and results; NumPy arrays in and out. Units are SI.
`pliant.torch` and `pliant.jax` make a motion a function that those can differentiate.
"""
from . import _pliant
from ._commands import Planned, command, plan, synth
from ._errors import FitError, InputError, SimulationError
from ._fit import Parameter, Result, fit, fit_keys
from ._models import Capture, Model, ObservedFrame, export_formats
from ._motion import Gradient, Motion, Trajectory
from ._pliant import Body
from ._regions import Ball, Box, Force, HalfSpace, Plane

__version__ = _pliant.version
__all__ = ["Ball", "Body", "Box", "Capture", "FitError", "Force", "Gradient", "HalfSpace", "InputError", "Model", "Motion", "ObservedFrame",
           "Parameter", "Plane", "Planned", "Result", "SimulationError", "Trajectory", "command", "export_formats", "fit", "fit_keys", "plan", "synth"]
