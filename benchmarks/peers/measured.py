"""How every program is measured: seconds of processor and of wall of the steps alone, and where the nodes were."""
import dataclasses
import resource
import time

import numpy as np


class Unreached(Exception):
    """There is no motion or equilibrium at these settings, for the reason that is told."""


@dataclasses.dataclass
class Outcome:
    positions: np.ndarray  # times x nodes x 3 [m]; of an equilibrium, one time
    steps: int  # that were taken; of an equilibrium, iterations where they are known
    processor_s: float  # of all steps, on all threads
    wall_s: float
    start_s: float = 0.0  # processor: to make the scene out of the mesh
    compile_s: float = 0.0  # processor: the first steps less as many later ones


class Clock:
    """`with Clock() as clock:` then clock.processor_s, clock.wall_s; of this process, or of the children that ended meanwhile."""

    def __init__(self, children=False):
        self.children = children

    def _processor(self):
        if not self.children:
            return time.process_time()
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    def __enter__(self):
        self.processor_s, self.wall_s = self._processor(), time.perf_counter()
        return self

    def __exit__(self, *_):
        self.processor_s, self.wall_s = self._processor() - self.processor_s, time.perf_counter() - self.wall_s


def stepped(body, step, advance, positions):
    """Calls advance(count) from one compared time to the next, and positions() there. Returns positions, steps, clock."""
    count, out = body.steps_between(step), []
    with Clock() as clock:
        for _ in body.times:
            advance(count)
            out.append(np.array(positions()))
    return np.array(out), count * len(body.times), clock
