"""Learning: one datapoint, many, their growth over a million, and batch EM at the same K."""

from __future__ import annotations

import time
import warnings

import numpy as np
from numpy.typing import NDArray
from sklearn.exceptions import ConvergenceWarning
from sklearn.mixture import GaussianMixture

from benchmarks.timing import BenchmarkRow, best_times_us
from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.task_frame import TaskFrame
from farhand.evaluation.paper.approach_task import N_DEMONSTRATIONS, demonstrations
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner, Snapshot

Array = NDArray[np.float64]

FRAMES = [TaskFrame.identity(3)]
LAMBDA_M, PERIOD_S, N_POINTS = 0.1, 0.02, 2000
SPACES = {"D = 3": Manifold(3), "pose": POSE}


def helix(space: Manifold, length_m: float, n_points: int, seed: int = 0) -> Array:
    """Return a path of given length with slight noise; a pose turns steadily along it.

    Shape (n_points, C).
    """
    random, s = np.random.default_rng(seed), np.linspace(0.0, length_m, n_points)
    position = np.stack([np.cos(s / 0.8), np.sin(s / 0.8), 0.6 * s], axis=1) * [0.64, 0.64, 1.0]
    turn = 0.1 * s[:, None] * [0.0, 0.6, 0.8]
    base = np.concatenate([np.zeros(3), [1.0, 0.0, 0.0, 0.0]])[: space.n_coordinates]
    tangent = np.hstack([position, turn])[:, : space.n_tangent]
    return space.exp(base, tangent + 1e-4 * random.normal(size=tangent.shape))


def taught(space: Manifold, points: Array, n_demonstrations: int = 2) -> OnlineLearner:
    """Return a learner of some demonstrations of the same path."""
    learner = OnlineLearner(LearnerSettings(LAMBDA_M), space)
    for _ in range(n_demonstrations):
        learner.start()
        learner.observe_many(points, FRAMES, PERIOD_S * np.arange(float(len(points))))
        learner.end()
    return learner


def path_with(space: Manifold, n_components: int) -> Array:
    """Return a path on which as many components are learned, besides the terminal one."""
    low, high = 0.0, 1.0 * n_components
    while True:
        points = helix(space, 0.5 * (low + high), N_POINTS)
        found = taught(space, points).n_components - 1
        if found == n_components or high - low < 1e-3:
            return points
        low, high = (0.5 * (low + high), high) if found < n_components else (low, 0.5 * (low + high))


def rows() -> list[BenchmarkRow]:
    """Time everything about learning."""
    found = []
    for name, space in SPACES.items():
        for K in (5, 15, 50, 200):
            found += _per_point(name, space, K)
    return [*found, *(_per_demonstration(name, space) for name, space in SPACES.items()), _task(), _growth()]


