"""A model as wide as may be, and with cycles: valid, and the most that somebody can make a robot try."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from farhand.common.model.tphsmm import TPHSMM


def cyclic_model(base: TPHSMM, n: int) -> TPHSMM:
    """Return a valid model whose components lead to each other in a circle, each with a way out to the last one.

    Args:
        base: Model whose components are taken, again and again.
        n: Number of components.
    """
    rng, pick = np.random.default_rng(1), np.arange(n) % (base.n_components - 1)
    transition = np.zeros((n, n))
    for i in range(n - 1):
        transition[i, (i + 1) % (n - 1)] = 0.9
        transition[i, n - 1] += 0.1
    arrays = {
        name: np.array(np.take(getattr(base, name), pick, axis=0 if getattr(base, name).ndim == 1 else 1))
        for name in ("initial", "means", "covariances", "duration_mean_s", "duration_variance_s2", "counts", "phase",
                     "elapsed_mean_s", "slopes", "residual_covariances", "start_means", "start_covariances")
    }  # fmt: skip
    initial = np.zeros(n)
    initial[0] = 1.0
    terminal, leaves = np.arange(n) == n - 1, np.zeros(n)
    leaves[-1] = 1.0
    arrays |= {"initial": initial, "phase": rng.permutation(np.linspace(0.0, 1.0, n))}
    return replace(
        base,
        transition=transition,
        time_share=transition / 2.0,
        exit=leaves,
        terminal=terminal,
        ways=(),
        **arrays,
    )
