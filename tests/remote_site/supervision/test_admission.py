from __future__ import annotations

import itertools

import pytest

from farhand.common.mode_table import Action, ControlMode, Phase, allowed_actions
from tests.messages import said
from tests.remote_site.bench import Bench, in_mode

MOTIONLESS = [mode for mode in ControlMode if mode is not ControlMode.AUTONOMOUS]


@pytest.mark.parametrize(("mode", "action"), list(itertools.product(MOTIONLESS, Action)))
def test_a_command_is_accepted_where_the_table_allows_it_and_else_refused_by_name(mode, action):
    bench = in_mode(mode)
    bench.ask_lease()
    reply = bench.command(action, model_sha256=bench.send_model().sha256)
    allowed = action in allowed_actions(mode, Phase.NONE) and action is not Action.STOP
    assert reply.accepted is allowed
    if not allowed:
        assert action in said(reply) or action is Action.STOP
        assert bench.mode is mode


def test_a_stop_that_comes_as_a_command_is_told_where_stops_go():
    bench = Bench().armed()
    assert "its own key" in said(bench.command(Action.STOP))


def test_who_may_not_command_is_not_told_more_than_who_may():
    bench = Bench().armed()
    refusal = bench.command(Action.RESET, session="another")
    assert "in control" in said(refusal) and "HOLD" not in said(refusal)


def test_a_refusal_for_age_says_how_old_and_how_old_it_may_be():
    bench = Bench().armed()
    bench.delay_s = 5.0
    refusal = bench.command(Action.COUPLE)
    assert "5.00 s old" in said(refusal) and refusal.measured == pytest.approx(5.0)
