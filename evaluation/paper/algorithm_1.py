"""Algorithm 1 as printed, as its authors published it, and in the count form that Farhand uses.

All three see the same datapoints with the same assignment to components; the truth is the batch mean of
each component's datapoints, and their covariance plus the minimum covariance.

- *to the letter*: pi = 1/N + pi_q, then pi_q = 1/K: the weight that the next lines need is overwritten, and
  the shares of the past and of the new datapoint do not sum to one.
- *printed*: the same without the overwriting, pi_q = pi afterwards; weights are never normalised.
- *published*: the weights of the authors' code, with N counted before the update instead of after it.
- *count*: n += 1, mu += (x - mu)/n, and the scatter likewise; pi_i = n_i / N.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from farhand.evaluation.metrics.tables import quantiles, table, write_figure
from farhand.evaluation.paper.approach_task import LAMBDA_M
from farhand.evaluation.paper.approach_trials import taught
from farhand.evaluation.study import Case, reporting_seeds

Array = NDArray[np.float64]
Gaussians = dict[int, tuple[Array, Array]]

_TRIALS = 30
_MIN_COVARIANCE = (0.05 * LAMBDA_M) ** 2 * np.eye(3)
FORMS = ("to the letter", "printed", "published", "count")


def cases(trials: int | None, seed: int) -> list[Case]:
    """Return one stream of datapoints per seed."""
    return [{"seed": s} for s in reporting_seeds(seed, trials or _TRIALS)]


def trial(case: Case) -> Case:
    """Return the largest errors of each form, over the components."""
    shown, _ = taught(case["seed"])
    points = np.concatenate([d.in_frame() for d in shown])
    labels = _assigned(points)
    truth = {q: _batch(points[labels == q]) for q in set(labels.tolist())}
    row: Case = {**case, "n_components": len(truth)}
    for form in FORMS:
        learned = _stream(points, labels, form)
        row[f"mean_error_m, {form}"] = max(float(np.linalg.norm(learned[q][0] - truth[q][0])) for q in truth)
        row[f"covariance_error, {form}"] = max(
            float(np.linalg.norm(learned[q][1] - truth[q][1]) / np.linalg.norm(truth[q][1])) for q in truth
        )
    return row


def _assigned(points: Array) -> NDArray[np.int64]:
    """Assign each point to the nearest running mean, or to a new component beyond lambda."""
    means, counts, labels = [points[0]], [1], [0]
    for x in points[1:]:
        distances = np.linalg.norm(np.array(means) - x, axis=1)
        q = int(np.argmin(distances))
        if distances[q] > LAMBDA_M:
            q = len(means)
            means.append(x)
            counts.append(0)
        counts[q] += 1
        means[q] = means[q] + (x - means[q]) / counts[q]
        labels.append(q)
    return np.array(labels)


def _batch(points: Array) -> tuple[Array, Array]:
    return points.mean(axis=0), _MIN_COVARIANCE + np.cov(points, rowvar=False, ddof=0).reshape(3, 3)


def _stream(points: Array, labels: NDArray[np.int64], form: str) -> Gaussians:
    """Return means and covariances after all datapoints, one by one."""
    mu: dict[int, Array] = {}
    sigma: dict[int, Array] = {}
    weight: dict[int, float] = {}
    for N, (x, q) in enumerate(zip(points, labels.tolist(), strict=True)):  # N datapoints before this one
        if q not in mu:
            mu[q], sigma[q] = x, _MIN_COVARIANCE
            weight[q] = 1.0 if form == "count" else 1.0 / (N + 1)
        else:
            past, new = weight[q], 1.0 if form == "count" else 1.0 / (N + (form == "published"))
            total = past + new
            past = 1.0 / len(mu) if form == "to the letter" else past
            mean = (past * mu[q] + new * x) / total
            shift, rest = (mu[q] - mean)[:, None], (x - mean)[:, None]
            sigma[q] = (past * (sigma[q] + shift @ shift.T) + new * (_MIN_COVARIANCE + rest @ rest.T)) / total
            mu[q] = mean
            weight[q] = past if form == "to the letter" else total
        if form == "published":  # all weights sum to one again
            whole = sum(weight.values())
            weight = {i: w / whole for i, w in weight.items()}
    return {q: (mu[q], sigma[q]) for q in mu}


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Tabulate the errors of each form."""
    summary: Case = {}
    rows = []
    for form in FORMS:
        means = [r[f"mean_error_m, {form}"] for r in results]
        covariances = [r[f"covariance_error, {form}"] for r in results]
        summary[form] = {"worst_mean_error_m": max(means), "worst_covariance_error": max(covariances)}
        rows.append(
            (
                form,
                quantiles(means, 1e3),
                max(means) * 1e3,
                quantiles(covariances, 100),
                100 * max(covariances),
            )
        )
    header = ("form", "error of the mean [mm], median / 90 %", "largest", "error of the covariance [%], median / 90 %", "largest")  # fmt: skip
    note = "Each trial counts its worst component."
    return summary, "\n".join(["# Algorithm 1", "", _TEXT, "", table(header, rows), "", note])


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()


def draw(results: list[Case], out_dir: Path) -> list[str]:
    """Draw the errors of the mean, by form."""
    figure = Figure(figsize=(5.5, 3.4), layout="constrained")
    axes = figure.subplots()
    for number, form in enumerate(FORMS):
        errors = [max(1e3 * r[f"mean_error_m, {form}"], 1e-14) for r in results]
        axes.plot(np.full(len(errors), number) + np.linspace(-0.2, 0.2, len(errors)), errors, "o", alpha=0.6)
    axes.set_xticks(range(len(FORMS)), FORMS)
    axes.set(yscale="log", ylabel="error of the worst mean [mm]")
    axes.grid(alpha=0.3, axis="y")
    write_figure(figure, out_dir / "algorithm-1.png")
    return ["algorithm-1.png"]
