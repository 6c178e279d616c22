"""What the robot's half of the page shows: the present, or a moment of this session that the operator looks at."""

from __future__ import annotations

import viser

from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.history import History, as_it_was
from farhand.local_site.view.panels.choices import Act
from farhand.local_site.view.panels.looking_back import LookingBack
from farhand.local_site.view.panels.timeline import Timeline
from farhand.local_site.view.scene.ghost import RobotPicture


class RobotHalf:
    """History of the robot with its timeline, and what is shown of it. Used by the page's thread.

    Args:
        gui: GUI of the server.
        act: Has a tab's action done, from the server's thread; only enqueues.
    """

    def __init__(self, gui: viser.GuiApi, act: Act):
        self._history, self._timeline = History(), Timeline(gui)
        self._back = LookingBack(gui, act)

    def note(self, state: ConsoleState, now_s: float) -> None:
        """Keep what is known of the robot, whether it is drawn or not."""
        self._history.note(state, now_s)

    def draw(self, state: ConsoleState, now_s: float) -> RobotPicture:
        """Draw the timeline; return what the scene shows of the robot."""
        look, then = self._back.draw(state, self._history, now_s)
        self._timeline.draw(self._history, look, state.task.limits.force_n, now_s)
        trace = self._history.trace(then or self._history.newest)
        if then is None:
            return RobotPicture(state, now_s, trace=trace)
        return RobotPicture(as_it_was(state, then), now_s, then.time_s, trace)
