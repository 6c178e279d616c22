"""`import farhand`: the public names, and the page that describes them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import farhand
from docs.api_page import PAGE, page


@pytest.mark.parametrize("name", farhand.__all__)
def test_every_public_name_can_be_imported_and_says_what_it_is(name: str):
    value = getattr(farhand, name)
    assert getattr(value, "__doc__", None)
    assert name in dir(farhand)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no_such_name"):
        farhand.no_such_name  # noqa: B018


def test_the_names_for_type_checkers_are_those_that_are_found():
    source = (
        Path(farhand.__file__).read_text(encoding="utf-8").split("if TYPE_CHECKING:")[1].split("# Where")[0]
    )
    typed = {line.split(" as ")[-1] for line in source.splitlines() if " import " in line}
    assert typed == set(farhand.__all__)


def test_importing_the_package_compiles_and_loads_nothing():
    loaded = "import sys, farhand; print({'numpy', 'numba', 'zenoh', 'mujoco', 'viser'} & set(sys.modules))"
    said = subprocess.run([sys.executable, "-c", loaded], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "set()"


def test_the_page_is_made_from_the_docstrings():
    assert PAGE.read_text(encoding="utf-8") == page(), "run: python -m docs.api_page"
