"""Nothing implausible is learned: other units, gaps, rests, other rates, motions in which nothing moves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from farhand.common.errors import InvalidDemonstration
from farhand.local_site.learning.learner_settings import LearnerSettings
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import default_settings, learn_files
from farhand.local_site.teaching.plausibility import (
    ARM_PERIOD_S,
    MOVED_PART,
    PERIOD_S,
    REST_S,
    check_moves,
    check_units,
    prepared,
)
from farhand.local_site.teaching.task_library import TaskLibrary
from farhand.local_site.teaching.teaching_permission import NotNow
from tests.local_site.robot_end import FRAMES, TASK

SETTINGS = LearnerSettings(0.1)


def motion(
    n_dims: int = 2, rate_hz: float = 50.0, duration_s: float = 2.0, moving: bool = False
) -> Demonstration:
    """A straight, smooth motion of 0.5 m that turns by a radian in space."""
    n = round(rate_hz * duration_s) + 1
    part = np.linspace(0.0, 1.0, n)
    s = 3 * part**2 - 2 * part**3
    end = np.array([0.4, 0.3, 0.0])[:n_dims]
    turn = Rotation.from_rotvec(s[:, None] * [0.0, 0.0, 1.0])
    origin, rotation = end[None], np.eye(n_dims)[None]
    if moving:
        origin = origin + 0.1 * part[:, None, None]
        turned = turn.as_matrix() if n_dims == 3 else turn.as_matrix()[:, :2, :2]
        rotation = turned[:, None]
    return Demonstration(
        time_s=duration_s * part,
        position_m=s[:, None] * end,
        quat_wxyz=turn.as_quat(scalar_first=True) if n_dims == 3 else None,
        frame_origin_m=origin,
        frame_rotation=rotation,
        frame_names=TASK.frame_names,
    )


def resting(before: Demonstration, rest_s: float) -> Demonstration:
    """The motion after a rest."""
    step_s = before.time_s[1] - before.time_s[0]
    n = round(rest_s / step_s)
    return replace(
        before,
        time_s=np.concatenate([step_s * np.arange(float(n)), rest_s + before.time_s]),
        position_m=np.concatenate([np.repeat(before.position_m[:1], n, 0), before.position_m]),
    )


# Units ------------------------------------------------------------------------------------------

OTHER_UNITS: dict[str, Callable[[Demonstration], Demonstration]] = {
    "time_s: .*milliseconds": lambda d: replace(d, time_s=1e3 * d.time_s),
    "time_s: .*microseconds": lambda d: replace(d, time_s=1e6 * d.time_s),
    "time_s: .*nanoseconds": lambda d: replace(d, time_s=1e9 * d.time_s + 1.7e18),
    "time_s: .*minutes": lambda d: replace(d, time_s=d.time_s / 60.0),
    "position_m: .*millimetres": lambda d: replace(d, position_m=1e3 * d.position_m, frame_origin_m=1e3 * d.frame_origin_m),
    "position_m: .*centimetres": lambda d: replace(d, position_m=1e2 * d.position_m, frame_origin_m=1e2 * d.frame_origin_m),
    "position_m, frame_origin_m: .*millimetres": lambda d: replace(d, frame_origin_m=1e3 * d.frame_origin_m),
    "position_m: a motion of at most 10 m": lambda d: replace(d, position_m=1e300 * d.position_m),
}  # fmt: skip


@pytest.mark.parametrize("expected", OTHER_UNITS)
@pytest.mark.parametrize("n_dims", [2, 3])
def test_another_unit_is_refused_and_named(expected: str, n_dims: int, tmp_path: Path):
    check_units(motion(n_dims))
    other = OTHER_UNITS[expected](motion(n_dims))
    other.save(tmp_path / "other.npz")
    motion(n_dims).save(tmp_path / "good.npz")
    with pytest.raises(InvalidDemonstration, match=f"other.npz: {expected}"):
        learn_files([tmp_path / "good.npz", tmp_path / "other.npz"], SETTINGS)
    with pytest.raises(InvalidDemonstration, match=expected):
        TaskLibrary(TASK, tmp_path).learn([other])


@pytest.mark.parametrize("factor", [1 / 100, 1 / 40, 40])
@pytest.mark.parametrize("field", ["position_m", "time_s"])
def test_a_file_of_another_unit_beside_others_is_refused(tmp_path: Path, field: str, factor: float):
    small = replace(
        motion(), position_m=0.2 * motion().position_m, frame_origin_m=0.2 * motion().frame_origin_m
    )
    small = replace(small, time_s=2.0 * small.time_s)
    odd = replace(small, **{field: factor * getattr(small, field)}, frame_origin_m=np.zeros((1, 2)))
    for name, each in (("a", small), ("b", small), ("odd", odd)):
        each.save(tmp_path / f"{name}.npz")
    with pytest.raises(InvalidDemonstration, match=f"odd.npz: {field}"):
        learn_files([tmp_path / f"{name}.npz" for name in ("a", "b", "odd")])


# Gaps and order ---------------------------------------------------------------------------------


@pytest.mark.parametrize("gap_s", [0.3, 5.0, 30.0])
@pytest.mark.parametrize("at", [0, 40, 99])
def test_a_gap_is_refused_with_its_place_and_length(gap_s: float, at: int):
    times = motion().time_s.copy()
    times[at + 1 :] += gap_s
    with pytest.raises(
        InvalidDemonstration, match=rf"time_s: no gap .* for {gap_s + 0.02:g} s after sample {at} "
    ):
        prepared(replace(motion(), time_s=times), SETTINGS)


@pytest.mark.parametrize("at", [1, 50, 100])
def test_times_that_do_not_increase_are_named(at: int):
    times = motion().time_s.copy()
    times[at] = times[at - 1]
    with pytest.raises(InvalidDemonstration, match=f"sample {at} of 0 to 100 is at"):
        replace(motion(), time_s=times)


# Rests and rates --------------------------------------------------------------------------------


@pytest.mark.parametrize("rest_s", [1.0, 10.0, 30.0])
@pytest.mark.parametrize("rate_hz", [20.0, 50.0, 1000.0])
def test_a_rest_at_the_beginning_is_cut(rest_s: float, rate_hz: float):
    cut = prepared(resting(motion(rate_hz=rate_hz), rest_s), SETTINGS)
    assert cut.time_s[-1] - cut.time_s[0] == pytest.approx(2.0 + REST_S - 0.2, abs=0.3)
    np.testing.assert_allclose(cut.position_m[[0, -1]], motion().position_m[[0, -1]], atol=1e-9)


@pytest.mark.parametrize("rest_s", [0.0, 0.3, 10.0])
def test_the_page_cuts_a_rest_as_a_file_is_cut(tmp_path: Path, rest_s: float):
    library = TaskLibrary(TASK, tmp_path)
    library.record(FRAMES)
    slow = resting(motion(), rest_s)
    for point, time_s in zip(slow.position_m, slow.time_s, strict=True):
        library.hand(point, 5.0 + float(time_s))
    library.end()
    (kept,) = library.demonstrations
    settings = LearnerSettings(TASK.learning.max_distance_m or 0.0)
    as_file = prepared(slow, settings)
    np.testing.assert_allclose(kept.position_m, as_file.position_m, atol=1e-9)
    assert kept.time_s[0] == 0.0


@pytest.mark.parametrize("n_dims", [2, 3])
@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("rate_hz", [10.0, 25.0, 100.0, 1000.0])
def test_every_rate_becomes_the_page_s_and_the_motion_stays(n_dims: int, moving: bool, rate_hz: float):
    recorded, exact = motion(n_dims, rate_hz, moving=moving), motion(n_dims, 1000.0, moving=moving)
    made = prepared(recorded, SETTINGS)
    np.testing.assert_allclose(np.diff(made.time_s), ARM_PERIOD_S if n_dims == 3 else PERIOD_S, rtol=0.02)
    nearest = np.round(1000.0 * made.time_s).astype(int)
    np.testing.assert_allclose(made.position_m, exact.position_m[nearest], atol=2e-3)
    np.testing.assert_allclose(made.in_frame(), exact.in_frame()[nearest], atol=3e-3)
    if made.quat_wxyz is not None and exact.quat_wxyz is not None:
        np.testing.assert_allclose(made.quat_wxyz, exact.quat_wxyz[nearest], atol=2e-3)
    np.testing.assert_array_equal(made.position_m[-1], recorded.position_m[-1])


def test_what_has_the_page_s_rate_is_learned_as_it_is_and_preparing_twice_changes_nothing():
    once = prepared(resting(motion(rate_hz=333.0), 4.0), SETTINGS)
    np.testing.assert_array_equal(prepared(motion(), SETTINGS).position_m, motion().position_m)
    twice = prepared(once, SETTINGS)
    assert len(once.position_m) - len(twice.position_m) <= 1  # of the rest
    np.testing.assert_allclose(twice.position_m, once.position_m[-len(twice.position_m) :], atol=1e-12)


def test_a_slow_and_a_fast_file_weigh_the_same(tmp_path: Path):
    for rate_hz in (10.0, 1000.0):
        motion(rate_hz=rate_hz).save(tmp_path / f"{rate_hz:g}.npz")
    one = [learn_files([tmp_path / f"{rate_hz:g}.npz"], SETTINGS).counts.sum() for rate_hz in (10.0, 1000.0)]
    assert one[0] == pytest.approx(one[1], abs=3)


# Something moves --------------------------------------------------------------------------------

LEAST_M = MOVED_PART * SETTINGS.max_distance_m


def shrunk(part: float, turn: float, n_dims: int = 3) -> Demonstration:
    """A part of the motion in position, and in turn [rad]."""
    whole = motion(n_dims)
    angle = turn * np.linspace(0.0, 1.0, whole.time_s.size)
    quat = Rotation.from_rotvec(angle[:, None] * [0.6, 0.0, 0.8]).as_quat(scalar_first=True)
    return replace(whole, position_m=part * whole.position_m, quat_wxyz=quat if n_dims == 3 else None)


@pytest.mark.parametrize(
    ("part", "turn", "n_dims"),
    [(0.0, 0.0, 2), (0.0, 0.0, 3), (0.019, 0.0, 2), (0.019, 0.09, 3), (0.0, 0.09, 3)],
)
def test_a_motion_below_the_model_s_resolution_is_refused(part: float, turn: float, n_dims: int):
    with pytest.raises(InvalidDemonstration, match=r"a motion of at least 10 mm.* got "):
        check_moves(shrunk(part, turn, n_dims), SETTINGS)


@pytest.mark.parametrize(("part", "turn", "n_dims"), [(0.021, 0.0, 2), (0.021, 0.0, 3), (0.0, 0.11, 3)])
def test_a_motion_above_it_is_not(part: float, turn: float, n_dims: int):
    check_moves(shrunk(part, turn, n_dims), SETTINGS)


def test_a_hand_that_rests_while_its_target_moves_has_not_moved():
    still = replace(motion(moving=True), position_m=np.full((101, 2), 0.2))
    with pytest.raises(InvalidDemonstration, match="got 0 mm"):
        check_moves(still, SETTINGS)
    with pytest.raises(InvalidDemonstration, match="got 0 mm"):
        riding = motion(moving=True)
        riding = replace(riding, frame_rotation=np.eye(2)[None], position_m=riding.frame_origin_m[:, 0] + 0.1)
        check_moves(riding, SETTINGS)


HANDS = {
    "a click": [(0.0, 0.3, 0.3), (0.15, 0.301, 0.3)],
    "a forgotten End": [(0.5 * k, 0.3, 0.3) for k in range(60)],
    "a trembling hand": [(0.02 * k, 0.3 + 0.002 * (k % 2), 0.3) for k in range(400)],
}


@pytest.mark.parametrize("case", HANDS)
def test_nothing_of_a_hand_that_did_not_move_is_kept(tmp_path: Path, case: str):
    library = TaskLibrary(TASK, tmp_path)
    library.learn([motion()])
    before, files = library.learned, sorted((tmp_path / TASK.name).rglob("*"))
    library.record(FRAMES)
    for time_s, *point in HANDS[case]:
        library.hand(np.array(point), time_s)
    with pytest.raises(NotNow, match="not kept"):
        library.end()
    assert library.learned is before and not library.recording and len(library.demonstrations) == 1
    assert sorted((tmp_path / TASK.name).rglob("*")) == files
    library.learn([motion()])
    assert len(library.demonstrations) == 2


def test_one_still_sample_among_good_ones_is_named_and_none_is_learned(tmp_path: Path):
    still = replace(motion(), position_m=np.zeros((101, 2)))
    library = TaskLibrary(TASK, tmp_path)
    with pytest.raises(InvalidDemonstration, match="position_m"):
        library.learn([motion(), still, motion()])
    assert library.learned is None and not (tmp_path / TASK.name).exists()
    for name, each in (("a", motion()), ("still", still), ("b", motion())):
        each.save(tmp_path / f"{name}.npz")
    with pytest.raises(InvalidDemonstration, match=r"still\.npz: position_m"):
        learn_files([tmp_path / f"{name}.npz" for name in ("a", "still", "b")])


def test_a_pure_rotation_is_learned_and_what_neither_moves_nor_turns_is_said(tmp_path: Path):
    shrunk(0.0, 2.5).save(tmp_path / "turn.npz")
    model = learn_files([tmp_path / "turn.npz"])
    assert model.manifold.oriented and model.n_components >= 3
    with pytest.raises(InvalidDemonstration, match="nothing moved or turned"):
        default_settings([shrunk(0.0, 0.01)])