def _per_demonstration(name: str, space: Manifold) -> BenchmarkRow:
    points, n_points = path_with(space, 15), 200
    learner, times = taught(space, points), PERIOD_S * np.arange(float(n_points))
    between = learner.snapshot()
    learner.start()
    learner.observe_many(points[:: len(points) // n_points][:n_points], FRAMES, times)
    whole = learner.snapshot()

    def again() -> None:
        learner.restore(between)
        learner.start()
        learner.restore(whole)

    def end() -> None:
        again()
        learner.end()

    best = best_times_us({"again": again, "end": end})
    return BenchmarkRow(f"learning, {name}: the end of a demonstration, its way", best["end"] - best["again"])


def _per_point(name: str, space: Manifold, K: int) -> list[BenchmarkRow]:
    points = path_with(space, K)
    learner, times = taught(space, points), PERIOD_S * np.arange(float(N_POINTS))
    learner.start()
    began, clock = learner.snapshot(), [0.0]

    def many() -> None:
        learner.restore(began)
        learner.observe_many(points, FRAMES, times)

    def one() -> None:
        clock[0] += PERIOD_S
        learner.observe(points[7], FRAMES, clock[0])

    several = best_times_us({"restore": lambda: learner.restore(began), "many": many})
    learner.restore(began)
    single = best_times_us({"one": one})["one"]
    per_point = (several["many"] - several["restore"]) / N_POINTS
    em = _batch_em_us(space, [points], K) / N_POINTS
    what = f"learning, {name}, K = {learner.n_components - 1}"
    targets = ("<= 1 us", "<= 12 us") if space.n_tangent == 3 else ("<= 3 us", "<= 12 us")
    return [
        BenchmarkRow(
            f"{what}: `observe_many`, a point",
            per_point,
            "batch EM (scikit-learn), a point",
            em,
            targets[0],
        ),
        BenchmarkRow(f"{what}: `observe`, checked", single, target=targets[1]),
    ]


def _task() -> BenchmarkRow:
    """Time five demonstrations of the hot-stab approach, beside batch EM on the same."""
    motions = [d.in_frame() for d in demonstrations(np.random.default_rng(0), N_DEMONSTRATIONS)]
    space, n_points = Manifold(3), sum(map(len, motions))
    learner = OnlineLearner(LearnerSettings(LAMBDA_M), space)
    empty = learner.snapshot()

    def learn() -> None:
        learner.restore(empty)
        for points in motions:
            learner.start()
            learner.observe_many(points, FRAMES, PERIOD_S * np.arange(float(len(points))))
            learner.end()

    ours = best_times_us({"learn": learn})["learn"]
    K = learner.n_components - 1
    what = f"learning {len(motions)} demonstrations of the hot-stab, K = {K}, {n_points} points, a point"
    em = _batch_em_us(space, motions, K)
    return BenchmarkRow(what, ours / n_points, "batch EM (scikit-learn), a point", em / n_points, ">= 20x")


def _batch_em_us(space: Manifold, motions: list[Array], K: int) -> float:
    """Return the least time of two fits of a Gaussian mixture with K full covariances to the same data.

    The data are what the learner sees: the point, the direction of travel and the distance travelled. The
    learner's start regression, ramps, transitions and durations are not part of the peer's work.
    """
    seen = np.concatenate([_as_seen(space, motions[0][0], points) for points in motions])
    fits = []
    for seed in range(2):
        mixture = GaussianMixture(K, reg_covar=1e-6, random_state=seed)
        began = time.thread_time()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)
            mixture.fit(seen)
        fits.append(1e6 * (time.thread_time() - began))
    return min(fits)


def _as_seen(space: Manifold, base: Array, points: Array) -> Array:
    """Return point, direction and distance travelled, weighted as in the assignment."""
    steps = space.log(points[:-1], points[1:])
    steps[:, space.n_dims :] *= LAMBDA_M
    steps = np.concatenate([steps[:1], steps])
    length = np.linalg.norm(steps, axis=1, keepdims=True)
    direction = LAMBDA_M * steps / np.maximum(length, 1e-9)
    return np.hstack([space.log(base, points), direction, 0.5 * np.cumsum(length)[:, None]])


def _growth() -> BenchmarkRow:
    """Time the last 100,000 of a million datapoints beside the first, in alternating blocks."""
    space = Manifold(3)
    points, times = path_with(space, 15), PERIOD_S * np.arange(float(N_POINTS))
    learner, states = OnlineLearner(LearnerSettings(LAMBDA_M), space), []
    for n in range(1, 501):
        if n in (2, 451):  # the first block begins when the components exist
            states.append(learner.snapshot())
        learner.start()
        learner.observe_many(points, FRAMES, times)
        learner.end()
    assert learner.n_points == 1_000_000

    def block(state: Snapshot) -> None:
        learner.restore(state)
        for _ in range(50):
            learner.start()
            learner.observe_many(points, FRAMES, times)
            learner.end()

    early, late = states
    best = best_times_us({"first": lambda: block(early), "last": lambda: block(late)}, seconds=4.0)
    sizes = [sum(array.nbytes for array in state.arrays()) for state in states]
    assert sizes[0] == sizes[1], "what is remembered grew"
    what = f"learning, the last 100,000 of 1,000,000 points, a point ({sizes[1]} bytes remembered, as after 2,000)"
    return BenchmarkRow(
        what, best["last"] / 1e5, "the first 100,000", best["first"] / 1e5, "<= 1.2 of the first"
    )
