"""Tables at the foot of the page: the demonstrations of the present revision, and the robot's executions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser

from farhand.common.task import AnyTask
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.console.executions import Executions, ReportedExecution
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.goal import goal_miss
from farhand.local_site.view.panels.html import Html, clock, element, text, wall_start_s
from farhand.local_site.view.panels.words.controls import (
    AT_THE_GOAL,
    DEMONSTRATION_HEAD,
    EXECUTION_HEAD,
    NO_EXECUTION,
    NO_REVISION,
    THIS_PAGE,
)
from farhand.local_site.view.panels.words.lists import (
    at_the_end,
    count_words,
    model_name,
    number_words,
    outcome_words,
)


class DemonstrationList:
    """Table of the demonstrations of the present revision: whence each is, how long it took, and how it ended.

    Args:
        gui: GUI of the server.
    """

    def __init__(self, gui: viser.GuiApi):
        self._html = Html(gui)
        self._shown: tuple[object, ...] | None = None

    def draw(self, state: ConsoleState, hidden: frozenset[str]) -> None:
        """Show the demonstrations, the newest last.

        Args:
            state: Present state of the console.
            hidden: Names of the demonstrations that are not drawn in the scene.
        """
        away = [name in hidden for name in state.demonstration_names]
        if self._shown == (shown := (state.task.name, *map(id, state.demonstrations), *away)):
            return
        self._shown = shown
        numbers = [number_words(*each) for each in enumerate(away, 1)]
        rows = [_row(*each, state.task) for each in zip(numbers, state.demonstrations, strict=True)]
        head = DEMONSTRATION_HEAD
        self._html.show(_table("demonstrations", head, rows, NO_REVISION))


class ExecutionList:
    """Table of the executions that the robot has told of, the newest first.

    Args:
        gui: GUI of the server.
    """

    def __init__(self, gui: viser.GuiApi):
        self._html = Html(gui)
        self._wall_s = wall_start_s()
        """The console's clock in wall time, for people."""
        self._shown: Executions | None = None

    def draw(self, state: ConsoleState) -> None:
        """Show the executions."""
        if self._shown is state.executions:
            return
        self._shown = state.executions
        rows = [self._row(each, newest=number == 0) for number, each in enumerate(state.executions.newest)]
        count = element("executions-count", count_words(state.executions))
        head = (*EXECUTION_HEAD, count)
        self._html.show(_table("executions", head, rows, NO_EXECUTION))

    def _row(self, each: ReportedExecution, newest: bool) -> str:
        kind = "fh-reached" if each.reached_end else "fh-bad" if each.ended is not None else ""
        outcome = element("outcome", outcome_words(each, newest), kind)
        report = each.report
        force_n = report.peak_force_n if report is not None else None
        model = text(model_name(each.model))
        return _cells(
            clock(self._wall_s + each.began_s),
            text(each.task),
            f'<span title="{model}">{each.revision or model}</span>',
            "" if each.took_s is None else f"{each.took_s:.1f} s",
            "" if force_n is None else f"{force_n:.0f} N",
            "" if report is None else text(at_the_end(report)),
            outcome,
        )


def _row(number: str, made: Demonstration, task: AnyTask) -> str:
    length_m = float(np.linalg.norm(np.diff(made.position_m, axis=0), axis=1).sum())
    miss = goal_miss(task, made.frames_at(-1)[-1].to_local(made.points[-1]))
    kind, end = ("fh-bad", miss) if miss else ("", AT_THE_GOAL)
    return _cells(
        number,
        text((made.source or THIS_PAGE)[:40]),
        f"{made.time_s[-1] - made.time_s[0]:.1f} s",
        f"{1e3 * length_m:.0f} mm",
        f'<span class="{kind}">{text(end)}</span>',
    )


def _cells(*contents: str) -> str:
    """Return a row of cells with these contents, which are HTML."""
    return f"<tr>{''.join(f'<td>{each}</td>' for each in contents)}</tr>"


def _table(name: str, head: Sequence[str], rows: Sequence[str], empty: str) -> str:
    """Return the content of a tab: a table, or words where it would be empty."""
    titles = "".join(f"<th>{each}</th>" for each in head)
    table = (
        f"<table><tr>{titles}</tr>{''.join(rows)}</table>" if rows else f'<div class="fh-empty">{empty}</div>'
    )
    return f'<div class="fh-lower" data-tab="{name}" data-tp="{name}"><div class="fh-list" tabindex="0" role="region" aria-label="{name}">{table}</div></div>'
