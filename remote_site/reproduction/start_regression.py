"""What a model expects of a motion that starts at a given place (start regression).

Where the motion passes and how long it takes depend on where it began: the components' means and the
time that is spent in them are regressed on the demonstrations' starts, an extension of the paper.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.tphsmm import TPHSMM

Array = NDArray[np.float64]

# The regression goes no further than so many standard deviations from the demonstrated starts.
_FARTHEST_START = 3.0
# A component takes no less and no more than these parts of its mean duration.
_SHORTEST, _LONGEST = 0.4, 2.0


def given_start(model: TPHSMM, start: Array | None) -> TPHSMM:
    """The same model with the means, durations and elapsed times that a start lets expect.

    Args:
        model: The learned task.
        start: Where the motion began in each frame; None when not where demonstrations began. Shape (P, C).
    """
    if start is None:
        return model
    e = _from_the_mean_start(model, start)
    shift = np.einsum("pkde,pke->pkd", model.start_gains, e)
    later_s = np.einsum("pkt,pkt->pk", model.elapsed_gains, e).mean(axis=0)
    # A visit is sampled evenly, so that its duration is twice its mean elapsed time.
    shortest, longest = _SHORTEST * model.duration_mean_s, _LONGEST * model.duration_mean_s
    duration_s = np.clip(model.duration_mean_s + 2.0 * later_s, shortest, longest)
    return replace(
        model,
        means=model.manifold.exp(model.means, shift),
        duration_mean_s=duration_s,
        elapsed_mean_s=np.clip(model.elapsed_mean_s + later_s, 0.0, duration_s),
    )


def _from_the_mean_start(model: TPHSMM, start: Array) -> Array:
    """Tangents from the mean start of each component to a start, as long as demonstrated at most. Shape (P, K, T)."""
    e = model.manifold.log(model.start_means, start[:, None])
    for part in model.manifold.parts:  # far from the demonstrated starts the robot joins the learned way
        C = model.start_covariances[..., part, part]
        away = np.sqrt(np.einsum("pkd,pkd->pk", e[..., part], np.linalg.solve(C, e[..., part, None])[..., 0]))
        e[..., part] *= np.minimum(1.0, _FARTHEST_START / np.maximum(away, _FARTHEST_START))[..., None]
    return e
