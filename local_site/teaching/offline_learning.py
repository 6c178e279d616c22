"""Learning from recorded demonstrations, in one pass over each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from farhand.common.errors import InvalidDemonstration
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.whole_file import fault_of
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.plausibility import (
    check_moves,
    check_together,
    check_units,
    extent_m,
    prepared,
    turns,
)

T = TypeVar("T")

# Default lambda: this fraction of the extent of the demonstrations in the goal's frame.
LAMBDA_FRACTION = 0.25
_LEAST_EXTENT_M = 1e-3
_PURE_ROTATION_M = 0.1


def default_settings(demonstrations: Sequence[Demonstration]) -> LearnerSettings:
    """Return settings for demonstrations of any size, so that a newcomer need set nothing.

    Raises:
        InvalidDemonstration: When nothing moved.
    """
    extent = extent_m(demonstrations)
    if extent >= _LEAST_EXTENT_M:
        return LearnerSettings(LAMBDA_FRACTION * extent)
    if turns(demonstrations):
        # The resolution of orientations does not depend on lambda, so the paper's value serves.
        return LearnerSettings(_PURE_ROTATION_M)
    expected = f"a motion of {_LEAST_EXTENT_M * 1e3:g} mm or more; nothing moved or turned (at most {extent * 1e3:.3g} mm)"
    raise InvalidDemonstration("demonstrations", "position_m", expected)


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
    """Learn one model from demonstration files; read and check all before learning any.

    They are learned as on the page: at its rate, and without rests at their beginnings.

    Raises:
        InvalidDemonstration: Naming the file and field at fault.
    """
    if not paths:
        raise InvalidDemonstration("demonstrations", "", "one or more of them")
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
    return learn(_prepared(demonstrations, [str(path) for path in paths], settings), settings)


def _prepared(
    demonstrations: list[Demonstration], names: list[str], settings: LearnerSettings | None
) -> list[Demonstration]:
    """Return demonstrations as they are learned, each checked under its name."""

    def each(do: Callable[[Demonstration], T]) -> list[T]:
        done = list[T]()
        for name, demonstration in zip(names, demonstrations, strict=True):
            with fault_of(name, InvalidDemonstration, "a demonstration"):
                done.append(do(demonstration))
        return done

    each(check_units)
    check_together(demonstrations, names)
    chosen = settings or default_settings(demonstrations)
    each(lambda demonstration: check_moves(demonstration, chosen))
    return each(lambda demonstration: prepared(demonstration, chosen))
