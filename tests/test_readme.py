"""The README keeps its promises."""

import re
from pathlib import Path

from common.tphsmm import TPHSMM
from deploy.cli import COMMANDS

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_example_runs_and_ends_with_a_model():
    (example,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    names: dict[str, object] = {}
    exec(example, names)
    model = names["model"]
    assert isinstance(model, TPHSMM)
    assert model.terminal.sum() == 1


def test_every_link_leads_somewhere():
    links = re.findall(r"\]\(([^)#]+)\)", README)
    assert links
    assert [link for link in links if "://" not in link and not (ROOT / link).exists()] == []


def test_every_command_of_the_table_exists():
    names = set(re.findall(r"`farhand (\w+)", README))
    assert names
    assert names <= set(COMMANDS)
