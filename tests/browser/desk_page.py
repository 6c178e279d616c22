"""The page on a console whose robot is played by the test: what reaches the robot is known, and nothing is slow."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from farhand.common.impairment.link_control import RelayControl
from farhand.common.mode_table import ControlMode
from farhand.common.wire.messages import Stop
from farhand.local_site.view.page import Page
from farhand.local_site.view.page_access import PageAccess
from tests.local_site.robot_end import TASK, Desk, desk


@contextmanager
def page_of(
    data_dir: Path,
    access: PageAccess | None = None,
    port: int = 0,
    mode: ControlMode = ControlMode.DISARMED,
    control: RelayControl | None = None,
) -> Iterator[tuple[Desk, Page]]:
    """A page on a console, with the robot's end of the link."""
    with desk(data_dir) as it:
        page = Page(it.console, TASK, control, access or PageAccess(), port)
        page.start()
        try:
            yield it.connected(mode), page
        finally:
            page.close()


def await_new_stop(it: Desk, known: int) -> int:
    """Wait until the robot has heard more stops than are known; each press is one, however often it is resent."""
    while (n := len({stop.stop_id for stop in it.robot.heard(Stop)})) <= known:
        it.robot.wait_for(Stop, len(it.robot.heard(Stop)) + 1)
    return n
