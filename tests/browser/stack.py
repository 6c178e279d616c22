"""A real `farhand up` for the browser tests: both sites, the link and the page."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from farhand.common.address import free_port
from farhand.evaluation.harness.farhand_process import HeardProcess
from tests.farhand_process import running

_STILL = ((r"amplitude_m = .*", "amplitude_m = [0.0, 0.0]"), (r"noise_std_m = .*", "noise_std_m = 0.0"))
_TASKS = Path(__file__).parents[2] / "deploy" / "tasks"


@dataclass(frozen=True)
class Stack:
    """One that runs.

    Args:
        process: The `farhand up`.
        address: Of the page.
        data_dir: Where demonstrations and models go.
    """

    process: HeardProcess
    address: str
    data_dir: Path

    @property
    def model_file(self) -> Path:
        """The newest model on disk."""
        return self.data_dir / "planar" / "newest.farhand"

    def kill(self, role: str) -> None:
        """End the `local`, `remote` or `link` process without warning."""
        os.kill(self.process.children()[role], signal.SIGKILL)


@contextmanager
def farhand_up(data_dir: Path, link: str = "lan", task: str | Path = "planar", *more: str) -> Iterator[Stack]:
    """All of it on free ports, until the end of the block."""
    port = free_port()
    arguments = (f"--task={task}", f"--link={link}", f"--port={port}", f"--data-dir={data_dir}", *more)
    with running("up", *arguments) as process:
        process.until("all three are ready")
        yield Stack(process, f"http://127.0.0.1:{port}", data_dir)
        if process.running:
            process.send(signal.SIGINT)
            process.wait()


def still_task(folder: Path) -> Path:
    """The planar task with a U that stands still: a browser that draws in software is slow while it moves."""
    return _variant(folder, "planar", *_STILL)


def other_still_task(folder: Path) -> Path:
    """Another task of the robot with the still U: its components may be further apart."""
    changes = (r'name = "planar"', 'name = "other"'), (r"max_distance_m = .*", "max_distance_m = 0.3")
    return _variant(folder, "planar", *_STILL, *changes, name="other")


def slow_task(folder: Path) -> Path:
    """The still task taught by a slow hand, so that a picture can be taken before the robot arrives."""
    return _variant(folder, "planar", *_STILL, (r"duration_s = (\d)", r"duration_s = 2\1"))


def swaying_task(folder: Path) -> Path:
    """The hot-stab with a receptacle that sways by 20 mm in a current."""
    return _variant(folder, "hot-stab", (r'disturbances = "calm"', 'disturbances = "typical"'))


def _variant(folder: Path, task: str, *changes: tuple[str, str], name: str = "") -> Path:
    text = (_TASKS / f"{task}.toml").read_text()
    for pattern, replacement in changes:
        text, n = re.subn(pattern, replacement, text)
        assert n, pattern
    file = folder / f"{name or task}-variant.toml"
    file.write_text(text)
    return file
