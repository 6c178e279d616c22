from __future__ import annotations

import numpy as np
import pytest

from farhand.local_site.teaching.teaching_permission import NotNow
from farhand.local_site.workcell.arm_drivers import SteppedArm
from farhand.local_site.workcell.workcell import BoardWorkcell, make_workcell
from tests.cells import JACO
from tests.local_site.robot_end import FRAMES, HOT_STAB, TASK


def test_on_a_board_the_hand_itself_makes_the_motion():
    board, moved = BoardWorkcell(TASK), []
    board.start(lambda job: job(), lambda points, times_s: moved.append((points, times_s)))
    board.hand((0.1, 0.2), 3.0, released=False)
    ((points, times_s),) = moved
    assert points.tolist() == [[0.1, 0.2]] and times_s.tolist() == [3.0]
    np.testing.assert_array_equal(board.frames[0].b, FRAMES[0].b)
    assert board.view is None and len(board.samples()) == len(TASK.samples)
    with pytest.raises(NotNow, match="one place for its frames"):
        board.reset(None)


def test_each_kind_of_task_has_its_place():
    assert isinstance(make_workcell(TASK), BoardWorkcell)
    assert isinstance(make_workcell(HOT_STAB, JACO, stepped=True), SteppedArm)
