"""A motion as a function that PyTorch differentiates."""
import torch

from ._motion import Motion

_STATE = ("start", "start_velocities", "reference")


class _Positions(torch.autograd.Function):
    """Positions of a motion; backwards by its adjoint, which simulates once more."""

    @staticmethod
    def forward(ctx, motion, names, frames, *tensors):
        given = [None if t is None else t.detach().cpu().double().numpy() for t in tensors]
        state = dict(zip(_STATE, given[len(names):]))
        ctx.motion, ctx.names, ctx.state, ctx.values = motion, names, state, dict(zip(names, given))
        ctx.tensors = tensors
        positions = motion.run(ctx.values, **state, frames=frames).positions
        like = next((t for t in tensors if t is not None), torch.zeros(0, dtype=torch.float64))
        return torch.from_numpy(positions).to(device=like.device, dtype=like.dtype)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, cotangent):
        by_reference = ctx.needs_input_grad[3 + len(ctx.names) + _STATE.index("reference")]
        gradient = ctx.motion.gradient(cotangent.detach().cpu().double().numpy(), ctx.values, **ctx.state, with_reference=by_reference)
        arrays = [gradient.theta[ctx.motion.slice(name)] for name in ctx.names] + [getattr(gradient, name) for name in _STATE]
        grads = [None if t is None or not needed else torch.as_tensor(array, dtype=t.dtype, device=t.device).reshape(t.shape)
                 for t, array, needed in zip(ctx.tensors, arrays, ctx.needs_input_grad[3:])]
        return (None, None, None, *grads)


def positions(motion: Motion, values=None, *, start=None, start_velocities=None, reference=None, frames=None) -> torch.Tensor:
    """Positions of a motion's nodes, frames x nodes x 3 [m], with derivatives by all that is given.

    :param motion: a `pliant.Motion`
    :param values: parameters by name: tensors of a number, or of three; those that are left out stay as the motion has them
    :param start: nodes x 3 [m], where the nodes start
    :param start_velocities: nodes x 3 [m/s]
    :param reference: nodes x 3 [m], where the nodes are stress-free; tetrahedra with law="corotated" and damping="rayleigh"
    :param frames: how many, from the first
    """
    values = values or {}
    names = tuple(values)
    tensors = [torch.as_tensor(values[name]) for name in names] + [start, start_velocities, reference]
    return _Positions.apply(motion, names, frames, *tensors)
