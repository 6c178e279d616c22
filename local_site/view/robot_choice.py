"""Row with the robots at the hub: the one of this page, and links to the pages of the others, with the mode of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import viser

from farhand.common.link.fleet import RobotAtHub
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels.html import Html, element
from farhand.local_site.view.panels.words.status import PAGE_OF, SHOWN_ROBOT, robot_words


@dataclass(frozen=True)
class RobotsAtHub:
    """Robots of one operator at a hub.

    Args:
        shown: Name of the robot of this page.
        addresses: Address of each robot's page.
        states: Returns the state of each robot.
    """

    shown: str
    addresses: Mapping[str, str]
    states: Callable[[], Sequence[RobotAtHub]]


class RobotChoice:
    """Row of links. Used by the page's thread.

    Args:
        gui: GUI of the server.
        robots: Robots at the hub; None for a single robot, which needs no row.
    """

    def __init__(self, gui: viser.GuiApi, robots: RobotsAtHub | None):
        self._html, self._robots = Html(gui) if robots is not None else None, robots

    def draw(self, _state: ConsoleState) -> None:
        """Show the present state of each robot."""
        if self._html is not None and (robots := self._robots) is not None:
            links = "".join(_link(robots, state) for state in robots.states())
            self._html.show(f'<div class="fh-robots" role="navigation" aria-label="Robots">{links}</div>')


def _link(robots: RobotsAtHub, state: RobotAtHub) -> str:
    name = f"robot-{state.name}"
    if state.name == robots.shown:
        return element(name, state.name, "fh-robot fh-robot-shown", "b", title=SHOWN_ROBOT)
    words, kind = robot_words(state)
    return element(
        name, f"{state.name} {words}", f"fh-robot {kind}", "a",
        href=robots.addresses[state.name], title=PAGE_OF.format(name=state.name),
    )  # fmt: skip
