"""Online learning beside batch expectation-maximisation, on the same datapoints with as many components.

The peer is scikit-learn's Gaussian mixture, initialised by k-means as it does by itself; it needs all data at
once and the number of components, which is taken from ours. Compared are the time to learn five
demonstrations, the likelihood of a sixth one under the mixture of Gaussians, and what both cost when a sixth
demonstration arrives: ours goes on from its state, the batch begins anew.
"""

from __future__ import annotations

import time
import warnings
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.special import logsumexp
from sklearn.exceptions import ConvergenceWarning
from sklearn.mixture import GaussianMixture

from farhand.common.model.tphsmm import TPHSMM
from farhand.evaluation.metrics.tables import quantiles, table, write_figure
from farhand.evaluation.paper.approach_task import LAMBDA_M, N_DEMONSTRATIONS, demonstrations
from farhand.evaluation.study import Case, reporting_seeds
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.demonstration import Demonstration

Array = NDArray[np.float64]

_TRIALS = 40
_REPEATS = 5  # repetitions of the timing; the least counts
_SETTINGS = LearnerSettings(LAMBDA_M)


def cases(trials: int | None, seed: int) -> list[Case]:
    """List one set of demonstrations per seed."""
    return [{"seed": s} for s in reporting_seeds(seed, trials or _TRIALS)]


def trial(case: Case) -> Case:
    """Learn in both ways."""
    *shown, sixth = demonstrations(np.random.default_rng([case["seed"], 0]), N_DEMONSTRATIONS + 1)
    learner = _learned(shown)
    model = learner.model()
    K = int((~model.terminal).sum())
    points, unseen = np.concatenate([d.in_frame() for d in shown]), sixth.in_frame()
    mixture = _batch(points, K)
    row = {
        **case,
        "n_points": len(points),
        "n_components": K,
        "online_log_likelihood": _log_likelihood(model, unseen),
        "batch_log_likelihood": float(mixture.score(unseen)),
        "online_s": min(_timed(lambda: _learned(shown)) for _ in range(_REPEATS)),
        "batch_s": min(_timed(lambda: _batch(points, K)) for _ in range(_REPEATS)),
        "batch_anew_s": _timed(lambda: _batch(np.concatenate([points, unseen]), K)),
    }
    row["online_sixth_s"] = _timed(lambda: _show(learner, sixth))
    return row


def _learned(shown: list[Demonstration]) -> OnlineLearner:
    learner = OnlineLearner(_SETTINGS, 3, shown[0].frame_names)
    for demonstration in shown:
        _show(learner, demonstration)
    return learner


def _show(learner: OnlineLearner, demonstration: Demonstration) -> None:
    learner.start()
    learner.observe_many(demonstration.position_m, demonstration.frames(), demonstration.time_s.tolist())
    learner.end()


def _batch(points: Array, K: int) -> GaussianMixture:
    mixture = GaussianMixture(K, reg_covar=_SETTINGS.min_std**2, random_state=0, max_iter=300)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        return mixture.fit(points)


def _log_likelihood(model: TPHSMM, points: Array) -> float:
    """Return the mean log density of points under the mixture of components that are not terminal."""
    kept = ~model.terminal
    weights = model.counts[kept] / model.counts[kept].sum()
    e = points[:, None] - model.means[0, kept]
    covariances = model.covariances[0, kept]
    square = np.einsum("tkd,kde,tke->tk", e, np.linalg.inv(covariances), e)
    log = -0.5 * (square + np.linalg.slogdet(2.0 * np.pi * covariances)[1])
    return float(np.mean(logsumexp(log + np.log(weights), axis=1)))


def _timed(work) -> float:
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Tabulate times, their ratio, and likelihoods."""
    column = {key: np.array([r[key] for r in results]) for key in results[0]}
    ratio, again = column["batch_s"] / column["online_s"], column["batch_anew_s"] / column["online_sixth_s"]
    difference = column["online_log_likelihood"] - column["batch_log_likelihood"]
    summary = {
        "speed_ratio_median": float(np.median(ratio)),
        "sixth_ratio_median": float(np.median(again)),
        "log_likelihood_difference_mean": float(np.mean(difference)),
    }
    rows = [
        ("five demonstrations [ms], median / 90 %", quantiles(column["online_s"], 1e3), quantiles(column["batch_s"], 1e3), f"{np.median(ratio):.1f} x"),
        ("a sixth one [ms]", quantiles(column["online_sixth_s"], 1e3), quantiles(column["batch_anew_s"], 1e3), f"{np.median(again):.1f} x"),
        ("log likelihood of the sixth, per point", f"{column['online_log_likelihood'].mean():.2f}", f"{column['batch_log_likelihood'].mean():.2f}", f"{difference.mean():+.2f}"),
        ("datapoints kept", "0", f"{column['n_points'].mean():.0f}", ""),
        ("number of components", "found", "must be given", ""),
    ]  # fmt: skip
    return summary, "\n".join(
        [
            "# Online and batch learning",
            "",
            _TEXT,
            "",
            table(("", "online", "batch EM", "ratio, difference"), rows),
        ]
    )


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()


def draw(results: list[Case], out_dir: Path) -> list[str]:
    """Draw times and likelihoods of all trials."""
    figure = Figure(figsize=(8.5, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    for axes, keys, scale in (
        (left, ("online_s", "batch_s"), 1e3),
        (right, ("online_log_likelihood", "batch_log_likelihood"), 1.0),
    ):
        ours, theirs = ([scale * r[key] for r in results] for key in keys)
        axes.plot(theirs, ours, "o", alpha=0.6)
        limits = [min(*ours, *theirs), max(*ours, *theirs)]
        axes.plot(limits, limits, color="0.6", linewidth=1.0, label="equal")
        axes.legend(fontsize=8)
    left.set(
        xscale="log",
        yscale="log",
        xlabel="batch EM [ms]",
        ylabel="online [ms]",
        title="Learning five demonstrations",
    )
    right.set(xlabel="batch EM", ylabel="online", title="Log likelihood of a sixth, per point")
    write_figure(figure, out_dir / "online-batch.png")
    return ["online-batch.png"]
