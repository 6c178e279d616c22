"""State of a learner as one object: copied, compared, and moved into larger arrays."""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np

from farhand.local_site.learning.clusters import Clusters
from farhand.local_site.learning.dwell_statistics import Dwell, Segment
from farhand.local_site.learning.motion import Motion
from farhand.local_site.learning.way_statistics import WayStatistics

Arrays = TypeVar("Arrays", bound=tuple[np.ndarray, ...])


class Snapshot(NamedTuple):
    """Complete state of a learner, as copies."""

    clusters: Clusters
    dwell: Dwell
    ways: tuple[WayStatistics, ...]
    motion: Motion | None
    segment: Segment | None

    def arrays(self) -> list[np.ndarray]:
        """Iterate over all arrays."""
        return _arrays(self)


def _arrays(part: tuple | np.ndarray | WayStatistics | None) -> list[np.ndarray]:
    if part is None or isinstance(part, np.ndarray):
        return [] if part is None else [part]
    if isinstance(part, WayStatistics):
        return [np.asarray(value) for value in vars(part).values()]
    return [array for each in part for array in _arrays(each)]


def filled(larger: Arrays, smaller: Arrays) -> Arrays:
    """Copy the arrays of one tuple into the corners of a larger one's."""
    for target, source in zip(larger, smaller, strict=True):
        target[tuple(slice(n) for n in source.shape)] = source
    return larger
