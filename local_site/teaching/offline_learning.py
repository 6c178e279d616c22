"""Learning from recorded demonstrations, in one pass over each."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from farhand.common.errors import InvalidDemonstration
from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.demonstration import Demonstration

# Lambda where nobody names it: this fraction of the extent of the demonstrations in the goal's frame.
LAMBDA_FRACTION = 0.25


def extent_m(demonstrations: Sequence[Demonstration]) -> float:
    """Largest edge of the box around all demonstrations, seen from the goal [m]."""
    points = np.concatenate([demonstration.in_frame() for demonstration in demonstrations])
    return float(np.ptp(points, axis=0).max())


def default_settings(demonstrations: Sequence[Demonstration]) -> LearnerSettings:
    """Settings for demonstrations of any size: nothing for a newcomer to set.

    Raises:
        InvalidDemonstration: When nothing moved.
    """
    extent = extent_m(demonstrations)
    if extent <= 0.0:
        raise InvalidDemonstration("demonstrations", "position_m", "a motion; nothing moved")
    return LearnerSettings(LAMBDA_FRACTION * extent)


def learn(demonstrations: Sequence[Demonstration], settings: LearnerSettings | None = None) -> TPHSMM:
    """Learn one model from all demonstrations, in their order.

    Raises:
        InvalidDemonstration: When there is none, or they differ in dimension or frames.
    """
    if not demonstrations:
        raise InvalidDemonstration("demonstrations", "", "one or more of them")
    first = demonstrations[0]
    for number, other in enumerate(demonstrations):
        if (other.n_dims, other.frame_names) != (first.n_dims, first.frame_names):
            expected = f"dimension {first.n_dims} and frames {first.frame_names}, as in the first one"
            raise InvalidDemonstration(f"demonstration {number + 1}", "position_m, frame_names", expected)
        if other.space != first.space:
            expected = "orientations in all demonstrations, or in none"
            raise InvalidDemonstration(f"demonstration {number + 1}", "quat_wxyz", expected)
    learner = OnlineLearner(settings or default_settings(demonstrations), first.space, first.frame_names)
    for demonstration in demonstrations:
        learner.start()
        learner.observe_many(demonstration.points, demonstration.frames(), demonstration.time_s)
        learner.end()
    return learner.model()


def learn_files(paths: Sequence[Path | str], settings: LearnerSettings | None = None) -> TPHSMM:
    """Learn one model from demonstration files; all are read and checked before any is learned.

    Raises:
        InvalidDemonstration: Naming the file and field at fault.
    """
    demonstrations = [Demonstration.load(path) for path in paths]
    for path, demonstration in zip(paths, demonstrations, strict=True):
        if demonstration.frame_names != demonstrations[0].frame_names:
            expected = f"{demonstrations[0].frame_names}, as in {paths[0]}"
            raise InvalidDemonstration(str(path), "frame_names", expected)
        if demonstration.n_dims != demonstrations[0].n_dims:
            expected = f"dimension {demonstrations[0].n_dims}, as in {paths[0]}"
            raise InvalidDemonstration(str(path), "position_m", expected)
        if demonstration.space != demonstrations[0].space:
            expected = f"{'no ' if demonstration.space.oriented else ''}orientations, as in {paths[0]}"
            raise InvalidDemonstration(str(path), "quat_wxyz", expected)
    return learn(demonstrations, settings)
