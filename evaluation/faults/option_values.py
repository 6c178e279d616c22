"""Values of command line options as nobody would write them, given to the shipped commands.

The commands are run whole but for what then goes on for long: the sites, the link and a study's trials do not start.
Files that are named are made in a folder that is removed afterwards.
"""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import tyro

from farhand.deploy.cli import COMMANDS
from farhand.deploy.outcome import status_of
from farhand.evaluation.faults.bounds import WrongResult
from farhand.evaluation.faults.command_lines import LINES, Line
from farhand.evaluation.faults.mutants import Random, bytes_mutant
from farhand.evaluation.faults.sound_files import authority_files, sound_files, write_identities

_CHANGES = tuple((line, what) for line in LINES for what in line.changeable)
_FILES = ("data-dir", "json", "config", "remote-config", "out", "like", "figure", "folder", 0)
_VALUES = (
    "", " ", "-1", "0", "-0.0", "nan", "inf", "-inf", "1e999", "1e308", "1e-320", "9" * 30, "-" + "9" * 30, "1_000", "0x10",
    "٣", "\udcff", "a\nb", "\u202e", "../evil", "~", "~nobody/x", "x" * 300, "=", ",", "planar,planar", "planar,hot-stab",
    "true", "None", "null", "[]", "{}", "localhost", "::1", "[::1]:0", "host:port", "127.0.0.1:99999", "127.0.0.1:-1",
    "tcp/", "udp/127.0.0.1:1", "tcp/127.0.0.1", "stall:nan", "stall:10@nan", "reset:1e9", "blackhole:10@-1", "stall:", "@",
    "d.npz", "local.toml", ".", "nowhere/x", "1.5", "65536", "999999999",
)  # fmt: skip


_ANSWERS = {"status": (0, 3, 4), "robot check": (0, 1), "robot place": (0, 1), "pki show": (0, 3)}
"""Exit statuses that are no refusals, where there are more than success: 0."""


class _Reached(BaseException):
    """A study's trials, or the work of a hub, would begin."""


def value_mutant(random: Random, option: str | int, value: str) -> str:
    """Return another value of an option, as a process can be given it: without a zero byte, and within the folder."""
    if random.random() < 0.4:
        value = _VALUES[int(random.integers(0, len(_VALUES)))]
    else:
        changed = bytes_mutant(random, value.encode(errors="surrogateescape"))
        value = changed.replace(b"\0", b"").decode(errors="surrogateescape")
    return value.replace("/", "_") if option in _FILES and value[:1] in "/~." else value


def attempts(folder: Path) -> Callable[[Random], bool]:
    """Return what gives one mutant to a command, after the sound values were accepted."""
    for line in LINES:
        if not _run(line, line.arguments(), folder):
            raise WrongResult(f"sound values are refused: {line}")

    def attempt(random: Random) -> bool:
        line, what = _CHANGES[int(random.integers(0, len(_CHANGES)))]
        sound = line.positional[what] if isinstance(what, int) else line.values[what]
        return _run(line, line.arguments(what, value_mutant(random, what, sound)), folder)

    return attempt


def _run(line: Line, arguments: list[str], folder: Path) -> bool:
    command = line.command.split()[0]
    said, errors = io.StringIO(), io.StringIO()
    with _surroundings(folder), contextlib.redirect_stdout(said), contextlib.redirect_stderr(errors):
        try:
            chosen = tyro.cli(
                COMMANDS[command],
                args=arguments,
                config=(tyro.conf.FlagCreatePairsOff, tyro.conf.HelptextFromCommentsOff),
            )
            status = status_of(chosen)
        except _Reached:
            return True
        except SystemExit as end:  # of what tyro says about a type, in a frame
            if end.code != 2:
                raise WrongResult(f"{command} ends with {end.code!r}") from None
            return False
    lines = errors.getvalue().splitlines()
    if status in _ANSWERS.get(line.command, (0,)):
        return True
    if len(lines) != 1 or not lines[0].startswith("farhand: "):
        raise WrongResult(f"{line.command} {arguments} ends with {status} and {errors.getvalue()!r}")
    return False


@contextlib.contextmanager
def _surroundings(folder: Path) -> Iterator[None]:
    """Prepare a folder with valid files, and replace everything that runs for long."""
    here, deep = Path.cwd(), folder / "a" / "b"
    _furnish(folder, deep)
    environment = {"HOME": str(folder), "XDG_DATA_HOME": str(folder), "XDG_RUNTIME_DIR": str(folder)}
    os.chdir(deep)
    try:
        with mock.patch.dict(os.environ, environment), contextlib.ExitStack() as stack:
            for name, stand_in in _STAND_INS.items():
                stack.enter_context(mock.patch(name, stand_in))
            yield
    finally:
        os.chdir(here)
        sys.unraisablehook = sys.__unraisablehook__


def _furnish(folder: Path, deep: Path) -> None:
    """Write the sound files, and remove what an earlier command has made: its lock would refuse the next one."""
    sound = {**sound_files(), **{f"pki/{name}": content for name, content in authority_files().items()}}
    for file in folder.iterdir():
        if file.name != "a":
            _remove(file)
    deep.mkdir(parents=True, exist_ok=True)
    for file in deep.iterdir():
        if file.name not in sound:
            _remove(file)
    write_identities(deep)
    for name, content in sound.items():
        if not (deep / name).is_file():
            (deep / name).parent.mkdir(parents=True, exist_ok=True)
            (deep / name).write_bytes(content)


def _remove(file: Path) -> None:
    if file.is_dir() and not file.is_symlink():
        shutil.rmtree(file)
    else:
        file.unlink()


def _nothing(*_: Any, **__: Any) -> None:
    """In place of a site that would serve until it is stopped."""


def _reached(*_: Any, **__: Any) -> None:
    raise _Reached


def _succeed(*_: Any, **__: Any) -> dict[str, Any]:
    return {"success": True}


async def _zero(*_: Any, **__: Any) -> int:
    return 0


def _one_demonstration(_seed: int, _cell: Any) -> Any:
    from farhand.local_site.teaching.demonstration import Demonstration

    return Demonstration.load("d.npz")


def _searched(robot: Any, *_: Any) -> Any:
    from farhand.common.arm.placing import Place

    return Place(robot, 0.1, 1, 1)


class _NothingDrawn(contextlib.nullcontext):
    """In place of a renderer, for machines that have none."""

    def __init__(self, *_: Any):
        super().__init__(self)

    def render_around(self, _: Any) -> Any:
        """Return a small picture."""
        return np.zeros((8, 8, 3), np.uint8)


_STAND_INS: dict[str, Any] = {
    "farhand.local_site.site.LocalSite.run": _nothing,
    "farhand.local_site.site.LocalSite.run_script": _succeed,
    "farhand.remote_site.site.RemoteSite.run": _nothing,
    "farhand.deploy.fleet.consoles._run": _zero,
    "farhand.common.link.hub.Hub": _reached,
    "farhand.deploy.fleet.hub_status.Fleet": _reached,
    "farhand.deploy.link.link_process.run_link": _zero,
    "farhand.deploy.up._together": _zero,
    "farhand.evaluation.study._run_all": _reached,
    "farhand.deploy.robots_report.search": _searched,
    "farhand.deploy.robots_report.Renderer": _NothingDrawn,
    "farhand.local_site.workcell.operator_arm.DEMONSTRATIONS": dict.fromkeys(
        ("hot-stab", "hot-stab-removal"), _one_demonstration
    ),
}
