"""What the page says of a previewed plan: which way and why, and that it begins outside of what was shown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from farhand.common.model.model_file import content_hash, encode
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.way import distance_from_taught
from farhand.common.wire.messages import PlannedPath, Stamp
from farhand.common.wire.motion_encoding import packed
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.lesson import LearnedModel
from farhand.local_site.view.panels.words.advice import plan_words


def lesson(sides: tuple[float, ...]) -> LearnedModel:
    """Demonstrations to the origin, each round one side."""
    random, learner = np.random.default_rng(0), OnlineLearner(LearnerSettings(0.1), 2)
    s = np.linspace(0.0, 1.0, 150)[:, None]
    for side in sides:
        start = np.array([0.8, 0.25 * side]) + random.uniform(-0.05, 0.05, 2)
        points = (1 - s) * start + s * (1 - s) * np.array([0.0, 1.2 * side])
        learner.start()
        learner.observe_many(points, [TaskFrame.identity(2)], 0.02 * np.arange(150.0))
        learner.end()
    content = encode(learner.model())
    return LearnedModel(learner.model(), content, content_hash(content))


def planned(picture: ConsoleState, learned: LearnedModel, start: tuple[float, float]) -> ConsoleState:
    model = learned.model
    away, frame = distance_from_taught(
        model.ways, np.array(start), [TaskFrame.identity(2)], model.max_distance_m
    )
    path = PlannedPath(
        path_id=1,
        plan_id=7,
        stamp=Stamp("boot", 0),
        model_sha256=learned.sha256,
        n_coordinates=2,
        step_s=0.1,
        points=packed(np.linspace(start, (0.0, 0.0), 20)),
        reaches_end=True,
        away=away,
        away_frame=frame,
    )
    return replace(picture, learned=learned, path=path, plan_id=7)


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ((0.8, 0.25), "The plan takes way 1 of 2, the likeliest from here (3 demonstrations). "),
        ((0.8, -0.25), "The plan takes way 2 of 2, the likeliest from here (3 demonstrations). "),
    ],
)
def test_a_plan_says_which_way_it_takes(nothing_yet: ConsoleState, start: tuple[float, float], words: str):
    assert plan_words(planned(nothing_yet, lesson((1.0, -1.0) * 3), start)) == words


def test_a_plan_from_outside_of_what_was_shown_asks_for_a_demonstration(nothing_yet: ConsoleState):
    said = plan_words(planned(nothing_yet, lesson((1.0,) * 4), (-0.9, -0.8)))
    assert said.startswith("This path starts ")
    assert said.endswith("than your demonstrations: watch it first. ")


def test_of_a_plan_of_another_model_nothing_is_said(nothing_yet: ConsoleState):
    old, new = lesson((1.0,) * 3), lesson((1.0,) * 4)
    assert plan_words(replace(planned(nothing_yet, old, (0.8, 0.25)), learned=new)) == ""
