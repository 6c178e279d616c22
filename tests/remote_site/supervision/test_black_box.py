from __future__ import annotations

from typing import Any

from farhand.common.mode_table import ControlMode
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.motion.motion import Motion
from farhand.remote_site.robots.point_embodiment import point_embodiment
from farhand.remote_site.supervision.failsafe import BlackBox
from tests.remote_site.bench import Bench, FeelingPlant, Sight
from tests.remote_site.planar import TASK

HZ = 50.0


def test_it_keeps_the_last_five_seconds_and_begins_anew_after_each_dump():
    plant, sight, rows = FeelingPlant(), Sight(TASK), list[dict[str, Any]]()
    sensing = Sensing(plant, sight, 1, HZ, 0.0)
    motion = Motion(point_embodiment(TASK, plant, sight), sensing)
    box = BlackBox(sensing, motion, HZ, lambda **fields: rows.append(fields))
    for tick in range(1000):
        box.remember(tick / HZ, ControlMode.HOLD)
    box.dump()
    assert [rows[0]["t_s"], rows[-1]["t_s"], len(rows)] == [15.0, 999 / HZ, 250]
    assert rows[-1]["position_m"] == list(TASK.start_m) and rows[-1]["mode"] == "hold"
    box.dump()
    assert len(rows) == 250


def test_a_dump_tells_which_component_or_way_was_executed():
    bench = Bench().executing()
    bench.robot.tick(0.02, late_s=1.0)
    rows = [row for row in bench.written if row["kind"] == "black box"]
    assert rows[0]["component"] == -1 and (rows[-1]["component"] >= 0 or rows[-1]["way"] >= 0)
