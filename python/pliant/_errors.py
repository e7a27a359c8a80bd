"""Exceptions of the package."""


class InputError(ValueError):
    """Input that cannot be used. `problems` holds one line for each: file:line:column, what was found, what to do."""

    def __init__(self, message, problems=()):
        super().__init__(message)
        self.problems = list(problems)


class SimulationError(RuntimeError):
    """A motion, or an equilibrium, that could not be found; the message says why."""


class FitError(RuntimeError):
    """A fit that ended without an estimate; the message says why."""
