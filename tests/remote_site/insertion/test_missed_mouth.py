from __future__ import annotations

import numpy as np

from farhand.remote_site.insertion.jams_and_retries import MissedMouthDetector


def rule_on(*tips: tuple[float, float, float]) -> MissedMouthDetector:
    """A rule that has seen the plug at these places before."""
    rule = MissedMouthDetector()
    for tip in tips:
        assert rule.goal_m(np.array(tip)) is None
    return rule


def goal_m(rule: MissedMouthDetector, *tip: float) -> list[float] | None:
    goal = rule.goal_m(np.array(tip))
    return None if goal is None else goal.tolist()


def test_a_plug_that_was_never_on_the_axis_is_on_its_way_to_it():
    rule_on((0.10, 0.0, -0.14), (0.03, 0.0, -0.03), (0.03, 0.0, 0.0))


def test_a_receptacle_found_elsewhere_leaves_the_plug_beside_it_or_off_its_axis():
    rule = MissedMouthDetector()
    rule.jumped()
    assert goal_m(rule, 0.015, 0.0, 0.0) is None
    assert goal_m(rule, 0.03, 0.0, 0.0) == [0.03, 0.0, -0.09]
    assert goal_m(rule, 0.03, 0.0, -0.09) == [0.0, 0.0, -0.09]
    assert goal_m(rule, 0.0, 0.0, -0.09) is None


def test_a_receptacle_that_slips_away_unnoticed_is_lost_to_the_axis_and_found_again_there():
    rule = rule_on((0.01, 0.0, -0.12), (0.0, 0.028, -0.06))
    assert goal_m(rule, 0.0, 0.04, -0.06) == [0.0, 0.0, -0.09]
    rule = rule_on((0.01, 0.0, -0.12))
    assert goal_m(rule, 0.0, 0.04, -0.13) == [0.0, 0.0, -0.13]
    assert goal_m(rule_on((0.01, 0.0, -0.16)), 0.0, 0.04, -0.16) is None


def test_once_inside_the_jump_is_over():
    rule = MissedMouthDetector()
    rule.jumped()
    assert goal_m(rule, 0.001, 0.0, 0.02) is None
    assert goal_m(rule, 0.025, 0.0, 0.02) is None
