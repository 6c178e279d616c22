"""Surroundings in which a `farhand` process may be started: users, disks, folders, terminals, networks.

Each surrounding is arranged for real: by a shell that prepares namespaces, limits and descriptors and then
becomes the process, by variables, and by what its standard streams are.
"""

from __future__ import annotations

import fcntl
import os
import pty
import signal
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from farhand.common.model.kernel import kernel_folder
from farhand.deploy.entry import ROOT

Stream = Literal["read", "null", "unread", "gone", "full", "terminal"]

_LITTLE_BYTES = 4096
_OWN_PLACES = {"HOME": "home", "FARHAND_RUNTIME_DIR": "run", "TMPDIR": "scratch"}
_SOMEBODY, _SOMEBODY_ELSE = 12345, 12346
"""User ids that no system knows."""


@dataclass(frozen=True)
class Surrounding:
    """Unusual surroundings of a process.

    Args:
        prepare: Lines of a shell that has the folder of the trial in `$FOLDER`, run before the process.
        prefix: Words before that shell: namespaces, another user.
        variables: Set in its environment; None removes one. `FOLDER` stands for the folder of the trial.
        streams: Standard output and standard error.
        closed: Standard descriptors that the process is started without.
        folder: Working directory, in the folder of the trial.
        root: Whether only root can arrange it.
        ended_by: Signal that ends a process here.
        commands: The only commands that it matters to; none: to all. Their page is opened through a proxy.
    """

    prepare: str = ""
    prefix: tuple[str, ...] = ()
    variables: dict[str, str | None] = field(default_factory=dict)
    streams: tuple[Stream, Stream] = ("null", "read")
    closed: tuple[int, ...] = ()
    folder: str = ""
    root: bool = False
    ended_by: signal.Signals = signal.SIGINT
    commands: tuple[str, ...] = ()

    @property
    def is_heard(self) -> bool:
        """True if anybody can read what the process writes to its standard error."""
        return self.streams[1] in ("read", "terminal") and 2 not in self.closed

    def command(self, command: list[str]) -> list[str]:
        """Return the words that start a command here."""
        closing = "".join(f"exec {fd}<&-\n" for fd in self.closed)
        return [*self.prefix, "bash", "-c", f'{self.prepare}\n{closing}exec "$@"', "bash", *command]

    def environment(self, folder: Path) -> dict[str, str]:
        """Return the variables of a process here.

        Nothing of this user's is touched. What was compiled is at hand, unless the surrounding hides it.
        """
        compiled = Path(kernel_folder() or "/dev/null").parents[1]
        own = {name: f"{folder}/{place}" for name, place in _OWN_PLACES.items()}
        found = {
            **os.environ, "XDG_CACHE_HOME": str(compiled), "XDG_DATA_HOME": None, "FOLDER": str(folder), **own,
            **self.variables,
        }  # fmt: skip
        return {
            name: value.replace("FOLDER", str(folder)) for name, value in found.items() if value is not None
        }


def open_stream(kind: Stream) -> tuple[int, int | None]:
    """Return what a process writes to, and the other end, if there is one."""
    if kind in ("null", "full"):
        return os.open(os.devnull if kind == "null" else "/dev/full", os.O_WRONLY), None
    if kind == "terminal":
        reader, fd = pty.openpty()
        return fd, reader
    reader, fd = os.pipe()
    if kind == "gone":
        os.close(reader)
        return fd, None
    if kind == "unread":
        fcntl.fcntl(fd, fcntl.F_SETPIPE_SZ, _LITTLE_BYTES)
    return fd, reader


NAMED = "a proxy in front of the page"
CANNOT_ARRANGE = 77
"""Status of the shell when it cannot."""


def _read_only(folder: str) -> str:
    return f"mount --bind {folder} {folder} && mount -o remount,bind,ro {folder} || exit {CANNOT_ARRANGE}"


_FULL = (
    f"mkdir -p $FOLDER/full && mount -t tmpfs -o size=64k none $FOLDER/full || exit {CANNOT_ARRANGE}\n"
    "cat /dev/zero > $FOLDER/full/filler 2>/dev/null"
)
_NO_ROOM = f"{_FULL}; mount --bind $FOLDER/full $FOLDER/out"
_NO_TEMPORARY = (
    f"mount --bind $FOLDER /mnt && {_read_only('/tmp')}; {_read_only('/var/tmp')}; {_read_only('/dev/shm')}\n"
    f"for place in home out; do mount --bind /mnt/$place $FOLDER/$place || exit {CANNOT_ARRANGE}; done; cd $FOLDER"
)
_OWN_HOME = (
    'cd ~root && mkdir -p .local "$FOLDER/home" && mount --bind "$FOLDER/home" .local '
    f'&& cd "$FOLDER" || exit {CANNOT_ARRANGE}'
)
_ONLY_IPV6 = f"ip link set lo up && ip address delete 127.0.0.1/8 dev lo || exit {CANNOT_ARRANGE}"
_STRANGER = ("unshare", "--user", f"--map-user={_SOMEBODY}", f"--map-group={_SOMEBODY}")
_READS_ALL = ("--inh-caps=+dac_read_search", "--ambient-caps=+dac_read_search")
_MAY_ONLY_READ = (
    "setpriv", f"--reuid={_SOMEBODY_ELSE}", f"--regid={_SOMEBODY_ELSE}", "--clear-groups", *_READS_ALL,
)  # fmt: skip
_MOUNTS = ("unshare", "--mount")
_COMPILES: dict[str, str | None] = {"XDG_CACHE_HOME": None, "TMPDIR": None}
"""Nothing that was compiled is at hand; what is compiled stays in a temporary folder from trial to trial."""

