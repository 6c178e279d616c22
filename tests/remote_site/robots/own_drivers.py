"""Packages of drivers as a user installs them, made in a folder: modules with their entry points."""

from __future__ import annotations

from pathlib import Path

MODULE = '''
import time
from pathlib import Path
import numpy as np
from farhand import EffectorState, TaskFrame
from farhand.remote_site.interface.plant import PointPlant

{before}

class Plant(PointPlant):
    """A point that fails as its options say, from its hundredth reading on, or as a file of that name says, at once."""

    def __init__(self, task, options):
        limits = task.limits
        super().__init__(task.start_m, task.workspace_m, limits.speed_m_s, limits.acceleration_m_s2)
        self.fails, self.n_read, self.log = options.get("fails", ""), 0, options.get("log")
        self.trouble = Path(options.get("trouble", "/no trouble"))
        if self.fails == "made":
            raise ValueError("an unknown port")

    @property
    def fault(self):
        return "emergency stop" if self.fails == "fault" and self.n_read > 100 else ""

    def start(self):
        self.note("start")
        if self.fails == "start":
            raise OSError("no such bus")

    def read(self):
        self.n_read += 1
        state = super().read()
        if self.fails == "first reading":
            return EffectorState(np.zeros(3), np.zeros(3))
        if self.fails == "read" and self.n_read > 100:
            raise OSError("CAN bus is off")
        if self.now("nan") or (self.fails == "nan" and self.n_read > 100):
            return EffectorState(state.point * np.nan, state.velocity)
        return state

    def accelerate(self, acceleration, dt_s):
        if self.now("accelerate"):
            raise OSError("drive 2 does not answer")
        if self.now("stands"):
            self._velocity = np.zeros(2)
            return
        if self.now("late"):
            self.trouble.unlink()
            time.sleep(0.6)
        super().accelerate(acceleration, dt_s)

    def now(self, what):
        return self.trouble.exists() and self.trouble.read_text() == what

    def halt(self):
        self.note("halt")

    def close(self):
        self.note("close")
        if self.fails == "close":
            raise OSError("it does not close")

    def note(self, word):
        if self.log:
            with open(self.log, "a") as file:
                file.write(word + "\\n")


class Sight:
    def __init__(self, task, options):
        self.n = options.get("n", 1)

    def observe(self, now_s):
        return [TaskFrame(np.eye(2), np.array([0.6, 0.35]))] * self.n


class Nothing:
    def __init__(self, task, options):
        pass
'''


def put_drivers(folder: Path, module: str, before: str = "") -> None:
    """Put a package into a folder: the plants `MODULE` and `MODULE-nothing`, and the perception `MODULE`."""
    (folder / f"{module}.py").write_text(MODULE.format(before=before))
    about = folder / f"{module}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(
        f"[farhand.plants]\n{module} = {module}:Plant\n{module}-nothing = {module}:Nothing\n"
        f"[farhand.perceptions]\n{module} = {module}:Sight\n"
    )
