"""ROS 2 node with a thread of its own; whatever goes wrong in it is told as a fault, and ends nothing."""

# rclpy and the messages come from a ROS installation, or from the wheels of an environment of their own.
# pyright: reportMissingImports=false

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable
from typing import Any, Generic, TypeVar

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from .options import NodeOptions

T = TypeVar("T")

_TURN_S = 0.1
_CLOSE_S = 5.0


class Topic(Generic[T]):
    """Topic that is listened to, with the newest of its messages.

    Args:
        name: Name of the topic.
        convert: Converts a message; None for a message about something else. What it raises is the topic's fault.
    """

    def __init__(self, name: str, convert: Callable[[Any], T | None]):
        self.name, self._convert = name, convert
        self.newest: T | None = None
        """The newest message, converted; None before the first one."""
        self.complaint = ""
        """Reason why the newest message cannot be used; empty if it can."""
        self._arrived_s = time.monotonic()

    def take(self, message: Any) -> None:
        """Take a message, in the node's thread."""
        try:
            taken = self._convert(message)
        except Exception as error:
            self.complaint = f"{self.name}: {error}"
            return
        if taken is not None:
            self.newest, self.complaint, self._arrived_s = taken, "", time.monotonic()

    def fault(self, silent_s: float) -> str:
        """Return the fault in words: a message that cannot be used, or silence for longer than this [s]."""
        if not self.complaint and time.monotonic() - self._arrived_s > silent_s:
            return f"{self.name}: silent for {silent_s:g} s"
        return self.complaint


class RosNode:
    """Node in a context of its own: publishers, subscriptions and timers, served by one thread.

    Args:
        name: Name of the node.
        options: Domain, and reliability of the subscriptions.
    """

    def __init__(self, name: str, options: NodeOptions):
        self._context = Context()
        # Signals and the command line are the host process's.
        rclpy.init(
            args=[],
            context=self._context,
            domain_id=options.domain_id,
            signal_handler_options=SignalHandlerOptions.NO,
        )
        self._node = Node(
            name,
            context=self._context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._reliability = (
            ReliabilityPolicy.RELIABLE if options.reliability == "reliable" else ReliabilityPolicy.BEST_EFFORT
        )
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._serve, name=name, daemon=True)
        self.fault = ""
        """Error that ended its thread, in words; empty while it serves."""

    def now(self) -> Any:
        """Return the present ROS time, as a header has it."""
        return self._node.get_clock().now().to_msg()

    def subscribe(self, kind: type, topic: Topic[Any], kept: bool = False) -> None:
        """Listen to a topic; every message is taken in the node's thread.

        Args:
            kind: Type of the messages.
            topic: The topic.
            kept: True for a topic whose publisher keeps its last messages for those who come later.
        """
        qos = QoSProfile(depth=10, reliability=self._reliability)
        if kept:
            qos = QoSProfile(
                depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
            )
        self._node.create_subscription(kind, topic.name, topic.take, qos)

    def publisher(self, kind: type, name: str) -> Any:
        """Return a reliable publisher, which every subscription hears."""
        return self._node.create_publisher(
            kind, name, QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
        )

    def every(self, period_s: float, do: Callable[[], None]) -> None:
        """Call a function again and again in the node's thread."""
        self._node.create_timer(period_s, do)

    def serve(self) -> None:
        """Begin to serve."""
        self._thread.start()

    def close(self) -> None:
        """End the thread, and leave the domain; bears repetition."""
        self._end.set()
        if self._thread.is_alive():
            self._thread.join(_CLOSE_S)
        if self._context.ok():
            self._executor.shutdown(timeout_sec=0.0)
            self._node.destroy_node()
            rclpy.shutdown(context=self._context)

    def _serve(self) -> None:
        try:
            while not self._end.is_set():
                self._executor.spin_once(timeout_sec=_TURN_S)
        except Exception as error:
            self.fault = f"its ROS node ended: {type(error).__name__}: {error}"


def await_all(missing: Callable[[], list[str]], patience_s: float) -> None:
    """Wait until nothing is missing.

    Args:
        missing: Returns what is missing, in words.
        patience_s: Longest wait [s].

    Raises:
        TimeoutError: When something is still missing; names it.
    """
    deadline_s = time.monotonic() + patience_s
    while still := missing():
        if time.monotonic() > deadline_s:
            raise TimeoutError(f"{'; '.join(still)} within {patience_s:g} s")
        time.sleep(0.01)


def end_asked() -> threading.Event:
    """Return an event that Ctrl-C and SIGTERM set, from the main thread of a process of its own."""
    asked = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: asked.set())
    return asked
