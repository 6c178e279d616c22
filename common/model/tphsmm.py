"""TPHSMM: the parameters theta of a task-parametrised hidden semi-Markov model (Sec. III).

Immutable, checked on construction, compared by content. *Terminal* components are where demonstrations
ended: absorbing, with exit probability one, so that a learned chain always ends somewhere.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidModel
from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.way import MAX_WAYS, Way

Array = NDArray[np.float64]

_ROW_SUM_TOLERANCE = 1e-9
_UNIT_TOLERANCE = 1e-6
MAX_COMPONENTS = 256
"""More are never learned from demonstrations, and none are executed in time."""
_MOST = 1e6
"""No number of a model of a motion is larger [m, s, m^2, ...]: larger ones only overflow where they are used."""

# Shape and kind of every array: K components, P frames, C coordinates of a point and T of a tangent.
# Both are D for positions; for poses they are 7 and 6 (see `farhand.common.model.manifold`).
ARRAY_FIELDS: dict[str, tuple[str, type]] = {
    "initial": ("K", np.float64),
    "transition": ("KK", np.float64),
    "time_share": ("KK", np.float64),
    "exit": ("K", np.float64),
    "means": ("PKC", np.float64),
    "covariances": ("PKTT", np.float64),
    "duration_mean_s": ("K", np.float64),
    "duration_variance_s2": ("K", np.float64),
    "terminal": ("K", np.bool_),
    "counts": ("K", np.int64),
    "phase": ("K", np.float64),
    "elapsed_mean_s": ("K", np.float64),
    "slopes": ("PKT", np.float64),
    "residual_covariances": ("PKTT", np.float64),
    "start_means": ("PKC", np.float64),
    "start_covariances": ("PKTT", np.float64),
}
_POINTS = ("means", "start_means")
_COVARIANCES = ("covariances", "residual_covariances", "start_covariances")
_NOT_NEGATIVE = (
    "initial",
    "transition",
    "time_share",
    "exit",
    "duration_mean_s",
    "counts",
    "phase",
    "elapsed_mean_s",
)


@dataclass(frozen=True, eq=False, kw_only=True)
class TPHSMM:
    """Parameters theta of one learned task.

    Args:
        frame_names: One name per task frame. Length P.
        max_distance_m: The lambda of learning [m].
        n_demonstrations: Demonstrations learned.
        initial: Probability pi_i that a demonstration begins in component i. Shape (K,).
        transition: Probability a_il of going from i to l, zero diagonal. Shape (K, K).
        time_share: Of the time spent in i, the share before going on to l. Shape (K, K).
        exit: Probability that the motion ends after component i. Shape (K,).
        means: Means mu_i^(j) [m]. Shape (P, K, C).
        covariances: Covariances Sigma_i^(j) [m^2, rad^2]. Shape (P, K, T, T).
        duration_mean_s: Mean duration mu_i^D [s]. Shape (K,).
        duration_variance_s2: Variance of the duration Sigma_i^D [s^2]. Shape (K,).
        terminal: Whether demonstrations ended in the component. Shape (K,).
        counts: Datapoints n_i of the component. Shape (K,).
        phase: Mean fraction of the demonstration's time at which it is visited. Shape (K,).
        elapsed_mean_s: Mean time since the component was entered, over its datapoints [s]. Shape (K,).
        slopes: Regression of the point on that time among motions of one start, the ramp reference [m/s, rad/s].
            Shape (P, K, T).
        residual_covariances: Covariance left by that regression [m^2, rad^2]. Shape (P, K, T, T).
        start_means: Mean start of the demonstrations seen by the component [m]. Shape (P, K, C).
        start_covariances: Covariance of these starts, with its prior, of position and rotation each by itself
            [m^2, rad^2]. Shape (P, K, T, T).
        ways: Whole motions, and how they depend on where they start.

    Raises:
        InvalidModel: Naming the field whose shape, range or normalisation is wrong.
    """

    frame_names: tuple[str, ...]
    max_distance_m: float
    n_demonstrations: int
    initial: Array
    transition: Array
    time_share: Array
    exit: Array
    means: Array
    covariances: Array
    duration_mean_s: Array
    duration_variance_s2: Array
    terminal: NDArray[np.bool_]
    counts: NDArray[np.int64]
    phase: Array
    elapsed_mean_s: Array
    slopes: Array
    residual_covariances: Array
    start_means: Array
    start_covariances: Array
    ways: tuple[Way, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "frame_names", tuple(self.frame_names))
        means = np.asarray(self.means)
        if means.ndim != 3 or 0 in means.shape or means.shape[1] > MAX_COMPONENTS:
            raise InvalidModel(
                "model", "means", f"shape (P, K, C) with 1 to {MAX_COMPONENTS} components, got {means.shape}"
            )
        sizes = dict(zip("PKC", means.shape, strict=True))
        sizes["T"] = POSE.n_tangent if self._of_poses(means) else sizes["C"]
        for name, (axes, kind) in ARRAY_FIELDS.items():
            array = _checked(name, getattr(self, name), tuple(sizes[axis] for axis in axes), kind)
            object.__setattr__(self, name, array)
        object.__setattr__(self, "ways", tuple(self.ways))
        self._check_scalars()
        self._check_ways()
        self._check_probabilities()
        D = self.n_dims
        if self.start_covariances[..., :D, D:].any() or self.start_covariances[..., D:, :D].any():
            raise InvalidModel("model", "start_covariances", "zeros between position and rotation")
        for name in _COVARIANCES:
            _check_positive_definite(name, getattr(self, name))
        for name in _POINTS if self.manifold.oriented else ():
            norm = np.linalg.norm(getattr(self, name)[..., self.n_dims :], axis=-1)
            if np.abs(norm - 1.0).max() > _UNIT_TOLERANCE:
                raise InvalidModel("model", name, "unit quaternions (w, x, y, z) after the positions")

    def _of_poses(self, means: Array) -> bool:
        return (means.shape[2], np.shape(self.covariances)[-1:]) == (POSE.n_coordinates, (POSE.n_tangent,))

    def _check_scalars(self) -> None:
        names = self.frame_names
        if len(names) != self.n_frames or not all(isinstance(n, str) and n for n in names):
            raise InvalidModel("model", "frame_names", f"{self.n_frames} names, one per frame, got {names!r}")
        if len(set(names)) != len(names):
            raise InvalidModel("model", "frame_names", f"names that differ, got {names!r}")
        if not 0.0 < self.max_distance_m <= _MOST:
            expected = f"a positive number of at most {_MOST:g}, got {self.max_distance_m}"
            raise InvalidModel("model", "max_distance_m", expected)
        if self.n_demonstrations < 0:
            raise InvalidModel("model", "n_demonstrations", f"zero or more, got {self.n_demonstrations}")

    def _check_ways(self) -> None:
        if len(self.ways) > MAX_WAYS:
            raise InvalidModel("model", "ways", f"at most {MAX_WAYS}, got {len(self.ways)}")
        for way in self.ways:
            if way.space != self.manifold or len(way.points) != self.n_frames:
                raise InvalidModel("model", "ways", "points of the model's frames and space")
            if not (0 <= way.terminal < self.n_components and self.terminal[way.terminal]):
                raise InvalidModel("model", "ways.terminal", "a terminal component")

    def _check_probabilities(self) -> None:
        for name in _NOT_NEGATIVE:
            if (getattr(self, name) < 0).any():
                raise InvalidModel("model", name, "no negative number")
        if (self.duration_variance_s2 <= 0).any():
            raise InvalidModel("model", "duration_variance_s2", "positive numbers")
        if abs(self.initial.sum() - 1.0) > _ROW_SUM_TOLERANCE:
            raise InvalidModel("model", "initial", f"a sum of 1, got {self.initial.sum():.6g}")
        rows = self.transition.sum(axis=1) + self.exit
        if np.abs(rows - 1.0).max() > _ROW_SUM_TOLERANCE:
            raise InvalidModel("model", "transition, exit", "rows of [transition | exit] that sum to 1")
        if np.diag(self.transition).any():
            raise InvalidModel(
                "model", "transition", "a zero diagonal: how long to stay is the duration's part"
            )
        if (self.exit[self.terminal] < 1.0 - _ROW_SUM_TOLERANCE).any():
            raise InvalidModel("model", "exit", "1 for every terminal component")

    @property
    def n_frames(self) -> int:
        """Number of task frames P."""
        return self.means.shape[0]

    @property
    def n_components(self) -> int:
        """Number of components K, the terminal ones included."""
        return self.means.shape[1]

    @property
    def manifold(self) -> Manifold:
        """The space: positions or poses."""
        return Manifold.of(self.means.shape[2], self.covariances.shape[3])

    @property
    def n_dims(self) -> int:
        """Dimension D of positions and task frames."""
        return self.manifold.n_dims

    @property
    def n_paths(self) -> int:
        """Components in which a demonstration began and from which a terminal one is reached."""
        reached = self.terminal.copy()
        for _ in range(self.n_components):
            reached |= (self.transition[:, reached] > 0).any(axis=1)
        return int(((self.initial > 0) & reached).sum())

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TPHSMM):
            return NotImplemented
        arrays = (f.name for f in fields(self) if f.name != "ways")
        same = all(np.array_equal(getattr(self, name), getattr(other, name)) for name in arrays)
        return same and self.ways == other.ways

    def __hash__(self) -> int:
        return hash((self.frame_names, self.means.tobytes()))

    def __repr__(self) -> str:
        return (
            f"TPHSMM(K={self.n_components}, P={self.n_frames}, D={self.n_dims}, "
            f"poses={self.manifold.oriented}, "
            f"ways={len(self.ways)}, terminal={int(self.terminal.sum())}, demonstrations={self.n_demonstrations})"
        )


def _checked(name: str, value: object, shape: tuple[int, ...], kind: type) -> NDArray:
    """Return a read-only, finite copy of the given kind; integers are refused where floats are expected."""
    raw = np.asarray(value)
    if raw.shape != shape:
        raise InvalidModel("model", name, f"shape {shape}, got {raw.shape}")
    if not np.can_cast(raw.dtype, kind, casting="same_kind"):
        raise InvalidModel("model", name, f"type {np.dtype(kind).name}, got {raw.dtype.name}")
    array = np.array(raw, dtype=kind, order="C")
    if not np.isfinite(array).all():
        raise InvalidModel("model", name, "finite numbers only")
    if array.dtype.kind == "f" and np.abs(array).max() > _MOST:
        raise InvalidModel("model", name, f"numbers of at most {_MOST:g}, got {np.abs(array).max():g}")
    array.setflags(write=False)
    return array


def _check_positive_definite(name: str, covariances: Array) -> None:
    scale = np.abs(covariances).max()
    if np.abs(covariances - np.swapaxes(covariances, -1, -2)).max() > 1e-9 * scale:
        raise InvalidModel("model", name, "symmetric matrices")
    if np.linalg.eigvalsh(covariances).min() <= 0:
        raise InvalidModel("model", name, "positive definite matrices")
