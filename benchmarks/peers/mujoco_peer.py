"""MuJoCo's flex, by the scene that `pliant export --to mujoco` writes; the torus gets its floor and its velocity here.

Flexes with elasticity take the integrator `discrete` (linearly implicit, of first order), which the exported scene asks for, or `Euler` with short steps
(explicit); MuJoCo refuses the others. Steps of a simulation run in one thread."""
import numpy as np

import mujoco
from measured import Clock, Outcome, Unreached, stepped

RADIUS = 0.001  # [m] of the torus's vertices in contact; the floor is as much lower
# Of contact, critically damped [s]: twice the longest step, below which MuJoCo would lengthen it.
CONTACT_TIME = 0.005
METHODS = {
    "bar": {"discrete": {"law": "saint_venant_kirchhoff", "consistent": False}, "Euler": {"law": "saint_venant_kirchhoff", "consistent": False}},
    "torus": {"discrete": {"finest": {"step": 0.0003125}}, "Euler": {"finest": {"step": 0.000078125}}},
}
STEPS = {
    ("bar", "discrete"): (0.01, 0.005, 0.002, 0.001, 0.0005),
    ("bar", "Euler"): (0.0005, 0.00025),
    ("torus", "discrete"): (0.0025, 0.00125),
    ("torus", "Euler"): (0.000625, 0.0003125),
}


def version():
    return mujoco.__version__


def runs(body, method):
    return [{"step": step} for step in STEPS[body, method]]


def scene(body, method, step):
    """The exported scene with a time step, and a floor for what falls."""
    text = (body.folder / "mujoco/model.xml").read_text().replace('timestep="0.002"', f'timestep="{step!r}"')
    text = text.replace('integrator="discrete"', f'integrator="{method}"')
    if not body.floor:
        return text
    contact = f'condim="1" solref="{CONTACT_TIME} 1"'
    text = text.replace('radius="0"', f'radius="{RADIUS}"').replace('contype="0" conaffinity="0"', contact)
    return text.replace("<worldbody>", f'<worldbody><geom type="plane" size="1 1 1" pos="0 {-RADIUS} 0" zaxis="0 1 0" {contact}/>')


def run(body, method, settings):
    with Clock() as start:
        model = mujoco.MjModel.from_xml_string(scene(body, method, settings["step"]))
        data = mujoco.MjData(model)
        data.qvel[:] = np.tile(body.velocity, len(body.free))
        mujoco.mj_forward(model, data)

    def advance(count):
        mujoco.mj_step(model, data, nstep=count)

    def positions():
        out = body.nodes.copy()
        out[body.free] += data.qpos.reshape(-1, 3)
        return out

    out, steps, clock = stepped(body, settings["step"], advance, positions)
    warned = {mujoco.mjtWarning(k).name: int(w.number) for k, w in enumerate(data.warning) if w.number}
    if warned:
        raise Unreached(f"MuJoCo warned: {warned}")
    return Outcome(out, steps, clock.processor_s, clock.wall_s, start.processor_s)
