"""Configuration files: TOML read into a structure, with every value checked."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from farhand.common.errors import InvalidConfiguration
from farhand.common.whole_file import fault_of, read_toml
from farhand.common.wire.codec import leaves

S = TypeVar("S", bound=msgspec.Struct)


def load_toml(path: Path, kind: type[S]) -> S:
    """Read and validate a structure from a TOML file.

    Raises:
        InvalidConfiguration: When the file cannot be read, is not TOML, or a field is unknown, missing,
            of a wrong type, or not finite.
    """
    with fault_of(path, InvalidConfiguration, "a TOML file in UTF-8"):
        plain = read_toml(path)
        check_values(plain, str(path))
        return msgspec.convert(plain, kind)


def check_values(plain: Any, source: str) -> None:
    """Check that all numbers of a configuration are finite and all its texts are printable in a line.

    Raises:
        InvalidConfiguration: Naming the field.
    """
    for where, value in leaves(plain):
        if isinstance(value, float) and not math.isfinite(value):
            raise InvalidConfiguration(source, where, f"a finite number, got {value}")
        if isinstance(value, str) and not value.isprintable():
            expected = f"text without line feeds or other characters that cannot be shown, got {value!a}"
            raise InvalidConfiguration(source, where, expected)
