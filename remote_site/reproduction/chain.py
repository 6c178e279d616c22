"""Which component follows which: the most probable chain to an end (Sec. III-B)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.tphsmm import TPHSMM

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Where no time was spent, counts decide.
_TINY = 1e-6


def successors(model: TPHSMM, start: Array | None = None) -> Integers:
    """The component that follows each one, -1 for none; following them never comes back.

    Among those visited later in the demonstrations it is the one before which most of the time in the
    component was spent, given where the motion started: the mean and the ramp of the component are those of
    the demonstrations that stayed in it, while others may only have touched it on another way. Where that
    leads to no terminal component, it is the best of those that do.

    Args:
        model: The learned task.
        start: Where the motion began in each frame [m]; None when not where demonstrations began. Shape (P, C).
    """
    with np.errstate(divide="ignore"):
        score = np.log(model.time_share + _TINY * model.transition)  # -inf where never seen
    if start is not None:
        score = score + start_log_likelihood(model, start)
    forward = np.where((model.phase[None, :] > model.phase[:, None]) | model.terminal, score, -np.inf)
    following = np.where(forward.max(axis=1) > -np.inf, np.argmax(forward, axis=1), -1)
    following[model.terminal] = -1
    reaches = model.terminal.copy()
    for i in np.argsort(-model.phase, kind="stable"):  # the later first: phases increase along the chain
        reaches[i] |= following[i] >= 0 and reaches[following[i]]
    into = np.where(reaches, score, -np.inf).max(axis=1)
    while True:
        best = np.where(reaches, -np.inf, into)
        i = int(np.argmax(best))
        if best[i] == -np.inf:
            break
        following[i] = np.argmax(np.where(reaches, score[i], -np.inf))
        reaches[i] = True
        into = np.maximum(into, score[:, i])
    following[~reaches] = -1
    return following


def start_log_likelihood(model: TPHSMM, start: Array) -> Array:
    """Log density of a start among those of the demonstrations that visited each component. Shape (K,)."""
    e = model.manifold.log(model.start_means, start[:, None])
    mahalanobis = np.einsum("pkd,pkd->pk", e, np.linalg.solve(model.start_covariances, e[..., None])[..., 0])
    log_determinant = np.linalg.slogdet(model.start_covariances)[1]
    return -0.5 * (mahalanobis + log_determinant).mean(axis=0)
