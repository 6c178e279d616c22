"""Where a `farhand` process may be started: users, disks, folders, descriptors, terminals, networks.

Each surrounding is arranged for real: by a shell that prepares namespaces, limits and descriptors and then becomes
the process, by variables, and by what its standard streams are.
"""

from __future__ import annotations

import fcntl
import os
import pty
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from farhand.common.model.kernel import kernel_folder
from farhand.deploy.entry import ROOT

Stream = Literal["read", "null", "unread", "gone", "full", "terminal"]

_LITTLE_BYTES = 4096
_SOMEBODY = 12345
"""A user id that no system knows."""


@dataclass(frozen=True)
class Surrounding:
    """What is unusual where a process is started.

    Args:
        prepare: Lines of a shell that has the folder of the trial in `$FOLDER`, run before the process.
        prefix: Words before that shell: namespaces, another user.
        variables: Set in its environment; None removes one. `FOLDER` stands for the folder of the trial.
        streams: Standard output and standard error.
        folder: Working directory, in the folder of the trial.
        root: Whether only root can arrange it.
    """

    prepare: str = ""
    prefix: tuple[str, ...] = ()
    variables: dict[str, str | None] = field(default_factory=dict)
    streams: tuple[Stream, Stream] = ("null", "read")
    folder: str = ""
    root: bool = False

    def command(self, command: list[str]) -> list[str]:
        """Return the words that start a command here."""
        return [*self.prefix, "bash", "-c", f'{self.prepare}\nexec "$@"', "bash", *command]

    def environment(self, folder: Path) -> dict[str, str]:
        """Return the variables of a process here. What was compiled is at hand, unless the surrounding hides it."""
        compiled = Path(kernel_folder() or "/dev/null").parents[1]
        found = {**os.environ, "XDG_CACHE_HOME": str(compiled), "FOLDER": str(folder), **self.variables}
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


CANNOT_ARRANGE = 77
"""Status of the shell when it cannot."""


def _read_only(folder: str) -> str:
    return f"mount --bind {folder} {folder} && mount -o remount,bind,ro {folder} || exit {CANNOT_ARRANGE}"


_FULL = (
    f"mkdir -p $FOLDER/full && mount -t tmpfs -o size=64k none $FOLDER/full || exit {CANNOT_ARRANGE}\n"
    "cat /dev/zero > $FOLDER/full/filler 2>/dev/null"
)
_ONLY_IPV6 = f"ip link set lo up && ip address delete 127.0.0.1/8 dev lo || exit {CANNOT_ARRANGE}"
_STRANGER = ("unshare", "--user", f"--map-user={_SOMEBODY}", f"--map-group={_SOMEBODY}")
_READS_ALL = ("--inh-caps=+dac_read_search", "--ambient-caps=+dac_read_search")
_MAY_ONLY_READ = (
    "setpriv", f"--reuid={_SOMEBODY}", f"--regid={_SOMEBODY}", "--clear-groups", *_READS_ALL,
)  # fmt: skip
_MOUNTS = ("unshare", "--mount")

SURROUNDINGS = {
    "ordinary": Surrounding(),
    "no HOME": Surrounding(variables={"HOME": None}),
    "unknown user without HOME": Surrounding(
        prefix=_STRANGER, variables={"HOME": None, "XDG_CACHE_HOME": None}
    ),
    "unknown user, HOME=/": Surrounding(prefix=_MAY_ONLY_READ, variables={"HOME": "/", "XDG_CACHE_HOME": None}, root=True),
    "HOME that is a file": Surrounding(variables={"HOME": "/dev/null"}),
    "HOME with spaces": Surrounding("mkdir -p $HOME", variables={"HOME": "FOLDER/a b é"}),
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
        _FULL, _MOUNTS, {"HOME": "FOLDER/full", "XDG_DATA_HOME": "FOLDER/full"}, root=True
    ),
    "full cache": Surrounding(_FULL, _MOUNTS, {"XDG_CACHE_HOME": "FOLDER/full"}, root=True),
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
    "closed input": Surrounding("exec 0<&-"),
    "closed output": Surrounding("exec 1>&-"),
    "closed error": Surrounding("exec 2>&-"),
    "all three closed": Surrounding("exec 0<&- 1>&- 2>&-"),
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
    "SIGINT ignored": Surrounding("trap '' INT"),
    "no PATH": Surrounding("PATH="),
    "python -O": Surrounding(variables={"PYTHONOPTIMIZE": "1"}),
}  # fmt: skip
