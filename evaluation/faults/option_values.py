"""Values of command line options as nobody would write them, given to the shipped commands.

The commands are run whole but for what then goes on for long: the sites, the link and a study's trials do not start.
Files that are named are made in a folder that is removed afterwards.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest import mock

import tyro

from farhand.deploy.cli import COMMANDS
from farhand.deploy.outcome import status_of
from farhand.evaluation.faults.bounds import WrongResult
from farhand.evaluation.faults.mutants import Random, bytes_mutant
from farhand.evaluation.faults.sound_files import sound_files, write_identities

_TASK, _SEED = {"task": "planar"}, {"seed": "3"}
_PLACES = {"data-dir": "data"}
LINES: dict[str, tuple[tuple[str, ...], dict[str, str]]] = {
    "up": ((), {**_TASK, **_SEED, **_PLACES, "link": "lan", "port": "0"}),
    "demo": ((), {**_TASK, **_SEED, **_PLACES, "link": "lan", "outage": "stall:10@0.2", "json": "r.json"}),
    "local": (
        (),
        {
            **_TASK, **_SEED, **_PLACES, "config": "local.toml", "connect": "quic/127.0.0.1:7447", "certificates": "shore-1",
            "link-rate-bps": "1e6", "link-control": "127.0.0.1:7449", "port": "0", "site-name": "shore-1", "connect-timeout-s": "5",
        },
    ),
    "remote": (
        (),
        {**_TASK, **_SEED, **_PLACES, "config": "remote.toml", "listen": "quic/127.0.0.1:7447", "certificates": "rov1", "sites": "sites.json", "link-rate-bps": "1e6"},
    ),
    "link": (
        (),
        {**_SEED, "listen": "127.0.0.1:0", "target": "127.0.0.1:7447", "control": "127.0.0.1:0", "profile": "geo"},
    ),
    "learn": (("d.npz",), {"out": "out.model", "max-distance-m": "0.1"}),
    "rollout": (("m.farhand",), {"like": "d.npz", "out": "out.npz"}),
    "model": (("show", "m.farhand"), {"figure": "f.png"}),
    "import": (
        ("r.npz",),
        {
            "out": "imported", "kind": "lasa", "columns": "x=2", "motion": "", "frames": "goal=0.5,0.5", "only": "1",
            "rotation": "xyz", "rate-hz": "60", "length-unit": "mm", "time-unit": "s", "delimiter": "comma",
        },
    ),
    "samples": ((), {**_SEED, "out": "samples", "task": "hot-stab", "n": "2"}),
    "evaluate": (("planar",), {**_SEED, "trials": "3", "out": "results"}),
    "robot": (("check", "jaco"), {**_SEED, "candidates": "1"}),
    "status": ((), {"of": "all"}),
}  # fmt: skip
"""Of each command: its positional arguments, and a sound value of each of its options."""
_OPTIONS = tuple((command, option) for command, (_, values) in LINES.items() for option in values)
_FILES = ("data-dir", "json", "config", "out", "like", "figure")
_VALUES = (
    "", " ", "-1", "0", "-0.0", "nan", "inf", "-inf", "1e999", "1e308", "1e-320", "9" * 30, "-" + "9" * 30, "1_000", "0x10",
    "٣", "\udcff", "a\nb", "\u202e", "../evil", "~", "~nobody/x", "x" * 300, "=", ",", "planar,planar", "planar,hot-stab",
    "true", "None", "null", "[]", "{}", "localhost", "::1", "[::1]:0", "host:port", "127.0.0.1:99999", "127.0.0.1:-1",
    "tcp/", "udp/127.0.0.1:1", "tcp/127.0.0.1", "stall:nan", "stall:10@nan", "reset:1e9", "blackhole:10@-1", "stall:", "@",
    "d.npz", "local.toml", ".", "nowhere/x", "1.5", "65536", "999999999",
)  # fmt: skip


_ANSWERS = {"status": (0, 3, 4)}
"""Exit statuses that are no refusals, where there are more than success: 0."""


class _Reached(BaseException):
    """A study's trials would begin."""


def value_mutant(random: Random, option: str, value: str) -> str:
    """Return another value of an option, as a process can be given it: without a zero byte, and within the folder."""
    if random.random() < 0.4:
        value = _VALUES[int(random.integers(0, len(_VALUES)))]
    else:
        changed = bytes_mutant(random, value.encode(errors="surrogateescape"))
        value = changed.replace(b"\0", b"").decode(errors="surrogateescape")
    return value.replace("/", "_") if option in _FILES and value[:1] in "/~." else value


def attempts(folder: Path) -> Callable[[Random], bool]:
    """Return what gives one mutant to a command, after the sound values were accepted."""
    for command, (_, values) in LINES.items():
        if not _run(command, values, folder):
            raise WrongResult(f"sound values are refused: {command}")

    def attempt(random: Random) -> bool:
        command, option = _OPTIONS[int(random.integers(0, len(_OPTIONS)))]
        values = LINES[command][1]
        return _run(command, {**values, option: value_mutant(random, option, values[option])}, folder)

    return attempt


def _run(command: str, values: dict[str, str], folder: Path) -> bool:
    positional, arguments = LINES[command][0], [f"--{name}={value}" for name, value in values.items()]
    said, errors = io.StringIO(), io.StringIO()
    with _surroundings(folder), contextlib.redirect_stdout(said), contextlib.redirect_stderr(errors):
        try:
            chosen = tyro.cli(
                COMMANDS[command],
                args=[*positional, *arguments],
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
    if status in _ANSWERS.get(command, (0,)):
        return True
    if len(lines) != 1 or not lines[0].startswith("farhand: "):
        raise WrongResult(f"{command} {arguments} ends with {status} and {errors.getvalue()!r}")
    return False


@contextlib.contextmanager
def _surroundings(folder: Path) -> Iterator[None]:
    """Prepare a folder with valid files, and replace everything that runs for long."""
    here, deep = Path.cwd(), folder / "a" / "b"
    deep.mkdir(parents=True, exist_ok=True)
    write_identities(deep)
    for name, content in sound_files().items():
        if not (deep / name).is_file():
            (deep / name).write_bytes(content)
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


_STAND_INS: dict[str, Any] = {
    "farhand.local_site.site.LocalSite.run": _nothing,
    "farhand.local_site.site.LocalSite.run_script": _succeed,
    "farhand.remote_site.site.RemoteSite.run": _nothing,
    "farhand.deploy.link.link_process.run_link": _zero,
    "farhand.deploy.up._together": _zero,
    "farhand.evaluation.study._run_all": _reached,
    "farhand.local_site.workcell.operator_arm.DEMONSTRATIONS": dict.fromkeys(
        ("hot-stab", "hot-stab-removal"), _one_demonstration
    ),
}
