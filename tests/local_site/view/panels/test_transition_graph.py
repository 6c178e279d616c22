"""What the graph of a learned model shows."""

from __future__ import annotations

import re

import numpy as np
import pytest

from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.view.panels.charts import graph_svg, node_places

_DURATION = re.compile(r'<text x="([\d.]+)" y="([\d.]+)" class="fh-duration">([^<]*)</text>')
_CHARACTER_PX = 6.3


def learned(duration_s: float, n_points: int = 120) -> TPHSMM:
    """From a quarter of a circle, shown in so much time, twice."""
    learner = OnlineLearner(LearnerSettings(max_distance_m=0.1), 2)
    for slower in (1.0, 1.4):
        learner.start()
        angle = np.linspace(0.0, np.pi / 2, n_points)
        points = np.column_stack([np.cos(angle), np.sin(angle)])
        times_s = np.linspace(0.0, slower * duration_s, n_points)
        learner.observe_many(points, [TaskFrame.identity(2)], times_s)
        learner.end()
    return learner.model()


@pytest.mark.parametrize("duration_s", [3.0, 90.0, 2000.0])
def test_no_duration_is_wider_than_the_room_between_two_components(duration_s: float) -> None:
    model = learned(duration_s)
    labels = [(float(x), float(y), words) for x, y, words in _DURATION.findall(graph_svg(model, -1)) if words]
    assert len(labels) == model.n_components >= 4
    for k, (x, y, words) in enumerate(labels):
        for other_x, other_y, other_words in labels[k + 1 :]:
            apart = abs(x - other_x) - 0.5 * _CHARACTER_PX * (len(words) + len(other_words))
            assert apart > 0.0 or abs(y - other_y) >= 12.0, (words, other_words)


def test_components_are_drawn_apart_and_the_last_one_is_named_the_end() -> None:
    model = learned(5.0)
    places = node_places(model)
    assert places.shape == (model.n_components, 2)
    distances = np.linalg.norm(places[:, None] - places, axis=-1)[~np.eye(len(places), dtype=bool)]
    assert distances.min() > 26.0
    assert graph_svg(model, -1).count(">end<") == int(model.terminal.sum()) == 1
