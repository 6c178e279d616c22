"""What surrounds the arm at one instant, and how it appears to the vehicle that carries the arm."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from farhand.common.arm.dimensions import Dimensions
from farhand.common.arm.poses import AT_ORIGIN, compose, inverse, rotation
from farhand.common.arm.simulation.receptacle import FACING_QUAT
from farhand.common.model.manifold import POSE

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Surroundings:
    """All that disturbs the arm, in the axes of the earth, z up.

    Args:
        receptacle: Where its spring pulls it. A pose. Shape (7,).
        vehicle: What the arm's base stands on. A pose. Shape (7,).
        current_m_s: Of the water. Shape (3,).
        push_n: Force on the hand. Shape (3,).

    Raises:
        InvalidInput: When a pose is none.
    """

    receptacle: Array
    vehicle: Array = field(default_factory=AT_ORIGIN.copy)
    current_m_s: Array = field(default_factory=lambda: np.zeros(3))
    push_n: Array = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        for name in ("receptacle", "vehicle"):
            object.__setattr__(self, name, POSE.checked(getattr(self, name), "surroundings", name))

    @classmethod
    def still(cls, dimensions: Dimensions) -> Surroundings:
        """Everything at rest, the receptacle facing the arm at its first place."""
        return cls(np.concatenate([dimensions.receptacle_m, FACING_QUAT]))

    def with_receptacle(self, pose: Array) -> Surroundings:
        """The same with the receptacle elsewhere."""
        return replace(self, receptacle=pose)

    def receptacle_from_vehicle(self) -> Array:
        """The receptacle's pose in the vehicle's axes. Shape (7,)."""
        return compose(inverse(self.vehicle), self.receptacle)

    def to_vehicle(self, vector: Array) -> Array:
        """A vector of the earth in the vehicle's axes. Shape (3,)."""
        return self._earth @ vector

    @cached_property
    def _earth(self) -> Array:
        """The axes of the earth in those of the vehicle. Shape (3, 3)."""
        return rotation(self.vehicle).T
