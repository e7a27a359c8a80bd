"""Newton on the processor, by Warp: vertex block descent, and its explicit solver (SolverSemiImplicit). Single precision; one thread.

As in its own examples of soft bodies: no self-contact, no tiles, and steps captured as a graph, which takes a fifth to a quarter off."""
import json

import numpy as np
import warp as wp

wp.config.quiet = True
import newton
from measured import Clock, Outcome, stepped

RADIUS = 0.001  # [m] of the torus's particles in contact; the floor is as much lower
VBD, EXPLICIT = "vertex block descent", "explicit"
METHODS = {
    "bar": {VBD: {"law": "stable_neo_hookean", "consistent": False}, EXPLICIT: {"law": "stable_neo_hookean_log", "consistent": False}},
    "torus": {VBD: {"finest": {"step": 0.00015625, "sweeps": 10}}, EXPLICIT: {"finest": {"step": 0.000078125}}},
}
RUNS = {  # step [s], sweeps
    ("bar", VBD): [(0.0025, 20), (0.00125, 10), (0.000625, 5), (0.000625, 10), (0.0003125, 2), (0.0003125, 5)],
    ("bar", EXPLICIT): [(0.0005, 0), (0.00025, 0), (0.000125, 0)],
    ("torus", VBD): [(0.0025, 10), (0.00125, 10), (0.000625, 10), (0.0003125, 5)],
    ("torus", EXPLICIT): [(0.000625, 0), (0.0003125, 0)],
}


def version():
    return f"{newton.__version__}, Warp {wp.config.version}"


def runs(body, method):
    return [{"step": step, **({"sweeps": sweeps} if sweeps else {})} for step, sweeps in RUNS[body, method]]


def scene(body, method):
    """The exported mesh as a model, with the law's constants of this solver."""
    builder = newton.ModelBuilder(gravity=json.loads((body.folder / "newton/export.json").read_text())["gravity"])
    lam, mu = body.lame
    if method == EXPLICIT:  # its law has a logarithm, and its own constants (reference.stable_neo_hookean_log)
        lam, mu = lam + 5 / 6 * mu, 4 / 3 * mu
    builder.add_soft_mesh(pos=wp.vec3(0, 0, 0), rot=wp.quat_identity(), scale=1.0, vel=wp.vec3(*body.velocity), vertices=[wp.vec3(*x) for x in body.nodes],
                          indices=body.elements.ravel().tolist(), density=body.density, k_mu=mu, k_lambda=lam, k_damp=0.0, tri_ke=0.0, tri_ka=0.0,
                          tri_kd=0.0, add_surface_mesh_edges=False, particle_radius=RADIUS)
    for i in body.held:
        builder.particle_mass[i] = 0.0
        builder.particle_flags[i] = int(builder.particle_flags[i]) & ~int(newton.ParticleFlags.ACTIVE)
    if body.floor:
        ke = contact_stiffness(body)
        builder.add_shape_plane(plane=(0.0, 1.0, 0.0, RADIUS), width=0.0, length=0.0, body=-1, cfg=newton.ModelBuilder.ShapeConfig(ke=ke, kd=0.0, kf=0.0, mu=0.0))
    builder.color()
    model = builder.finalize(device="cpu")
    model.particle_grid = None  # particles do not meet each other
    if body.floor:
        model.soft_contact_ke, model.soft_contact_kd, model.soft_contact_kf, model.soft_contact_mu = ke, 0.0, 0.0, 0.0
    return model


def contact_stiffness(body):
    """[N/m] of a particle: that the weight, on a tenth of the surface's particles, presses it in by 1e-4 of the size."""
    size = float(np.ptp(body.nodes, axis=0).max())
    weight = 9.81 * body.density * float(np.abs(np.linalg.det(body.nodes[body.elements[:, 1:]] - body.nodes[body.elements[:, :1]])).sum()) / 6
    return weight / (0.1 * len(np.unique(body.surface)) * 1e-4 * size)


def run(body, method, settings):
    step = settings["step"]
    with Clock() as start:
        model = scene(body, method)
        solver = (newton.solvers.SolverVBD(model, iterations=settings["sweeps"], particle_enable_tile_solve=False) if method == VBD
                  else newton.solvers.SolverSemiImplicit(model, enable_tri_contact=False))
        now, then, control = model.state(), model.state(), model.control()
        pipeline = newton.CollisionPipeline(model) if body.floor else None
        contacts = pipeline.contacts() if pipeline else None

    def two():
        for a, b in ((now, then), (then, now)):
            a.clear_forces()
            if pipeline:
                pipeline.collide(a, contacts)
            solver.step(a, b, control, contacts, step)

    def reset():
        now.particle_q.assign(model.particle_q)
        now.particle_qd.assign(model.particle_qd)

    with Clock() as first:
        two()
    reset()
    with Clock() as later:
        two()
    reset()
    solver = (newton.solvers.SolverVBD(model, iterations=settings["sweeps"], particle_enable_tile_solve=False) if method == VBD else solver)
    with wp.ScopedCapture(device="cpu") as capture:
        two()
    reset()

    def advance(count):
        if count % 2:
            raise ValueError(f"steps of {step} s: expected an even number from one compared time to the next, got {count}")
        for _ in range(count // 2):
            wp.capture_launch(capture.graph)

    out, steps, clock = stepped(body, step, advance, now.particle_q.numpy)
    return Outcome(out.astype(float), steps, clock.processor_s, clock.wall_s, start.processor_s, max(0.0, first.processor_s - later.processor_s))
