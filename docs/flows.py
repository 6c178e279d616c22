"""Write the four flows into docs/architecture.md by watching them run: `python -m docs.flows`.

Both sites run in one process and in virtual time; every file of theirs is noted, in the order of the calls, while a
flow passes through it. Compiled kernels are not seen: the file that calls them stands for them.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from farhand.common.impairment.impairment import LinkSettings
from farhand.common.mode_table import Action, ControlMode
from farhand.common.model.manifold import POSE
from farhand.common.task import TaskSet
from farhand.deploy.places import find_task, sample_files
from farhand.evaluation.harness.virtual_job import VirtualPlace
from farhand.evaluation.harness.virtual_sites import VirtualSites
from farhand.local_site.console import intents
from farhand.local_site.console.commanding import Commanding
from farhand.local_site.console.console import Console
from farhand.local_site.console.console_parts import ConsoleParts
from farhand.local_site.console.dispatcher import Dispatcher
from farhand.local_site.learning.warm_up import warm_up as learning_warm_up
from farhand.local_site.script.scripted_actions import ScriptedActions
from farhand.local_site.teaching.library import Library
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.reproduction.warm_up import warm_up as control_warm_up
from farhand.remote_site.robot import Robot
from farhand.remote_site.supervision.supervisor import Supervisor
from farhand.remote_site.telemetry import Reporter

ROOT = Path(__file__).resolve().parent.parent
PAGE = Path(__file__).parent / "architecture.md"
_PACKAGES = ("common/", "local_site/", "remote_site/")
_HARNESS = "common/impairment/"  # link in virtual time; real links are `common/link` and `deploy/link`
_TITLES = {
    "a datapoint": "A datapoint, from the operator's hand to the model",
    "Execute": "Execute, from the button to the robot's answer",
    "a tick": "A tick of the robot while it executes, simulation included",
    "a report": "A report, from the robot to the console",
}
_BEGIN, _END = "<!-- flows: python -m docs.flows -->\n", "<!-- end of flows -->"


class Watch:
    """Recorder of the files of all calls below some functions.

    Args:
        entries: Functions at which a flow enters.
        aside: Function that reads the facts of all parts; its own file is noted, and not those of its calls.
    """

    def __init__(self, *entries: Callable[..., object], aside: Callable[..., object] | None = None):
        self._entries = {entry.__code__ for entry in entries}
        self._aside = aside.__code__ if aside is not None else None
        self._inside = self._beside = 0
        self.files: dict[str, None] = {}

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Watch while the block runs."""
        sys.setprofile(self._seen)
        try:
            yield
        finally:
            sys.setprofile(None)

    def _seen(self, frame: FrameType, event: str, _argument: object) -> None:
        code = frame.f_code
        if event == "call":
            self._inside += code in self._entries
            if self._inside and not self._beside and (file := _file_of(code.co_filename)):
                self.files.setdefault(file)
            self._beside += code is self._aside
        elif event == "return":
            self._inside -= code in self._entries
            self._beside -= code is self._aside


def _file_of(name: str) -> str:
    try:
        file = str(Path(name).resolve().relative_to(ROOT))
    except ValueError:
        return ""
    if not file.startswith(_PACKAGES) or file.startswith(_HARNESS) or file.endswith("__init__.py"):
        return ""
    return file


def flows() -> dict[str, list[str]]:
    """Run the insertion task, and return the files that each flow passes, in the order of their first call."""
    learning_warm_up(POSE)  # compiling under observation would take minutes
    control_warm_up(POSE)
    with tempfile.TemporaryDirectory() as folder:
        library = Library(TaskSet([find_task("hot-stab")]), Path(folder))
        sites = VirtualSites(library, LinkSettings(), RemoteConfig(seed=1), sample_files=sample_files)
        place = VirtualPlace(sites, LinkSettings())
        operator = ScriptedActions(place, place)
        found = {"a datapoint": _datapoint(sites)}
        operator.submit(intents.LoadSamples())
        operator.submit(intents.SendModel())
        operator.until("sent", lambda p: p.standing.confirmed_sha256 != "" and not p.standing.differs)
        operator.command(Action.ARM, ControlMode.HOLD)
        operator.preview()
        found["Execute"] = _execute(sites, operator)
        found["a tick"] = _tick(sites)
        found["a report"] = _report(sites)
    return found


def _datapoint(sites: VirtualSites) -> list[str]:
    """Run from the operator's hand to the statistics of the model, in the middle of a demonstration."""
    console, watch = sites.console, Watch(Dispatcher._hand)
    console.submit(intents.RecordDemonstration())
    sites.run(0.2)
    arm = console.picture.own_arm
    assert arm is not None
    x, *rest = arm.tip.tolist()
    for step in range(1, 40):
        moved = (x + 0.002 * step, *rest)
        with watch.watching():
            console.submit(intents.Hand(moved, 0.02 * step))
            sites.run(0.02)
    console.submit(intents.EndDemonstration(anyway=True))
    sites.run(0.2)
    return list(watch.files)


def _execute(sites: VirtualSites, operator: ScriptedActions) -> list[str]:
    """Run from the button to the robot's answer; the picture by which the button is judged is one step of it."""
    entries = (Dispatcher._do_if_allowed, Robot._on_request, Supervisor.on_command, Commanding._on_reply)
    watch = Watch(*entries, aside=ConsoleParts.draw)
    with watch.watching():
        operator.command(Action.EXECUTE, ControlMode.AUTONOMOUS)
    return list(watch.files)


def _tick(sites: VirtualSites) -> list[str]:
    """Run one control period of an execution, simulation included."""
    watch = Watch(Supervisor.tick)
    with watch.watching():
        sites.run(0.3)
    return list(watch.files)


def _report(sites: VirtualSites) -> list[str]:
    """Run from the robot's state to the console's newest report."""
    watch = Watch(Reporter.report, Robot._announce, Console._on_telemetry)
    with watch.watching():
        sites.run(0.3)
    return list(watch.files)


def section(found: dict[str, list[str]]) -> str:
    """Return the flows as Markdown, one folder per line, its files in the order of their first call."""
    parts = []
    for name, files in found.items():
        folders: dict[str, list[str]] = {}
        for file in files:
            folder, _, stem = file.removesuffix(".py").rpartition("/")
            folders.setdefault(folder, []).append(stem)
        rows = [f"| `{folder}` | {', '.join(stems)} |" for folder, stems in folders.items()]
        parts.append(
            f"**{_TITLES[name]}**: {len(files)} files.\n\n| folder | files |\n|---|---|\n" + "\n".join(rows)
        )
    return "\n\n".join(parts) + "\n"


def flows_of_page() -> dict[str, set[str]]:
    """Return the files that the page lists for each flow."""
    listed = PAGE.read_text(encoding="utf-8").split(_BEGIN)[1].split(_END)[0]
    return {
        name: {
            f"{folder}/{stem}.py"
            for folder, stems in re.findall(r"^\| `([a-z_/]+)` \| (.+) \|$", part, flags=re.MULTILINE)
            for stem in stems.split(", ")
        }
        for name, title in _TITLES.items()
        for part in [listed.split(f"**{title}**")[1].split("\n**")[0]]
    }


def page_with(text: str) -> str:
    """Return the page with this section between its marks."""
    head, rest = PAGE.read_text(encoding="utf-8").split(_BEGIN)
    return head + _BEGIN + text + _END + rest.split(_END)[1]


if __name__ == "__main__":
    PAGE.write_text(page_with(section(flows())), encoding="utf-8")
