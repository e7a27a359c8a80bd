"""Fits of recordings, and what they found."""
import dataclasses
import json
import os
import pathlib
import typing

import numpy as np

from . import _pliant
from ._errors import FitError


@dataclasses.dataclass(frozen=True)
class Parameter:
    """A number, or a vector, that a fit found or was given."""

    name: str
    value: typing.Any
    unit: str
    estimated: bool
    std: typing.Any = None
    """one standard deviation: noise, other models and what the capture gave"""
    interval_90: typing.Optional[tuple] = None
    """90 % interval of a number"""


class Result:
    """What a fit found: `result.json` of its folder.

    :param folder: the fit's folder, or the file
    """

    def __init__(self, folder):
        path = pathlib.Path(folder)
        self.file = path / "result.json" if path.is_dir() else path
        try:
            self.json = json.loads(self.file.read_text())
        except FileNotFoundError:
            raise ValueError(f"{self.file}: there is no such file; expected the folder of a fit") from None
        except json.JSONDecodeError as error:
            raise ValueError(f"{self.file}:{error.lineno}:{error.colno}: no JSON; fit the recording anew") from None
        self.folder = self.file.parent
        self.parameters = {name: Parameter(name, np.array(p["value"]) if isinstance(p["value"], list) else p["value"], p.get("unit", ""),
                                           bool(p.get("estimated")), np.array(p["std"]) if isinstance(p.get("std"), list) else p.get("std"),
                                           tuple(p["interval_90"]) if p.get("interval_90") else None)
                           for name, p in self.json["parameters"].items()}

    def __getitem__(self, name):
        """A parameter by its name."""
        if name not in self.parameters:
            raise KeyError(f"{name}; there are {', '.join(self.parameters)}")
        return self.parameters[name]

    @property
    def verdict(self):
        """ "explained", "unexplained" or "undetermined" """
        return self.json.get("verdict") or ""

    @property
    def reasons(self):
        """Of the verdict, plain sentences."""
        return list(self.json.get("reasons", []))

    @property
    def notes(self):
        """Plain sentences for the user."""
        return list(self.json.get("notes", []))

    @property
    def model(self):
        """The model that was fitted."""
        from ._models import Model
        return Model(self.folder / "model.toml")

    def samples(self, count, *, seed=1):
        """Materials drawn from what the fit leaves open, with the stated intervals and correlations.

        :returns: name to an array of `count` numbers: youngs_modulus [Pa], poissons_ratio [-], mass_damping [1/s], stiffness_damping [s]
        """
        return _pliant.posterior_samples(self.file, count, seed)

    def _repr_html_(self):
        rows = "".join(f"<tr><td>{p.name}</td><td>{_told(p.value)}</td><td>{_told(p.std)}</td><td>{_told(p.interval_90)}</td><td>{p.unit}</td></tr>"
                       for p in self.parameters.values() if p.estimated)
        return f"<table><tr><th>parameter</th><th>value</th><th>deviation</th><th>90 %</th><th>unit</th></tr>{rows}</table>"

    def __repr__(self):
        told = ", ".join(f"{p.name} {_told(p.value)} ± {_told(p.std)} {p.unit}".rstrip() for p in self.parameters.values()
                         if p.estimated and np.ndim(p.value) == 0)
        return f"<pliant.Result {self.folder}: {told}>"


def _told(value):
    if value is None:
        return ""
    if np.ndim(value):
        return "(" + ", ".join(f"{v:.4g}" for v in np.ravel(value)) + ")"
    return f"{value:.4g}" if isinstance(value, (int, float)) else str(value)


def _setting(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if np.ndim(value) == 1 and not isinstance(value, str):
        return "[" + ", ".join(repr(float(v)) for v in value) + "]"
    return str(value)


def fit(captures, out, *, settings=None, config=None, held_out=None, threads=None, resume=False, on_line=None, on_event=None) -> Result:
    """Estimates what recordings of one object leave unknown, and writes the folder of a fit (the command `pliant fit`).

    :param captures: the folder of a recording, or several of one object
    :param out: folder for the result
    :param settings: choices by key, such as {"budget": 0, "poissons_ratio.estimate": False}; none is needed. `fit_keys` lists them
    :param config: file of choices (TOML)
    :param held_out: a recording that takes no part, and is predicted
    :param threads: most threads to use
    :param resume: go on with the interrupted fit in `out`
    :param on_line: called with lines for people
    :param on_event: called with each step of the optimiser: a dictionary (stage, iteration, cost, youngs_modulus [Pa], fraction_done), and the
        same in words. An exception ends the fit, as Ctrl-C does, with the best so far in `out`
    :raises InputError: where a recording, or a choice, cannot be used
    :raises FitError: where there is no estimate
    """
    paths = [captures] if isinstance(captures, (str, os.PathLike)) else list(captures)
    words = [f"{key}={_setting(value)}" for key, value in (settings or {}).items()]
    ended = _pliant.fit(paths, held_out, out, config, words, threads or 0, resume, on_line, on_event)
    if not ended["has_result"]:
        raise FitError(ended["reason"])
    result = Result(out)
    result.converged, result.reason = ended["converged"], ended["reason"]
    return result


def fit_keys():
    """Choices about a fit: name, default, and a sentence."""
    return _pliant.fit_keys()
