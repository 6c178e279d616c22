"""What was taught of each task is sent, kept, gone back to by mouse, and there again for the next process."""

from __future__ import annotations

import json
import re
from pathlib import Path

from playwright.sync_api import Browser, expect

from farhand.local_site.view.uploads import MOST_FILE_BYTES
from tests.browser.operator_page import WAIT_MS, OperatorPage
from tests.browser.stack import Stack, farhand_up, other_still_task, still_task


def test_a_revision_is_gone_back_to_and_the_next_process_begins_with_it(
    browser: Browser, tmp_path: Path
) -> None:
    context = browser.new_context(viewport={"width": 900, "height": 1400})
    tasks = f"{still_task(tmp_path)},{other_still_task(tmp_path)}"
    try:
        with farhand_up(tmp_path / "data", task=tasks) as stack:
            tab = OperatorPage(context.new_page())
            tab.open(stack.address)
            tab.press("Load samples")
            tab.says("demos", "3")
            three = stack.model_file.read_bytes()
            send_both(tab)
            expect(tab.button("Go to")).to_be_disabled(timeout=WAIT_MS)
            tab.press("Start anew")
            tab.says("demos", "0")
            choose_revision(tab, "1: 3 demonstrations")
            tab.press("Go to")
            tab.says("demos", "3")
            tab.tells("revision 1 is current now")
            assert stack.model_file.read_bytes() == three
            choose_revision(tab, "2: 0 demonstrations")
            tab.press("Delete")
            tab.tells("revision 2 was deleted")
            delete_save_and_undo(tab, stack, three)
            assert tab.problems == []
        with farhand_up(tmp_path / "data", task=tasks) as stack:
            tab.open(stack.address)
            tab.says("demos", "3")
            tab.says("standing-other", "3 demonstrations, robot lacks it")
            assert stack.model_file.read_bytes() == three
            tab.press("Undo")  # the samples were learned by one press
            tab.says("demos", "0")
    finally:
        context.close()


def delete_save_and_undo(tab: OperatorPage, stack: Stack, three: bytes) -> None:
    """Save the second demonstration and the model, delete the demonstration, and have it back, by Undo and from the file."""
    choose_second(tab)
    tab.press("Hide demonstration")
    tab.says("demonstrations", re.compile("2, hidden"))
    tab.press("Show demonstration")
    second = sorted(stack.model_file.parent.glob("demonstration-*.npz"))[1]
    file = saved(tab, "Download demonstration")
    assert file == second.read_bytes()
    assert saved(tab, "Download model") == three
    tab.press("Delete demonstration")
    tab.says("demos", "2")
    tab.tells("demonstration 2 was deleted: Undo brings it back")
    told = [json.loads(line) for line in saved(tab, "Download events").splitlines()]
    assert "demonstration 2 was deleted: Undo brings it back" in [each["text"] for each in told]
    assert sorted(each["time"] for each in told) == [each["time"] for each in told]
    tab.press("Undo")
    tab.says("demos", "3")
    assert stack.model_file.read_bytes() == three
    upload(tab, "second.npz", file)
    expect(tab.tp("refusal")).to_contain_text("second.npz is learned already", timeout=WAIT_MS)
    choose_second(tab)
    tab.press("Delete demonstration")
    tab.says("demos", "2")
    upload(tab, "large.npz", bytes(MOST_FILE_BYTES + 1))
    expect(tab.tp("refusal")).to_contain_text("large.npz is empty, or too large", timeout=WAIT_MS)
    upload(tab, "second.npz", file)
    tab.says("demos", "3")
    choose_revision(tab, "1: 3 demonstrations")
    tab.press("Go to")
    tab.tells("revision 1 is current now")


def choose_second(tab: OperatorPage) -> None:
    tab.pick("Demonstration", tab.page.get_by_role("option").filter(has_text=re.compile("^2: ")))


def upload(tab: OperatorPage, name: str, content: bytes) -> None:
    """Choose a file, as in the browser's dialogue."""
    tab.page.locator("input[type=file]").set_input_files(
        {"name": name, "mimeType": "application/octet-stream", "buffer": content}
    )


def saved(tab: OperatorPage, label: str) -> bytes:
    """The file that the browser saves after a press of a button."""
    with tab.page.expect_download(timeout=WAIT_MS) as download:
        tab.press(label)
    return download.value.path().read_bytes()


def send_both(tab: OperatorPage) -> None:
    """Teach the other task too, send the library, and choose the first one again."""
    tab.choose_task("other")
    tab.says("demos", "0")
    tab.press("Load samples")
    tab.says("standing-other", "3 demonstrations, robot lacks it")
    tab.press("Send library")
    tab.says("standing-planar", "3 demonstrations, robot has it")
    tab.says("standing-other", "3 demonstrations, robot has it")
    tab.tells("send library: planar: confirmed after")
    tab.not_offered("Send library")
    tab.choose_task("planar")


def choose_revision(tab: OperatorPage, label: str) -> None:
    tab.pick("Revision", tab.page.get_by_role("option").filter(has_text=label))
