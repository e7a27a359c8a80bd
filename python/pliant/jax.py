"""A motion as a function that JAX differentiates backwards."""
import jax
import jax.numpy as jnp
import numpy as np

from ._motion import Motion

_STATE = ("start", "start_velocities", "reference")


def positions(motion: Motion, *, state=(), frames=None):
    """A function of the motion's parameters, a dictionary of arrays by name, that returns the positions of its nodes, frames x nodes x 3 [m].

    It can be compiled, and differentiated once, backwards. Doubles want `jax.config.update("jax_enable_x64", True)`.

    :param motion: a `pliant.Motion`
    :param state: what the function takes beside the parameters, by keyword, nodes x 3 each: "start" [m], "start_velocities" [m/s],
        "reference" [m]
    :param frames: how many, from the first
    """
    if unknown := set(state) - set(_STATE):
        raise ValueError(f"state: expected some of {', '.join(_STATE)}, got {', '.join(sorted(unknown))}")
    shape = (len(motion.times) if frames is None else frames, motion.body.nodes.shape[0], 3)

    def as_arrays(given):
        return {name: np.asarray(value, float) for name, value in given.items()}

    def run(values, nodal):
        made = motion.run(as_arrays(values), **as_arrays(nodal), frames=shape[0]).positions
        return made.astype(jax.dtypes.canonicalize_dtype(float))

    def pull(cotangent, values, nodal):
        g = motion.gradient(np.asarray(cotangent, float), as_arrays(values), **as_arrays(nodal))
        by_value = {name: g.theta[motion.slice(name)].reshape(np.shape(value)).astype(value.dtype) for name, value in values.items()}
        return by_value, {name: getattr(g, name).astype(value.dtype) for name, value in nodal.items()}

    @jax.custom_vjp
    def simulated(values, nodal):
        return jax.pure_callback(run, jax.ShapeDtypeStruct(shape, jax.dtypes.canonicalize_dtype(float)), values, nodal)

    def forwards(values, nodal):
        return simulated(values, nodal), (values, nodal)

    def backwards(given, cotangent):
        like = jax.tree_util.tree_map(lambda x: jax.ShapeDtypeStruct(x.shape, x.dtype), given)
        return jax.pure_callback(pull, like, cotangent, *given)

    simulated.defvjp(forwards, backwards)

    def function(values=None, **nodal):
        if set(nodal) != set(state):
            raise ValueError(f"expected {', '.join(state) or 'no state'} beside the parameters, got {', '.join(nodal) or 'none'}")
        return simulated({name: jnp.asarray(value, float) for name, value in (values or {}).items()},
                         {name: jnp.asarray(value, float) for name, value in nodal.items()})

    return function
