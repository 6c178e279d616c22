"""Sound command lines that have every option of every command between them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Line:
    """Sound command line.

    Args:
        command: Command, perhaps with actions of its own.
        positional: What is given without a name.
        values: Value of each option.
        flags: Options without a value.
    """

    command: str
    positional: tuple[str, ...]
    values: dict[str, str]
    flags: tuple[str, ...] = ()

    @property
    def changeable(self) -> tuple[str | int, ...]:
        """Options by name, and what is given without a name by number."""
        return (*self.values, *range(len(self.positional)))

    def arguments(self, changed: str | int | None = None, value: str = "") -> list[str]:
        """Return the arguments, of which one may have another value."""
        places = [value if n == changed else text for n, text in enumerate(self.positional)]
        values = {name: value if name == changed else text for name, text in self.values.items()}
        options = [word for name, text in values.items() for word in _as_words(name, text)]
        return [*self.command.split()[1:], *places, *options, *(f"--{flag}" for flag in self.flags)]


def _as_words(name: str, value: str) -> list[str]:
    return [f"--{name}", *value.split(" ")] if name in _SEVERAL else [f"--{name}={value}"]


_SEVERAL = ("tool",)
"""Options of several words."""


_POINT, _ARM = {"task": "planar", "seed": "3"}, {"task": "hot-stab", "robot": "jaco"}
_DATA, _OWN_ARM = {"data-dir": "data"}, {"own-arm": "ur5e"}
_DRIVERS = {"plant": "", "arm-driver": "", "perception": ""}
_AUTHORITY = {"folder": "pki"}
_OF_OPERATOR = {
    "config": "local.toml",
    "connect": "quic/127.0.0.1:7447",
    "certificates": "shore-1",
    **_POINT,
    **_DATA,
}
_OF_ROBOT = {"listen": "quic/127.0.0.1:7447", "certificates": "rov1", "sites": "sites.json"}
LINES = (
    Line("up", (), {**_POINT, **_DATA, "link": "lan", "port": "0", "transport": "tcp"}),
    Line("up", (), {**_ARM, **_OWN_ARM, **_DRIVERS, "camera": "", "remote-config": "remote.toml", "transport": "tcp"}),
    Line("demo", (), {**_POINT, **_DATA, "link": "lan", "outage": "stall:10@0.2", "json": "r.json"}),
    Line("demo", (), {**_ARM, **_OWN_ARM, **_DRIVERS, "remote-config": "remote.toml", "transport": "tcp"}),
    Line(
        "local", (),
        {**_OF_OPERATOR, "link-rate-bps": "1e6", "link-control": "127.0.0.1:7449", "port": "0", "site-name": "shore-1", "connect-timeout-s": "5"},
    ),
    Line(
        "local", (),
        {**_DATA, **_OWN_ARM, "task": "hot-stab", "robots": "rov1", "pages": "rov1=8080,rov2=8081", "port": "8080", "host": "127.0.0.1", "published-at": "127.0.0.1:8080"},
        ("watch",),
    ),
    Line("local", (), {**_OF_OPERATOR, "outage": "stall:10", "json": "r.json"}, ("demo",)),
    Line("remote", (), {**_POINT, **_DATA, **_OF_ROBOT, "config": "remote.toml", "link-rate-bps": "1e6"}),
    Line("remote", (), {**_ARM, **_DRIVERS, "connect": "tcp/127.0.0.1:7450", "vehicle": "rov1", "camera": "none"}),
    Line("link", (), {"seed": "3", "listen": "127.0.0.1:0", "target": "127.0.0.1:7447", "control": "127.0.0.1:0", "profile": "geo"}),
    Line("hub", (), {**_OF_ROBOT}),
    Line("status", (), {"of": "all"}, ("json",)),
    Line("status", (), {"connect": "quic/127.0.0.1:7450", "certificates": "shore-1"}),
    Line("learn", ("d.npz",), {"out": "out.model", "max-distance-m": "0.1"}),
    Line("rollout", ("m.farhand",), {"like": "d.npz", "out": "out.npz"}),
    Line("model show", ("m.farhand",), {"figure": "f.png"}),
    Line(
        "import", ("r.npz",),
        {
            "out": "imported", "kind": "lasa", "columns": "x=2", "motion": "", "frames": "goal=0.5,0.5", "only": "1", "rotation": "xyz",
            "quaternion-order": "wxyz", "rate-hz": "60", "length-unit": "mm", "angle-unit": "deg", "time-unit": "s", "delimiter": "comma",
        },
    ),
    Line("import", ("r.csv",), {"out": "imported", "kind": "csv", "motion": "plug", "tool": "0.1 0 0", "delimiter": "comma"}),
    Line("samples", (), {**_OWN_ARM, "seed": "3", "out": "samples", "task": "hot-stab", "n": "2"}),
    Line("evaluate", ("planar",), {"seed": "3", "trials": "3", "out": "results"}),
    Line("evaluate", ("hot-stab",), {"trials": "3", "out": "results", "robot": "panda", **_OWN_ARM}),
    Line("evaluate", ("neighbours",), {"only": "garbage", "out": "results"}),
    Line("robot check", ("jaco",), {}),
    Line("robot place", ("jaco",), {"seed": "3", "candidates": "1"}),
    Line("robot show", ("jaco",), {"out": "f.png"}),
    Line("pki init", (), {"folder": "new", "name": "sound"}),
    Line("pki robot", ("rov2",), {**_AUTHORITY, "san": "rov2.example", "days": "30"}),
    Line("pki hub", ("hub-1",), {**_AUTHORITY, "san": "127.0.0.2", "days": "30"}),
    Line("pki operator", ("shore-2",), {**_AUTHORITY, "robots": "rov1", "days": "30"}),
    Line("pki throw-away", (), {"folder": "new", "san": "127.0.0.1", "robot": "rov1", "operator": "ann"}),
    Line("pki renew", ("rov1",), {**_AUTHORITY, "days": "30"}),
    Line("pki revoke", ("rov1",), _AUTHORITY),
    Line("pki show", (), _AUTHORITY, ("json",)),
)  # fmt: skip
