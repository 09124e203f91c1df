"""What the water remembers of the motion before: first-order memories in time or in distance travelled.

    relax        dm = (target - m) dr                       m follows the target, r the time or the travel in units of the memory
    lags_behind  de = d target - e dr                       e = target - m, for a target that is linear between the rows
    overtaking   dv/dt = (w - v) k,  k = max(|w|, |v|)/(lambda D) + r    velocity of the wake: it goes on when the link has stopped
                 s dm/dt = (v - m) k                               and of the water that this wake drags along in turn       [m/s]

Source: first-order relaxation, an assumption of ours; McLain & Rock (1998), eq. (1), for the distance travelled as the argument.
"""

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor


def relax(target: Tensor, rate: Tensor, start: Tensor) -> Tensor:
    """Return m (n, ...) of m_k = m_{k-1} exp(-rate_k) + target_k (1 - exp(-rate_k)), m_0 = start; exact for constant rates."""
    decay = np.broadcast_to(torch.exp(-rate).numpy(), target.shape).copy()
    m = (1 - decay) * (target - start).numpy()  # from the start on: what never changes stays exactly what it was
    return _accumulate([m], decay)[0] + start


def lags_behind(targets: Sequence[Tensor], rate: Tensor) -> list[Tensor]:
    """Return by how much memories of one `rate` (n, ...) lag behind each of `targets` (n, ...), e (n, ...) of

        e_k = e_{k-1} exp(-rate_k) + (target_k - target_{k-1}) (1 - exp(-rate_k))/rate_k,  e_0 = 0.

    Exact where target and rate are linear and constant between the rows: however short the memory is beside the step.
    """
    missed = share_missed(rate)
    return _accumulate([(torch.diff(target, dim=0, prepend=target[:1]) * missed).numpy() for target in targets], torch.exp(-rate).numpy())


def share_missed(rate: Tensor) -> Tensor:
    """Return (1 - exp(-rate))/rate, 1 at rate 0: what a memory has not yet taken up of a rise over the step."""
    return torch.where(rate > 0, -torch.expm1(-rate) / torch.where(rate > 0, rate, 1.0), 1.0)


def _accumulate(targets: Sequence[NDArray[np.float64]], decay: NDArray[np.float64]) -> list[Tensor]:
    """Return m_k + decay_k m_{k-1}, m_0 = 0, of every m in `targets`; writes over all."""
    step, found = 1, list(targets)
    for m in found:
        m[:1] = 0.0
    while step < len(decay):  # the recursions of 1, 2, 4, ... rows joined: n log n instead of n steps in Python
        for m in found:
            m[step:] = m[step:] + decay[step:] * m[:-step]
        decay[step:] = decay[step:] * decay[:-step]
        step *= 2
    return [torch.from_numpy(m) for m in found]


def overtaking(t: Tensor, w: Tensor, length: Tensor, fading: float = 0.0, second: float = 0.0) -> Tensor:
    """Return m (n, links, s) m/s behind strips with the velocity `w` (n, links, s) m/s, at first that of the strip.

    It settles over `length` m of travel and by itself, at the rate `fading` 1/s, and once more with `second` times that lag.
    """
    v, rates = overtaking_by_law(t, w, length[None], torch.tensor([fading], dtype=torch.float64))
    return dragged_along(v[0], rates[0], second)


def dragged_along(v: Tensor, rates: Tensor, second: float) -> Tensor:
    """Return m (n, links, s) m/s of the water that the wake `v` drags along, `second` times the lag of the wake's own `rates` later."""
    return relax(v, rates / second, v[0]) if second > 0 and len(v) else v


def overtaking_by_law(t: Tensor, w: Tensor, lengths: Tensor, fading: Tensor) -> tuple[Tensor, Tensor]:
    """Return the wake v (laws, n, links, s) m/s and k dt of every row, for all `lengths` (laws, links, 1) m and `fading` (laws,) 1/s."""
    goal, steps = w.numpy(), torch.diff(t, prepend=t[:1]).numpy()[:, None, None, None]
    per_speed = -steps / lengths.numpy()  # all with the sign that exp wants: -k dt = min(-|w|, -|v|) dt/(lambda D) - r dt
    by_motion, by_time = np.abs(goal)[:, None] * per_speed, -fading.numpy()[:, None, None] * steps
    result, rates = np.empty((2, len(goal), len(lengths), *goal.shape[1:]))
    result[:1], rates[:1], decay = goal[:1, None], 0.0, np.empty(result.shape[1:])
    each_row = zip(result[:-1], result[1:], rates[1:], goal[1:], per_speed[1:], by_motion[1:], by_time[1:], strict=True)
    for v, now, rate, towards, of_speed, of_motion, of_time in each_row:
        np.abs(v, out=rate)
        rate *= of_speed
        np.minimum(rate, of_motion, out=rate)
        rate += of_time
        np.exp(rate, out=decay)
        np.subtract(v, towards, out=now)
        now *= decay
        now += towards
    return torch.from_numpy(result).transpose(0, 1), torch.from_numpy(np.subtract(0.0, rates, out=rates)).transpose(0, 1)
