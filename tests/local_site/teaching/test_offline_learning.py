from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from farhand.common.errors import InvalidDemonstration
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import default_settings, extent_m, learn, learn_files
from tests.strategies import stroke


def strokes(n: int = 3, size: float = 1.0) -> list[Demonstration]:
    rng = np.random.default_rng(0)
    return [
        Demonstration(
            time_s=0.02 * np.arange(120.0),
            position_m=size * stroke(rng, 2, 120) + [5.0, -3.0],
            frame_origin_m=np.array([[5.0, -3.0]]),
            frame_rotation=np.eye(2)[None],
            frame_names=("goal",),
        )
        for _ in range(n)
    ]


def test_files_teach_what_the_online_learner_learns(tmp_path: Path):
    made, paths = strokes(), [tmp_path / f"{i}.npz" for i in range(3)]
    for path, demonstration in zip(paths, made, strict=True):
        demonstration.save(path)
    settings = LearnerSettings(0.2)
    learner = OnlineLearner(settings, 2, ["goal"])
    for demonstration in made:
        learner.start()
        for t, point in enumerate(demonstration.position_m):
            learner.observe(point, demonstration.frames_at(t), float(demonstration.time_s[t]))
        learner.end()
    assert learn_files(paths, settings) == learner.model()


def test_lambda_follows_the_size_of_the_demonstrations():
    small, large = strokes(size=0.05), strokes(size=20.0)
    assert extent_m(large) == pytest.approx(400.0 * extent_m(small))
    assert default_settings(small).max_distance_m == pytest.approx(0.25 * extent_m(small))
    # the same motion at another scale has the same structure
    np.testing.assert_array_equal(learn(small).counts, learn(large).counts)


def test_one_bad_file_stops_all_and_is_named(tmp_path: Path):
    strokes()[0].save(tmp_path / "good.npz")
    (tmp_path / "bad.npz").write_bytes(b"nothing")
    with pytest.raises(InvalidDemonstration, match=r"bad\.npz"):
        learn_files([tmp_path / "good.npz", tmp_path / "bad.npz"])


def test_files_that_do_not_belong_together_are_named(tmp_path: Path):
    first = strokes()[0]
    first.save(tmp_path / "first.npz")
    replace(first, frame_names=("valve",)).save(tmp_path / "valve.npz")
    solid = replace(
        first,
        position_m=np.pad(first.position_m, ((0, 0), (0, 1))),
        frame_origin_m=np.zeros((1, 3)),
        frame_rotation=np.eye(3)[None],
    )
    solid.save(tmp_path / "solid.npz")
    for name, field in (("valve", "frame_names"), ("solid", "position_m")):
        with pytest.raises(InvalidDemonstration, match=rf"{name}\.npz: {field}"):
            learn_files([tmp_path / "first.npz", tmp_path / f"{name}.npz"])
    with pytest.raises(InvalidDemonstration, match="demonstration 2"):
        learn([first, solid])


def test_nothing_to_learn_from_is_said():
    with pytest.raises(InvalidDemonstration, match="one or more"):
        learn_files([])
    still = replace(strokes(1)[0], position_m=np.zeros((120, 2)))
    with pytest.raises(InvalidDemonstration, match="nothing moved"):
        learn([still])
