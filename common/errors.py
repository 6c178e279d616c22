"""Errors of Farhand.

Every error says which field or file is wrong, what was expected, and what to do about it; foreign
exceptions (of the transport, the decoder, the file system) are converted where they enter.

    FarhandError
    ├── InvalidInput            something given to us is malformed; nothing was changed
    │   ├── InvalidDemonstration
    │   ├── InvalidModel
    │   ├── InvalidMessage
    │   └── InvalidConfiguration
    ├── LinkError               the transport could not be opened, or nobody answered
    │   └── PortTaken           another process has the port
    ├── DriverFailed            a driver of the user's own could not be imported, made or started
    └── ProcessFailed           a child process ended on its own
"""

from __future__ import annotations

import re

NAME_RULE = "a name of letters, digits, '.', '_' and '-' that begins with a letter or a digit"
NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9._-]*\Z"
"""`NAME_RULE` as a regular expression, see `farhand.common.names`; `$` would let a line feed pass at the end."""


class FarhandError(Exception):
    """Base of all errors that Farhand raises on purpose; its text is one line, fit for the operator.

    Names of files and fields come from outside: characters that cannot be printed are shown as their codes.
    """

    def __str__(self) -> str:
        return on_one_line(super().__str__())


class InvalidInput(FarhandError):
    """Input that does not have the agreed form.

    Args:
        source: Name of the input: a file name, ``configuration``, a message's name.
        field: Faulty field, or an empty string for the whole.
        expected: Expected content, and the remedy.
    """

    def __init__(self, source: str, field: str, expected: str):
        self.source, self.field, self.expected = source, field, expected
        where = f"{source}: {field}" if field else source
        super().__init__(f"{where}: {expected}")

    def __reduce__(self) -> tuple[type[InvalidInput], tuple[str, str, str]]:
        return type(self), (self.source, self.field, self.expected)  # so that it crosses processes


class InvalidDemonstration(InvalidInput):
    """Malformed demonstration file or stream."""


class InvalidModel(InvalidInput):
    """Model file or content that breaks an invariant of the TP-HSMM."""


class InvalidMessage(InvalidInput):
    """Message from the wire that was not understood; it was dropped."""


class InvalidConfiguration(InvalidInput):
    """Wrong configuration file or override."""


class LinkError(FarhandError):
    """Failure of the transport to the other site."""


class PortTaken(LinkError):
    """Port on which another process listens."""


class DriverFailed(FarhandError):
    """Driver of the user's own that could not be imported, made or started."""


class ProcessFailed(FarhandError):
    """Unexpected end of a child process."""


def on_one_line(text: str) -> str:
    """Return a text with its line feeds and whatever else cannot be printed as their codes."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def words_of(error: BaseException) -> str:
    """Return the class and the text of a foreign error, whose text may itself fail."""
    try:
        text = str(error)
    except Exception:
        text = "(its text cannot be shown)"
    return f"{type(error).__name__}: {text}"


def field_of(error: Exception) -> tuple[str, str]:
    """Return the faulty field and the text of a validation error of msgspec."""
    text, _, path = str(error).partition(" - at ")
    text = text.replace(f"`str` matching regex {NAME_PATTERN!r}", NAME_RULE)
    return re.sub(r"^\$\.?", "", path.strip("`")), text
