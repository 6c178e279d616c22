"""Settings of the learner: the two parameters of the paper, and fixed weights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidConfiguration
from farhand.local_site.learning.dp_means import FRAME_RULES

Array = NDArray[np.float64]

# With a smaller weight a component could span half a turn, where differences of rotations lose their sign.
_LEAST_ROTATION_WEIGHT = 0.4

_LEAST_M = 1e-7
"""Least length, below the resolution of any sensor; smaller covariances cannot be inverted beside others [m]."""


@dataclass(frozen=True)
class LearnerSettings:
    """Settings of the learner.

    Args:
        max_distance_m: Lambda, the distance beyond which a datapoint founds a component [m].
        min_std_m: Square root of the minimum covariance [m]; a twentieth of lambda when not given.
        hysteresis: A switch of component must be nearer by this fraction of lambda.
        direction_weight: Weight of the direction of travel in the assignment, in lambda.
        distance_weight: Weight of the distance travelled in the assignment.
        rotation_weight: Weight of a radian in the assignment of poses, in lambda; at least 0.4.
        min_std_rad: Square root of the minimum covariance of orientations [rad].
        frame_rule: Rule that combines the distances of several task frames, one of `FRAME_RULES` (see `dp_means`).

    Raises:
        InvalidConfiguration: When a number is not finite or out of range.
    """

    max_distance_m: float
    min_std_m: float | None = None
    hysteresis: float = 0.1
    direction_weight: float = 1.0
    distance_weight: float = 0.5
    rotation_weight: float = 1.0
    min_std_rad: float = 0.05
    frame_rule: str = "nearest"

    def __post_init__(self) -> None:
        for name in ("max_distance_m", "min_std"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= _LEAST_M):
                raise InvalidConfiguration("learner", name, f"{_LEAST_M:g} m or more, got {value} m")
        if not (np.isfinite(self.min_std_rad) and self.min_std_rad > 0):
            raise InvalidConfiguration("learner", "min_std_rad", f"a positive angle, got {self.min_std_rad}")
        if not (np.isfinite(self.rotation_weight) and self.rotation_weight >= _LEAST_ROTATION_WEIGHT):
            expected = f"{_LEAST_ROTATION_WEIGHT} or more, got {self.rotation_weight}"
            raise InvalidConfiguration("learner", "rotation_weight", expected)
        if self.frame_rule not in FRAME_RULES:
            expected = f"one of {', '.join(FRAME_RULES)}, got {self.frame_rule!r}"
            raise InvalidConfiguration("learner", "frame_rule", expected)
        for name in ("hysteresis", "direction_weight", "distance_weight"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise InvalidConfiguration("learner", name, f"zero or more, got {value}")

    @property
    def min_std(self) -> float:
        """Square root of the minimum covariance [m]."""
        return 0.05 * self.max_distance_m if self.min_std_m is None else self.min_std_m

    @property
    def weights(self) -> Array:
        """Weights of direction, distance travelled and rotation. Shape (3,)."""
        return np.array([self.direction_weight, self.distance_weight, self.rotation_weight])
