"""Names that become parts of paths, of keys of the link or of pages, by one pattern; and paths as users write them."""

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
"""Pattern of text that is only shown or compared: no control characters, in particular no line feeds."""

MOST_SITE_NAME = 16
"""Largest length of a site's name, which a report of the robot has room for."""

Name = Annotated[str, Meta(pattern=PATTERN, max_length=32)]
"""Name of a task, a vehicle, a frame, or a part of a scene."""
SiteName = Annotated[str, Meta(pattern=PATTERN, max_length=MOST_SITE_NAME)]
"""Name of an operator's site."""
FileName = Annotated[str, Meta(pattern=PATTERN, max_length=128)]
"""Name of a file in a known folder."""


def check_name(name: str, field: str, source: str = "command line", most: int = 32) -> str:
    """Return the name if it is valid.

    Args:
        name: Name to check.
        field: Name of the field, for the error.
        source: Origin of the field, for the error.
        most: Largest length.

    Raises:
        InvalidConfiguration: When it breaks `RULE`; names the field and the rule.
    """
    if len(name) > most or not re.match(PATTERN, name):
        raise InvalidConfiguration(source, field, f"{RULE}, of at most {most} characters, got {name!r}")
    return name


def user_path(text: str | Path, field: str) -> Path:
    """Return a path as a user writes it, with `~` for a home.

    Args:
        text: Path to read.
        field: Name of the field, for the error.

    Raises:
        InvalidConfiguration: When it begins with a home that nobody has.
    """
    try:
        return Path(text).expanduser()
    except RuntimeError as error:
        expected = f"a path from a home that exists, got {str(text)!a}"
        raise InvalidConfiguration("configuration", field, expected) from error


def default_site_name(data_folder: Path, usual_folder: Path) -> str:
    """Return a site's name made from the user, the host and the data folder.

    Two operators who leave the name alone differ in one of the three, since two sites cannot share a data
    folder. The same site has the same name after a restart, and so gets its own lease back.

    Args:
        data_folder: Data folder of the site.
        usual_folder: Default data folder of the user.
    """
    usual = data_folder.resolve() == usual_folder.resolve()
    place = "" if usual else str(data_folder.resolve())
    whole = "\n".join((_user(), socket.gethostname(), place))
    plain = "-".join(filter(None, (_plain(_user()), _plain(socket.gethostname().partition(".")[0]))))
    if usual and whole.split("\n")[:2] == plain.split("-", 1) and len(plain) <= MOST_SITE_NAME:
        return plain
    digest = hashlib.sha256(whole.encode(errors="surrogatepass")).hexdigest()[
        :6
    ]  # of folders that are not UTF-8
    return f"{plain[: MOST_SITE_NAME - 7].rstrip('.-_')}-{digest}".lstrip("-")


def _user() -> str:
    """Return the user's name, or the number of a user without a name."""
    import os

    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return f"uid{os.getuid()}"


def _plain(text: str) -> str:
    """Return the characters of a text that a name may contain."""
    return re.sub(r"[^A-Za-z0-9._-]+", "-", text).strip(".-_")
