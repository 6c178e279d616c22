"""A robot behind real ROS 2 topics, played by a process of its own, and an operator of Farhand's robot site."""

from __future__ import annotations

import json
import os
import queue
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from farhand.common.mode_table import Action, ControlMode, Phase
from farhand.common.model.model_file import content_hash, encode
from farhand.common.wire import keys
from farhand.common.wire.codec import decode
from farhand.common.wire.messages import CommandReply, ModelReply, ModelTransfer, PlannedPath
from farhand.deploy.entry import own_command
from tests.remote_site.arm_bench import hot_stab_model
from tests.robustness.raw_operator import SESSION, RawOperator

ROS_PYTHON = Path(sys.prefix) / "ros" / "bin" / "python"
FARHAND = (str(ROS_PYTHON), *own_command()[1:])
PATIENCE_S = 60.0
TASK = "hot-stab"


def free_domain() -> int:
    """A ROS domain in which nobody is: the first participant's port (7410 + 250 of each) is free."""
    for domain in range(1 + os.getpid() % 50, 101):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("127.0.0.1", 7410 + 250 * domain))
            except OSError:
                continue
            return domain
    raise AssertionError("every ROS domain is taken")


class Robot:
    """The process of the simulated robot, which answers words."""

    def __init__(self, environment: dict[str, str]):
        self._process = subprocess.Popen(
            [str(ROS_PYTHON), "-P", "-m", "farhand_ros2.simulated_robot", "--seed", "3"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env={**os.environ, **environment},
        )  # fmt: skip
        self._answers: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=self._listen, daemon=True).start()
        assert json.loads(self._answers.get(timeout=PATIENCE_S)) == {"ready": True}

    def ask(self, word: str) -> dict[str, Any]:
        self._tell(word)
        return json.loads(self._answers.get(timeout=PATIENCE_S))

    def until(self, holds: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Ask for the truth until something holds."""
        truth = self.ask("truth")
        for _ in range(2000):
            if holds(truth):
                return truth
            truth = self.ask("truth")  # its answer takes a control period
        raise AssertionError(truth)

    def end(self) -> int:
        self._tell("quit")
        return self._process.wait(PATIENCE_S)

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()

    def _tell(self, word: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(word + "\n")
        self._process.stdin.flush()

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._answers.put(line)
        self._answers.put("null")


def moves(truth: dict[str, Any]) -> bool:
    return truth["fastest_rad_s"] > 0.02


def stands(truth: dict[str, Any]) -> bool:
    return truth["fastest_rad_s"] < 0.005


class Operator(RawOperator):
    """An operator of the robot's arm, who does again what a busy machine has halted."""

    def __init__(self, endpoint: str):
        super().__init__(endpoint)
        self._plans: queue.SimpleQueue[int] = queue.SimpleQueue()
        self.link.subscribe(keys.PATH, lambda data: self._plans.put(decode(data, PlannedPath).plan_id))

    def send_model(self) -> str:
        content = encode(hot_stab_model())
        sha256 = content_hash(content)
        sent = ModelTransfer(session=SESSION, task=TASK, sha256=sha256, content=content)
        reply = self.ask(keys.MODEL, sent, ModelReply)
        assert reply.accepted, reply.reason
        return sha256

    def do(self, action: Action, **fields: Any) -> CommandReply:
        return self.command(action, task=TASK, **fields)

    def hold(self) -> None:
        """Whatever halted it: armed, at rest."""
        way = {ControlMode.STOPPED: Action.RESET, ControlMode.DISARMED: Action.ARM}
        for _ in range(500):
            mode = self.report().mode
            if mode is ControlMode.HOLD:
                return
            self.do(way.get(mode, Action.ABORT))
        raise AssertionError(self.report())

    def insert(self, sha256: str) -> None:
        """Preview and execute until the robot says that the plug is seated; it is refused until the tracker sees."""
        for _ in range(500):
            self.hold()
            if not self.do(Action.PREVIEW, model_sha256=sha256).accepted:
                continue
            while not (plan_id := self._plans.get(timeout=PATIENCE_S)):
                pass  # the path of an execution, which nobody asked for
            if self.do(Action.EXECUTE, model_sha256=sha256, plan_id=plan_id).accepted:
                self.report(lambda told: told.mode in (ControlMode.AUTONOMOUS, ControlMode.STOPPED))
                ends = self.report(lambda told: told.mode is not ControlMode.AUTONOMOUS or told.phase.at_end)
                if ends.phase is Phase.SEATED:
                    return
        raise AssertionError(self.report())

    def retract(self, robot: Robot) -> None:
        """Retract until the robot moves."""
        for _ in range(500):
            report = self.report()
            if report.phase is Phase.RETRACTING and moves(robot.ask("truth")):
                return
            if report.phase.at_end or report.mode is ControlMode.HOLD:
                self.do(Action.RETRACT)
            elif report.mode is not ControlMode.AUTONOMOUS:
                self.hold()
        raise AssertionError(self.report())
