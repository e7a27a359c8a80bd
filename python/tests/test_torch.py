"""Motions inside PyTorch: gradients against numerical ones by torch's own check."""
import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="PyTorch is not installed")
import pliant.torch  # noqa: E402
from conftest import bar, thrown  # noqa: E402

torch.set_num_threads(1)


def scaled(motion, names):
    """Positions as a function of factors of about one, by which torch's check can step."""
    base = {name: torch.tensor(motion.values[name], dtype=torch.float64) for name in names}
    weight = torch.from_numpy(np.random.default_rng(3).normal(size=(len(motion.times), len(motion.body.nodes), 3)))

    def function(*factors):
        return (weight * pliant.torch.positions(motion, {n: f * base[n] + 0.1 * (f - 1) * (base[n] == 0) for n, f in zip(names, factors)})).sum()

    return function, [torch.ones_like(base[name], requires_grad=True) for name in names]


@pytest.mark.parametrize("make, names", [
    (bar, ["youngs_modulus", "poissons_ratio", "mass_damping", "stiffness_damping", "density", "gravity", "strength@1"]),
    (thrown, ["youngs_modulus", "gravity", "linear_velocity", "angular_velocity"]),
])
def test_parameters_and_loads_pass_gradcheck(make, names):
    function, factors = scaled(make(), names)
    assert torch.autograd.gradcheck(function, factors, eps=1e-5, atol=1e-6, rtol=1e-4, nondet_tol=1e-12)


@pytest.mark.parametrize("state", ["start", "start_velocities", "reference"])
def test_nodes_pass_gradcheck(state):
    motion = bar()
    nodes = torch.tensor(motion.body.nodes)
    base = torch.zeros_like(nodes) if state == "start_velocities" else nodes
    weight = torch.from_numpy(np.random.default_rng(3).normal(size=(len(motion.times), *nodes.shape)))

    def function(change):
        return (weight * pliant.torch.positions(motion, **{state: base + change})).sum()

    change = torch.zeros_like(nodes, requires_grad=True)
    assert torch.autograd.gradcheck(function, (change,), eps=1e-6, atol=1e-5, rtol=1e-4, nondet_tol=1e-12)


def test_a_training_loop_finds_a_modulus():
    motion = bar()
    seen = torch.from_numpy(motion.run({"youngs_modulus": 3.3e4}).positions)
    log_modulus = torch.tensor(np.log(1.5e4), requires_grad=True)
    optimiser = torch.optim.LBFGS([log_modulus], max_iter=40, line_search_fn="strong_wolfe", tolerance_change=1e-14)

    def cost():
        optimiser.zero_grad()
        off = 1e4 * ((pliant.torch.positions(motion, {"youngs_modulus": log_modulus.exp()}) - seen)**2).sum()
        off.backward()
        return off

    optimiser.step(cost)
    assert log_modulus.exp().item() == pytest.approx(3.3e4, rel=1e-3)


def test_types_and_what_needs_no_gradient():
    motion = bar()
    modulus = torch.tensor(2e4, dtype=torch.float32, requires_grad=True)
    gravity = torch.tensor([0.0, -9.81, 0.0])
    positions = pliant.torch.positions(motion, {"youngs_modulus": modulus, "gravity": gravity}, frames=2)
    assert positions.shape == (2, len(motion.body.nodes), 3) and positions.dtype == torch.float32
    positions.sum().backward()
    assert modulus.grad.dtype == torch.float32 and torch.isfinite(modulus.grad) and gravity.grad is None
