"""Names that become parts of paths, of keys of the link or of pages: one pattern for them all."""

from __future__ import annotations

import getpass
import hashlib
import re
import socket
from pathlib import Path
from typing import Annotated

from msgspec import Meta

from farhand.common.errors import NAME_PATTERN as PATTERN
from farhand.common.errors import NAME_RULE as RULE
from farhand.common.errors import InvalidConfiguration

PRINTABLE = r"^[^\x00-\x1f\x7f\u2028\u2029]*\Z"
"""For what is only shown or compared: no control characters, in particular no line feeds."""

MOST_SITE_NAME = 16
"""Length of a site's name: a report of the robot has room for that."""

Name = Annotated[str, Meta(pattern=PATTERN, max_length=32)]
"""Of a task, a vehicle, a frame, a part of a scene."""
SiteName = Annotated[str, Meta(pattern=PATTERN, max_length=MOST_SITE_NAME)]
"""Of an operator's site."""
FileName = Annotated[str, Meta(pattern=PATTERN, max_length=128)]
"""Of a file in a known folder."""


def check_name(name: str, field: str, source: str = "command line", most: int = 32) -> str:
    """Return the name.

    Args:
        name: To be checked.
        field: Name of the field that has it, for the error.
        source: Origin of the field, for the error.
        most: Largest length.

    Raises:
        InvalidConfiguration: When it breaks `RULE`; names the field and the rule.
    """
    if len(name) > most or not re.match(PATTERN, name):
        raise InvalidConfiguration(source, field, f"{RULE}, of at most {most} characters, got {name!r}")
    return name


def default_site_name(data_folder: Path, usual_folder: Path) -> str:
    """Return a site's name from the user, the host and the data folder.

    Two operators who leave the name alone differ in one of the three: two sites cannot share a data folder.
    The same site has the same name after a restart, and so its own lease back.

    Args:
        data_folder: Where the site keeps its data.
        usual_folder: Where the user's site keeps its data when nobody says otherwise.
    """
    usual = data_folder.expanduser().resolve() == usual_folder.expanduser().resolve()
    place = "" if usual else str(data_folder.expanduser().resolve())
    whole = "\n".join((_user(), socket.gethostname(), place))
    plain = "-".join(filter(None, (_plain(_user()), _plain(socket.gethostname().partition(".")[0]))))
    if usual and whole.split("\n")[:2] == plain.split("-", 1) and len(plain) <= MOST_SITE_NAME:
        return plain
    digest = hashlib.sha256(whole.encode()).hexdigest()[:6]
    return f"{plain[: MOST_SITE_NAME - 7].rstrip('.-_')}-{digest}".lstrip("-")


def _user() -> str:
    """Return the user's name; of a user without one, the number."""
    import os

    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return f"uid{os.getuid()}"


def _plain(text: str) -> str:
    """Return the part of a text that may be in a name."""
    return re.sub(r"[^A-Za-z0-9._-]+", "-", text).strip(".-_")
