from __future__ import annotations

import pytest
from msgspec import structs

from farhand.common.mode_table import Guard
from farhand.common.task import PointTask
from farhand.remote_site.supervision.operator_silence import BLIND_AND_ALONE_S, LINK_LOST_S, LinkGuard
from tests.remote_site.planar import TASK


def lost(
    guard: LinkGuard, task: PointTask, silent_s: float, executing: bool = True, blind: bool = False, dt_s: float = 0.1
):  # fmt: skip
    found = guard.lost(task, silent_s, executing, blind, dt_s)
    return found[0] if found is not None else None


@pytest.mark.parametrize(
    ("policy", "expected"),
    [("continue", None), ("hold", Guard.LINK_LOST_HOLD), ("retract", Guard.LINK_LOST_RETRACT)],
)
def test_a_lost_link_is_answered_by_the_tasks_policy_once_for_each_loss(policy, expected):
    guard, task = LinkGuard(), structs.replace(TASK, lost_link=policy)
    for _ in range(2):
        assert lost(guard, task, LINK_LOST_S) is None
        assert lost(guard, task, LINK_LOST_S + 0.1) is expected
        assert lost(guard, task, LINK_LOST_S + 5.0) is None
        assert lost(guard, task, 0.0) is None


def test_what_is_not_executing_is_left_alone_by_a_lost_link():
    guard, task = LinkGuard(), structs.replace(TASK, lost_link="hold")
    assert lost(guard, task, 100.0, executing=False) is None


@pytest.mark.parametrize("allowed", [False, True])
def test_blind_and_alone_for_a_minute_retracts_if_the_task_allows(allowed: bool):
    guard, task = LinkGuard(), structs.replace(TASK, blind_retract=allowed)
    trips = [lost(guard, task, 10.0, executing=False, blind=True, dt_s=1.0) for _ in range(70)]
    assert trips[: int(BLIND_AND_ALONE_S)] == [None] * int(BLIND_AND_ALONE_S)
    assert (Guard.LINK_LOST_RETRACT in trips) == allowed


@pytest.mark.parametrize(("silent_s", "blind"), [(0.0, True), (10.0, False)])
def test_the_minute_begins_anew_when_the_link_or_the_sight_comes_back(silent_s: float, blind: bool):
    guard, task = LinkGuard(), structs.replace(TASK, blind_retract=True)
    for _ in range(3):
        assert lost(guard, task, 10.0, executing=False, blind=True, dt_s=50.0) is None
        assert lost(guard, task, silent_s, executing=False, blind=blind, dt_s=1.0) is None
