from __future__ import annotations

from farhand.common.mode_table import Action
from farhand.common.wire.messages import Command
from farhand.common.wire.reason_words import sentence
from farhand.remote_site.motion.plans import Previews
from farhand.remote_site.motion.preview_worker import PlanRequest, plan
from tests.remote_site.bench import Bench


class Desk:
    """Previews on a bench's own plans."""

    def __init__(self) -> None:
        self.bench = Bench().armed()
        robot = self.bench.robot
        stored = robot.models.get(self.bench.send_model().sha256)
        assert stored is not None
        self.stored = stored
        self.plans = robot.machine.previews._plans
        self.previews = Previews(self.plans)

    def begin(self, name: str) -> Command | None:
        command = Command(command_id=name, session="s", lease_id="l", action=Action.PREVIEW, echo=None)
        return self.previews.begin(command, self.stored, self.bench.robot.stamp())

    @property
    def request(self) -> PlanRequest:
        return self.bench.plan_requests[-1]

    def why_not(self, plan_id: int) -> str:
        situation = self.plans.situation(self.stored.sha256, self.bench.robot.stamp())
        return sentence(self.plans.refusal(plan_id, situation, 0.0))


def test_a_preview_waits_for_its_plan_which_can_be_executed_from_then_on():
    desk = Desk()
    assert desk.begin("one") is None
    assert desk.why_not(desk.request.plan_id)
    finished = desk.previews.finish(desk.request, plan(desk.request))
    assert finished is not None and finished.command_id == "one"
    assert not desk.why_not(desk.request.plan_id)
    assert desk.previews.finish(desk.request, plan(desk.request)) is None


def test_a_newer_preview_replaces_one_that_waits_and_the_older_plan_counts_for_nothing():
    desk = Desk()
    desk.begin("one")
    older = desk.request
    replaced = desk.begin("two")
    assert replaced is not None and replaced.command_id == "one"
    assert desk.previews.finish(older, plan(older)) is None
    assert desk.why_not(older.plan_id)
    finished = desk.previews.finish(desk.request, None)
    assert finished is not None and finished.command_id == "two"


def test_a_plan_that_could_not_be_made_cannot_be_executed():
    desk = Desk()
    desk.begin("one")
    assert desk.previews.finish(desk.request, None) is not None
    assert desk.why_not(desk.request.plan_id)


def test_the_path_of_an_execution_is_nobodys_preview():
    bench = Bench().executing()
    request = bench.plan_requests[-1]
    assert request.plan_id == 0
    assert bench.robot.machine.previews.finish(request, plan(request)) is None
