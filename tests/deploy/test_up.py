from __future__ import annotations

import pytest

from farhand.common.errors import InvalidConfiguration
from farhand.deploy.run_settings import RunSettings
from farhand.deploy.up import first_steps


@pytest.mark.parametrize(
    ("task", "link", "word"), [("nothing", "lan", "task"), ("planar", "nowhere", "nowhere")]
)
def test_a_wrong_task_or_profile_is_refused_before_anything_starts(task: str, link: str, word: str):
    RunSettings("planar", "lan", 0).check()
    with pytest.raises(InvalidConfiguration, match=word):
        RunSettings(task, link, 0).check()


def test_the_first_steps_name_the_page_that_there_is():
    assert first_steps("") == []
    assert "http://here" in first_steps("http://here")[0]
