"""Motions inside JAX."""
import numpy as np
import pytest

jax = pytest.importorskip("jax", reason="JAX is not installed")
jax.config.update("jax_enable_x64", True)
import jax.numpy as jnp  # noqa: E402
import pliant.jax  # noqa: E402
from conftest import bar  # noqa: E402


def test_gradients_are_those_of_the_motion(rng):
    motion = bar()
    nodes = motion.body.nodes
    weight = rng.normal(size=(len(motion.times), *nodes.shape))
    positions = pliant.jax.positions(motion, state=("start", "reference"))

    def cost(values, start, reference):
        return (weight * positions(values, start=start, reference=reference)).sum()

    values = {"youngs_modulus": jnp.array(2e4), "gravity": jnp.array([0.0, -9.81, 0.0])}
    got = jax.jit(jax.grad(cost, argnums=(0, 1, 2)))(values, nodes, nodes)
    expected = motion.gradient(weight, start=nodes, reference=nodes)
    assert got[0]["youngs_modulus"] == pytest.approx(expected.values["youngs_modulus"], rel=1e-9)
    assert np.allclose(got[0]["gravity"], expected.values["gravity"], rtol=1e-9)
    assert np.allclose(got[1], expected.start, rtol=1e-9) and np.allclose(got[2], expected.reference, rtol=1e-9)


def test_what_is_not_a_state_is_refused():
    with pytest.raises(ValueError, match="state"):
        pliant.jax.positions(bar(), state=("shape",))
