"""A page on which nothing changes is sent nothing but its clock, however often the robot reports."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from tests.browser.desk_page import page_of
from tests.browser.raw_client import RawClient, raw_connection

BEATS = 4
"""So many signs of life of the page are awaited: one a second."""


def test_at_rest_nothing_is_sent_twice_and_no_part_of_the_scene(tmp_path: Path) -> None:
    with page_of(tmp_path) as (it, page), it.robot.reporting(), raw_connection(page.address) as connection:
        client = RawClient(connection)
        client.uuid("Path")  # the last element: all were sent
        assert client.shows("DISARMED", 60.0)
        await_beats(client, 2)
        messages = await_beats(client, BEATS)
    contents = Counter((m["uuid"], str(m["updates"])) for m in messages if m["type"] == "GuiUpdateMessage")
    assert [each for each, times in contents.items() if times > 1] == []
    assert {m["type"] for m in messages} == {"GuiUpdateMessage"}
    elements = Counter(uuid for uuid, _ in contents)
    assert max(elements.values()) <= 2 * BEATS + 2  # ages and counters change at most twice a second


def await_beats(client: RawClient, number: int) -> list[dict[str, Any]]:
    """Messages until the page has given so many signs of life."""
    messages: list[dict[str, Any]] = []
    while sum("fh-beat" in str(message.get("updates")) for message in messages) < number:
        messages += client.receive()
    return messages
