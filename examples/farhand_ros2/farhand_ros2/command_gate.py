"""A node before a velocity controller that holds its last command: it passes commands on, each for 0.1 s at most.

It belongs on the robot's machine, where it outlives Farhand's process, Farhand's machine and the network between.

    python -m farhand_ros2.command_gate
"""

# pyright: reportMissingImports=false

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from typing import Any

import tyro
from std_msgs.msg import Float64MultiArray

from .node import RosNode, Topic, end_asked
from .options import ArmOptions, NodeOptions

_WATCH_S = 0.02


@dataclass(frozen=True)
class Settings:
    """Gate before a velocity controller."""

    listen: str = "/farhand/commands"
    """Topic of the commands; Farhand's option `commands` has the same."""
    tell: str = ArmOptions().commands
    """Topic of the controller."""
    valid_s: float = 0.1
    """Time for which a command is valid; then the velocities are zero [s]."""
    domain_id: int | None = None
    """ROS domain; ROS_DOMAIN_ID when not given."""


class CommandGate:
    """Gate between Farhand and the controller. All of it runs in the node's thread.

    Args:
        settings: Topics, and how long a command is valid.
    """

    def __init__(self, settings: Settings):
        self._valid_s = settings.valid_s
        self._n, self._arrived_s = 0, 0.0
        self._node = RosNode(
            "farhand_command_gate", NodeOptions(domain_id=settings.domain_id, reliability="reliable")
        )
        self._controller = self._node.publisher(Float64MultiArray, settings.tell)
        self._node.subscribe(Float64MultiArray, Topic[bool](settings.listen, self._pass_on))
        self._node.every(_WATCH_S, self._watch)

    def run(self, end: threading.Event) -> None:
        """Serve until the end is asked for; the last command is zero."""
        self._node.serve()
        try:
            while not end.wait(_WATCH_S):
                if self._node.fault:
                    raise RuntimeError(self._node.fault)
        finally:
            self._stand()
            self._node.close()

    def _pass_on(self, command: Any) -> bool:
        self._n, self._arrived_s = len(command.data), time.monotonic()
        self._controller.publish(command)
        return True

    def _watch(self) -> None:
        if time.monotonic() - self._arrived_s > self._valid_s:
            self._stand()

    def _stand(self) -> None:
        if self._n:  # before the first command nobody knows how many joints there are
            self._controller.publish(Float64MultiArray(data=[0.0] * self._n))


def main() -> None:
    """Run the gate until Ctrl-C."""
    CommandGate(tyro.cli(Settings, description=__doc__)).run(end_asked())


if __name__ == "__main__":
    main()
