"""Most probable chain of components to an end (Sec. III-B)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.tphsmm import TPHSMM

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Without time spent, visits decide.
_TINY = 1e-6


def successors(model: TPHSMM, start: Array | None = None) -> Integers:
    """Return each component's successor, -1 for none; following successors never returns.

    The successor is visited later in the demonstrations, and before it the demonstrations spent most of their
    time in the component, given where the motion started: the component's mean and ramp are those of the
    demonstrations that stayed in it, while others may only have touched it on another way. If such successors
    lead to no terminal component, the best one that does is taken.

    Args:
        model: The learned task.
        start: Start of the motion in each frame [m]; None if demonstrations did not begin there. Shape (P,
            C).
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
    """Return the log density of a start among those of the demonstrations that visited each component.

    Shape (K,).
    """
    e = model.manifold.log(model.start_means, start[:, None])
    mahalanobis = np.einsum("pkd,pkd->pk", e, np.linalg.solve(model.start_covariances, e[..., None])[..., 0])
    log_determinant = np.linalg.slogdet(model.start_covariances)[1]
    return -0.5 * (mahalanobis + log_determinant).mean(axis=0)
