"""The hand on a board by gamepad and keys: lines of the tab in, positions of the hand out, in virtual time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from farhand.common.mode_table import ControlMode
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.scene.board.board_jog import BoardJog
from farhand.local_site.view.scene.hand_keys import SILENT_S
from tests.local_site.view.panels.test_truth import OK, ROBOT_IN

PERIOD_S, FASTEST_M_S = 1.0 / 30.0, 0.25
RIGHT = "a;0,0,0;1;1.00,0.00,0.00;1"


class Hand:
    """A jog with all drags that it made."""

    def __init__(self, state: ConsoleState):
        self.state = replace(state, link=OK, robot=structs.replace(ROBOT_IN, mode=ControlMode.DISARMED))
        self.drags: list[tuple[str, tuple[float, float]]] = []
        self.jog = BoardJog(lambda phase, at_m: self.drags.append((phase, at_m)), (1.0, 1.0))
        self.now_s = 100.0

    def wait(self, duration_s: float, text: str = "") -> None:
        for _ in range(round(duration_s / PERIOD_S)):
            self.now_s += PERIOD_S
            if text:
                self.jog.hear(text, self.now_s)
            self.jog.step(self.state, self.now_s)

    def couple(self) -> None:
        self.state = replace(
            self.state, robot=structs.replace(ROBOT_IN, mode=ControlMode.DIRECT), recording=False
        )

    @property
    def phases(self) -> list[str]:
        return [phase for phase, _ in self.drags]


@pytest.fixture
def hand(nothing_yet: ConsoleState) -> Hand:
    return Hand(nothing_yet)


def test_while_nothing_is_recorded_or_driven_it_moves_nothing(hand: Hand) -> None:
    hand.wait(1.0, RIGHT)
    assert hand.drags == []


def test_driving_begins_at_the_robot_and_goes_no_faster_than_its_limit(hand: Hand) -> None:
    hand.couple()
    hand.wait(0.5, RIGHT)
    places = np.array([at_m for _, at_m in hand.drags])
    assert hand.phases[0] == "start" and set(hand.phases[1:]) == {"update"}
    assert hand.drags[0][1] == ROBOT_IN.position_m
    np.testing.assert_allclose(np.diff(places, axis=0)[:, 0], FASTEST_M_S * PERIOD_S, atol=1e-9)
    assert np.ptp(places[:, 1]) == 0.0


@pytest.mark.parametrize("line", ["", "a;0,0,0;0;0.00,0.00,0.00;2"])
def test_released_or_silent_it_lets_go(hand: Hand, line: str) -> None:
    hand.couple()
    hand.wait(0.2, RIGHT)
    hand.wait(SILENT_S + 0.1, line)
    assert hand.phases.count("end") == 1
    assert hand.phases[-1] == "end"


def test_it_never_leaves_the_board(hand: Hand) -> None:
    hand.state = replace(hand.state, recording=True)
    hand.wait(6.0, RIGHT)
    assert max(at_m[0] for _, at_m in hand.drags) == 1.0


def test_what_drew_drives_only_once_it_was_let_go(hand: Hand) -> None:
    hand.state = replace(hand.state, recording=True)
    hand.wait(0.2, RIGHT)
    hand.couple()
    hand.wait(0.5, RIGHT)
    assert hand.phases[-1] == "end"
    hand.wait(0.1, "a;0,0,0;0;0.00,0.00,0.00;2")
    hand.wait(0.2, RIGHT)
    assert hand.phases[-1] == "update"
