"""State of the simulated robot on disk, so that a restarted remote site finds the robot where it was.

A thread of its own writes the state 20 times a second, each time as a whole new file, so that a crash during
a write leaves the previous state.
"""

from __future__ import annotations

import contextlib
import math
import threading
from pathlib import Path

import msgspec
import numpy as np
from msgspec import Struct

from farhand.common.errors import InvalidConfiguration
from farhand.common.event_loop import Mailbox
from farhand.common.log import loop_logger
from farhand.common.model.manifold import UNIT_TOLERANCE
from farhand.common.whole_file import fault_of, read_whole
from farhand.common.wire.reasons import Code, Reason, because
from farhand.remote_site.interface.embodiment import ArmMemory
from farhand.remote_site.interface.sensing import Sensing
from farhand.remote_site.motion.motion import Motion

_log = loop_logger(__name__)

PERIOD_S = 0.05
_FAR = 1e6
"""Limit of plausible numbers [m, rad, s, N]."""
_STILL = 2e-5
"""Smallest change that is written [m, rad, s, N]."""


class PlantState(Struct, frozen=True, forbid_unknown_fields=True):
    """Stored state of a robot.

    Args:
        position_m: Position of the effector. Length D [m].
        executing: Hash of the model in execution that had not arrived, empty for none.
        arm: State of an arm beyond that.
    """

    position_m: tuple[float, ...]
    executing: str = ""
    arm: ArmMemory | None = None

    @classmethod
    def of(cls, sensing: Sensing, motion: Motion) -> PlantState:
        """Return the present state."""
        execution = motion.execution
        under_way = execution is not None and execution.arrived_after_s is None
        return cls(
            tuple(sensing.effector.position_m.tolist()),
            execution.stored.sha256 if execution is not None and under_way else "",
            motion.embodiment.world.memory(motion.embodiment.skill.task),
        )

    def is_like(self, other: PlantState | None) -> bool:
        """Decide whether another state differs from this one by less than `_STILL`."""
        if other is None or (self.executing, self.arm is None) != (other.executing, other.arm is None):
            return False
        return np.allclose(self._numbers(), other._numbers(), rtol=0.0, atol=_STILL)

    def check(self) -> None:
        """Check that this state is possible.

        Raises:
            InvalidConfiguration: When a number is not finite or too large, or a pose is not one.
        """
        if not all(abs(number) < _FAR for number in self._numbers()):
            raise InvalidConfiguration("state", "", f"numbers below {_FAR:g}")
        if self.arm is not None and abs(math.hypot(*self.arm.receptacle[3:]) - 1.0) > UNIT_TOLERANCE:
            raise InvalidConfiguration("state", "arm.receptacle", "a unit quaternion after the position")

    def _numbers(self) -> list[float]:
        arm = () if self.arm is None else msgspec.structs.astuple(self.arm)
        return np.hstack([self.position_m, *arm]).tolist()


class PlantMemory:
    """File of the state.

    Args:
        path: Path of the file; its folder is made.
    """

    def __init__(self, path: Path):
        self._path = path
        self.error: OSError | None = None
        """Reason why the newest state could not be written; None if it was."""
        self.unknown_place: Reason | None = None
        """Reason why `load` found no state although one was stored, for the operator."""
        self._box: Mailbox[PlantState | None] = Mailbox()
        self._wanted = threading.Event()
        self._closed = False
        self._newest: PlantState | None = None
        self._place_lost = False
        self._thread = threading.Thread(target=self._run, name="plant memory", daemon=True)
        self._thread.start()

    def load(self, n_dims: int) -> PlantState | None:
        """Return the state stored by this process or an earlier one, or None when none fits."""
        if self._newest is not None:
            return self._newest
        if self._place_lost or not self._path.exists():
            if self._place_lost or self._stale.exists():
                self.unknown_place = because(Code.PLACE_NOT_KEPT)
            return None
        try:
            with fault_of(self._path, InvalidConfiguration, "the state of a robot"):
                state = msgspec.json.decode(read_whole(self._path), type=PlantState)
                state.check()
        except InvalidConfiguration as error:
            aside = self._path.with_suffix(".unreadable")
            with contextlib.suppress(OSError):
                self._path.replace(aside)
            words = "%s is not understood and kept as %s, the robot starts anew: %s"
            _log.warning(words, self._path, aside.name, error.expected)
            self.unknown_place = because(Code.PLACE_NOT_UNDERSTOOD, file=aside.name)
            return None
        return state if len(state.position_m) == n_dims else None

    @property
    def _stale(self) -> Path:
        return self._path.with_suffix(".stale")

    def remember(self, state: PlantState) -> None:
        """Queue a state for writing, unless it is unchanged. Never blocks.

        After an impossible state, as from a broken sensor, the place counts as unknown: such a state could not be read again.
        """
        try:
            state.check()
        except InvalidConfiguration:
            is_news = not self._place_lost
            self._newest, self._place_lost = None, True
        else:
            is_news = not state.is_like(self._newest)
            self._place_lost = False
            self._newest = state if is_news else self._newest
        if is_news:
            self._box.put(self._newest)
            self._wanted.set()

    def close(self) -> None:
        """Write the waiting state, and end the thread."""
        self._closed = True
        self._wanted.set()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        closed = False
        while not closed:
            self._wanted.wait()
            self._wanted.clear()
            closed = self._closed  # read first, so that a state put before the end is written
            for state in self._box.take_all():
                try:
                    self._write(state)
                    self.error = None
                except OSError as error:
                    self.error = error
                    self._set_aside()
                    _log.warning(
                        "the robot's state could not be written to %s: %s", self._path, error.strerror
                    )

    def _write(self, state: PlantState | None) -> None:
        if state is None:
            self._set_aside()
            return
        self._path.parent.mkdir(parents=True, exist_ok=True)
        new = self._path.with_suffix(".new")
        new.write_bytes(msgspec.json.encode(state))
        new.replace(self._path)

    def _set_aside(self) -> None:
        """Keep the file under another name, which says that the place is not known: an older state would now be false."""
        with contextlib.suppress(OSError):
            self._stale.parent.mkdir(parents=True, exist_ok=True)
            self._stale.touch()
            self._path.replace(self._stale)
