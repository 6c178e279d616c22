from __future__ import annotations

import numpy as np
import pytest

from farhand.common.errors import InvalidInput
from farhand.common.mode_table import Action, Phase
from farhand.common.wire.messages import Command, OperatorInput, Stamp
from farhand.common.wire.reason_words import sentence
from farhand.remote_site.interface.embodiment import Guidance
from farhand.remote_site.interface.goals import FixedGoal
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.motion.coupling import Coupling
from farhand.remote_site.motion.execution import Execution
from farhand.remote_site.motion.manoeuvre import Manoeuvre
from farhand.remote_site.motion.model_trial import StoredModel
from farhand.remote_site.motion.motion import Motion, Outcome
from farhand.remote_site.robots.point_embodiment import point_embodiment
from tests.remote_site.bench import DT_S, FeelingPlant, Sight
from tests.remote_site.planar import TASK, planar_model

COMMAND = Command(command_id="c", session="s", lease_id="l", action=Action.EXECUTE, echo=None)


class Robot:
    """A motion on a plant that notes what it is told."""

    def __init__(self) -> None:
        self.plant, self.sight, self.now_s = FeelingPlant(), Sight(TASK), 10.0
        self.sensing = Sensing(self.plant, self.sight, 1, 1.0 / DT_S, self.now_s)
        self.embodiment = point_embodiment(TASK, self.plant, self.sight)
        self.motion = Motion(self.embodiment, self.sensing)

    def step(self, n: int = 1, wait: bool = False) -> Outcome:
        outcome = Outcome.STANDING
        for _ in range(n):
            self.now_s += DT_S
            self.sensing.update(self.now_s)
            outcome = self.motion.step(Guidance(), self.now_s, DT_S, wait)
        return outcome

    def coupling(self) -> Coupling:
        coupling = Coupling(1, "l", self.now_s)
        for seq, x in enumerate((0.0, 0.5)):
            message = OperatorInput(
                seq=seq, echo=Stamp("b", 0), lease_id="l", coupling_id=1, position_m=(x, 0.0)
            )
            coupling.feed(message, self.sensing.effector.position_m, self.now_s)
        return coupling

    def execution(self) -> Execution:
        stored = StoredModel("a" * 64, planar_model(), TASK)
        settings = self.embodiment.hardware.settings
        return Execution(COMMAND, stored, settings, self.embodiment, self.sensing, Stamp("b", 0))

    def manoeuvre(self, distance_m: float = 0.1) -> Manoeuvre:
        goal = np.add(TASK.start_m, (distance_m, 0.0))
        return Manoeuvre(Phase.GOING_TO_READY, FixedGoal(goal, 0.3, 5.0))


def test_nothing_moves_a_robot_that_nothing_was_begun_on():
    robot = Robot()
    assert robot.step(10) is Outcome.STANDING
    assert set(robot.plant.told) == {"brake"}


def test_each_cause_moves_the_plant_in_its_own_way_and_ends_the_one_before():
    robot = Robot()
    for mover, told in (
        (robot.coupling(), "follow"),
        (robot.execution(), "accelerate"),
        (robot.manoeuvre(), "follow"),
    ):
        robot.motion.begin(mover)
        robot.plant.told.clear()
        robot.step(3)
        assert set(robot.plant.told) == {told}
        kinds = (robot.motion.coupling, robot.motion.execution, robot.motion.manoeuvre)
        assert [kind for kind in kinds if kind is not None] == [mover]


def test_what_was_ended_brakes_until_the_robot_stands():
    robot = Robot()
    robot.motion.begin(robot.execution())
    robot.step(40)
    robot.motion.end()
    assert robot.step() is Outcome.MOVING
    assert robot.step(50) is Outcome.STANDING


@pytest.mark.parametrize("way", ["pause", "wait"])
def test_an_execution_that_stood_still_finds_its_place_anew(way: str, monkeypatch: pytest.MonkeyPatch):
    robot, resumed = Robot(), []
    execution = robot.execution()
    monkeypatch.setattr(execution, "resume", lambda: resumed.append(True))
    robot.motion.begin(execution)
    robot.step(30)
    assert not resumed
    robot.motion.paused = way == "pause"
    assert robot.step(60, wait=way == "wait") is Outcome.STANDING
    robot.motion.paused = False
    assert robot.step(2) is Outcome.UNDER_WAY
    assert len(resumed) == 1


def test_a_manoeuvre_goes_on_without_sight_and_says_once_that_it_ended():
    robot = Robot()
    robot.motion.begin(robot.manoeuvre())
    outcomes = [robot.step(wait=True) for _ in range(100)]
    assert Outcome.STANDING not in outcomes[: outcomes.index(Outcome.ENDED)]


def test_an_execution_says_once_that_it_arrived():
    robot = Robot()
    robot.motion.begin(robot.execution())
    outcomes = [robot.step() for _ in range(800)]
    first = outcomes.index(Outcome.ARRIVED)
    assert set(outcomes[:first]) == {Outcome.UNDER_WAY}
    assert set(outcomes[first + 1 :]) == {Outcome.MOVING}


@pytest.mark.parametrize("mover", [Robot.coupling, Robot.execution, Robot.manoeuvre, lambda robot: None])
@pytest.mark.parametrize("force_n", [[np.nan, 0.0], [0.0, np.inf]])
def test_a_force_that_is_not_finite_brakes_and_fails(mover, force_n):
    robot = Robot()
    if (begun := mover(robot)) is not None:
        robot.motion.begin(begun)
    robot.step(10)
    robot.plant.told.clear()
    robot.plant.force_n = np.array(force_n)
    assert robot.step() is Outcome.FAILED
    assert robot.plant.told == ["brake"]


def test_a_plant_that_fails_is_said_to_have_failed_and_why():
    robot = Robot()

    def broken(dt_s: float) -> None:
        raise InvalidInput("plant", "brake", "a plant that brakes")

    robot.plant.brake = broken
    assert robot.step() is Outcome.FAILED and "a plant that brakes" in sentence(robot.motion.failure)
