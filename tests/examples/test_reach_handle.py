from __future__ import annotations

from pathlib import Path

import numpy as np

from examples.reach_handle.reach_handle import learn, learn_from_each_frame, main, reach
from farhand.common.model.model_file import encode
from farhand.evaluation.paper.handle_task import random_scene

MODEL, SHOWN = learn(np.random.default_rng(1))


def test_the_handle_is_reached_where_it_never_was_and_while_it_drifts_away():
    scene = random_scene(np.random.default_rng(2))
    for drift_m_s in (0.0, 0.03):
        motion = reach(MODEL, scene, drift_m_s)
        handle = scene.handle.b + drift_m_s * motion.time_s[-1] * scene.handle.A[:, 0]
        assert motion.arrived
        assert np.linalg.norm(motion.position_m[-1] - handle) < 0.02


def test_both_ways_to_teach_give_the_same_model():
    same = learn_from_each_frame(SHOWN)
    np.testing.assert_allclose(same.means, MODEL.means, atol=1e-9)
    np.testing.assert_array_equal(same.transition, MODEL.transition)
    assert len(encode(same)) == len(encode(MODEL))


def test_the_example_draws_its_picture(tmp_path: Path):
    main(tmp_path / "picture.png")
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