SURROUNDINGS = {
    "ordinary": Surrounding(),
    "no HOME": Surrounding(_OWN_HOME, _MOUNTS, {"HOME": None}, root=True),
    "unknown user without HOME": Surrounding(
        prefix=_STRANGER, variables={"HOME": None, **_COMPILES}
    ),
    "unknown user, HOME=/": Surrounding(prefix=_MAY_ONLY_READ, variables={"HOME": "/", **_COMPILES}, root=True),
    "HOME that is a file": Surrounding(variables={"HOME": "/dev/null"}),
    "HOME with spaces": Surrounding('mkdir -p "$HOME"', variables={"HOME": "FOLDER/a b é"}),
    "read-only installation": Surrounding(_read_only(ROOT), _MOUNTS, root=True),
    "read-only installation, home": Surrounding(
        f"mkdir -p $HOME; {_read_only(ROOT)}; {_read_only('$FOLDER/home')}", _MOUNTS,
        {"HOME": "FOLDER/home"}, root=True,
    ),
    "read-only disk": Surrounding(
        f"mkdir -p $HOME; {_read_only('/tmp')}; {_read_only('$FOLDER')}", _MOUNTS,
        {"HOME": "FOLDER/home"}, root=True,
    ),
    "full disk": Surrounding(
        _NO_ROOM, _MOUNTS, {"HOME": "FOLDER/full", "XDG_DATA_HOME": "FOLDER/full"}, root=True
    ),
    "full cache": Surrounding(_FULL, _MOUNTS, {**_COMPILES, "XDG_CACHE_HOME": "FOLDER/full"}, root=True),
    "full temporary folder": Surrounding(_FULL, _MOUNTS, {"TMPDIR": "FOLDER/full"}, root=True),
    "files of no size": Surrounding("ulimit -f 0"),
    "foreign packages": Surrounding(folder="foreign"),
    "foreign packages, PYTHONPATH": Surrounding(folder="named", variables={"PYTHONPATH": ":"}),
    "a folder that was removed": Surrounding("mkdir -p $FOLDER/gone; cd $FOLDER/gone; rmdir $FOLDER/gone"),
    "ASCII": Surrounding(
        variables={"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0", "PYTHONIOENCODING": "ascii"}
    ),
    "a dumb terminal": Surrounding(variables={"TERM": "dumb"}, streams=("terminal", "terminal")),
    "a terminal": Surrounding(variables={"TERM": "xterm"}, streams=("terminal", "terminal")),
    "closed input": Surrounding(closed=(0,)),
    "closed output": Surrounding(closed=(1,)),
    "closed error": Surrounding(closed=(2,)),
    "all three closed": Surrounding(closed=(0, 1, 2)),
    "full output": Surrounding(streams=("full", "read")),
    "full error": Surrounding(streams=("null", "full")),
    "unread error": Surrounding(streams=("null", "unread")),
    "readers gone": Surrounding(streams=("gone", "gone")),
    "64 descriptors": Surrounding("ulimit -n 64"),
    "only IPv6": Surrounding(_ONLY_IPV6, ("unshare", "--net"), root=True),
    "no network": Surrounding(prefix=("unshare", "--net"), root=True),
    "a proxy is named": Surrounding(
        variables={name: "http://127.0.0.1:9" for name in ("http_proxy", "https_proxy", "ALL_PROXY")}
    ),
    "no temporary folder": Surrounding(
        _NO_TEMPORARY, _MOUNTS, {"TMPDIR": "FOLDER/nowhere", "FARHAND_RUNTIME_DIR": "FOLDER/home/run"}, root=True,
    ),
    NAMED: Surrounding(commands=("local",)),
    "a proxy that is not named": Surrounding(commands=("up", "local")),
    "SIGINT ignored": Surrounding("trap '' INT", ended_by=signal.SIGTERM),
    "no PATH": Surrounding("PATH="),
    "python -O": Surrounding(variables={"PYTHONOPTIMIZE": "1"}),
}  # fmt: skip
