"""Robot's half of the page: it shows the present, or a moment of this session that the operator looks at."""

from __future__ import annotations

import viser

from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.history import History, as_it_was
from farhand.local_site.view.panels.choices import Act
from farhand.local_site.view.panels.looking_back import LookingBack
from farhand.local_site.view.panels.preview_player import PreviewPlayer
from farhand.local_site.view.panels.timeline import Timeline
from farhand.local_site.view.scene.ghost import PredictionCheck, RobotPicture, predict, preview_miss


class RobotHalf:
    """History of the robot with its timeline, and what is shown of it. Used by the page's thread.

    Args:
        gui: GUI of the server.
        act: Has a tab's action done, from the server's thread; only enqueues.
    """

    def __init__(self, gui: viser.GuiApi, act: Act):
        self._history, self._timeline = History(), Timeline(gui)
        self._back, self._player = LookingBack(gui, act), PreviewPlayer(gui, act)
        self._check = PredictionCheck()

    @property
    def plays(self) -> bool:
        """True while a preview is played: it moves on its own."""
        return self._player.plays

    def note(self, state: ConsoleState, now_s: float) -> None:
        """Keep what is known of the robot, whether it is drawn or not."""
        self._history.note(state, now_s)

    def draw(self, state: ConsoleState, now_s: float) -> RobotPicture:
        """Draw the timeline; return what the scene shows of the robot."""
        look, then = self._back.draw(state, self._history, now_s)
        self._timeline.draw(self._history, look, state.task.limits.force_n, now_s)
        ghost = None if state.phase.at_end else predict(state, now_s)
        self._check.update(state.robot, ghost)
        trace = self._history.trace(then or self._history.newest)
        played = self._player.draw(state if then is None else None, now_s)
        if then is not None:
            return RobotPicture(as_it_was(state, then), now_s, then.time_s, trace)
        return RobotPicture(
            state, now_s, None, trace, ghost, self._check.error_m, played, preview_miss(state)
        )
