"""Choice of the way that an execution takes, and its form as a further chain of components.

Demonstrated motions are regressed on their starts (see `farhand.common.model.way`). If the regression is
certain enough at the actual start, its course becomes a chain of short components behind the K learned ones,
which leads to the terminal component of its demonstrations. Otherwise only the paper's components are known,
and the motion begins at the nearest of them.

`successors` is the most probable chain of components to an end (Sec. III-B).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.tphsmm import MAX_COMPONENTS, TPHSMM
from farhand.common.model.way import N_PHASES, Way, between_coarse, chosen_way

Integers = NDArray[np.int64]

Array = NDArray[np.float64]

# Relative spread of the time in an interval, and its least standard deviation [s].
_DURATION_SPREAD, _DURATION_STD_S = 0.15, 0.02


def chosen(model: TPHSMM, start: Array) -> int:
    """Return the number of the way that a motion takes from a start; -1 when none is certain enough.

    Args:
        model: The learned task.
        start: Start of the motion in each frame. Shape (P, C).
    """
    if model.n_components + N_PHASES > MAX_COMPONENTS:
        return -1
    return chosen_way(model.ways, start[-1], model.max_distance_m)


def with_way(model: TPHSMM, way: Way, start: Array) -> TPHSMM:
    """Return the model with a way's course from a start as components K, ..., K + N - 1.

    Args:
        model: The learned task, with K components.
        way: One of its ways.
        start: Start of the motion in each frame. Shape (P, C).
    """
    space, K, N = model.manifold, model.n_components, N_PHASES
    course, steps_s = way.course(start), np.diff(way.times_s(start))
    ramps = space.log(course[:, :-1], course[:, 1:])
    residuals = between_coarse(way.covariances, axis=1)
    if len(course) > 1:  # frames are weighed by how sure each is of this start
        residuals = residuals * between_coarse(way.growth(start), axis=1)[..., None]
    residuals = 0.5 * (residuals[:, :-1] + residuals[:, 1:])
    along = np.einsum("pkt,pku->pktu", ramps, ramps) / 12.0  # of points spread evenly over the interval
    transition, time_share = (_grown(a, N, N) for a in (model.transition, model.time_share))
    exit_probability = np.concatenate([model.exit, np.zeros(N)])
    following = np.append(np.arange(K + 1, K + N), way.terminal)
    transition[np.arange(K, K + N), following] = time_share[np.arange(K, K + N), following] = 1.0
    middles = space.exp(course[:, :-1], 0.5 * ramps)
    mean_start = space.exp(way.points[:, :1], np.zeros(space.n_tangent))  # of unit length
    starts = np.broadcast_to(mean_start, middles.shape)
    spread = np.broadcast_to(np.eye(space.n_tangent), residuals.shape)

    def grown(known: Array, new: Array) -> Array:
        return np.concatenate([known, new], axis=1)

    return replace(
        model,
        ways=(),
        initial=np.concatenate([model.initial, np.zeros(N)]),
        transition=transition,
        time_share=time_share,
        exit=exit_probability,
        means=grown(model.means, middles),
        covariances=grown(model.covariances, residuals + along),
        duration_mean_s=np.concatenate([model.duration_mean_s, steps_s]),
        duration_variance_s2=np.concatenate(
            [model.duration_variance_s2, (_DURATION_SPREAD * steps_s) ** 2 + _DURATION_STD_S**2]
        ),
        terminal=np.concatenate([model.terminal, np.zeros(N, np.bool_)]),
        counts=np.concatenate([model.counts, np.full(N, way.n_demonstrations)]),
        phase=np.concatenate([model.phase, (np.arange(N) + 0.5) / N]),
        elapsed_mean_s=np.concatenate([model.elapsed_mean_s, 0.5 * steps_s]),
        slopes=grown(model.slopes, ramps / steps_s[:, None]),
        residual_covariances=grown(model.residual_covariances, residuals),
        start_means=grown(model.start_means, starts),
        start_covariances=grown(model.start_covariances, spread),
    )


def _grown(matrix: Array, rows: int, columns: int) -> Array:
    larger = np.zeros((len(matrix) + rows, len(matrix) + columns))
    larger[: len(matrix), : len(matrix)] = matrix
    return larger


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
