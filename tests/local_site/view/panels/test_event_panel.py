"""What the event panel says."""

from __future__ import annotations

from farhand.local_site.exchange.notices import Notice
from farhand.local_site.view.panels.words.lists import event_words, robot_clock


def test_a_line_names_who_and_what_in_words_that_say_what_was_measured_with_its_unit() -> None:
    assert event_words(Notice(0.0, "arm", "completed")) == "arm: completed"
    assert event_words(Notice(0.0, "executing", "executing hot-stab")) == "executing hot-stab"
    refused = Notice(0.0, "execute", "refused: it moved 12 mm", good=False, measured=0.012, who="pier 2")
    assert event_words(refused) == "execute [pier 2]: refused: it moved 12 mm"


def test_an_event_that_an_outage_held_up_says_so() -> None:
    event = Notice(50.0, "force", "backing off", robot_s=900.0, late_s=19.7)
    assert event_words(event) == "force: backing off, heard 20 s later"
    assert "900.00 s on the robot's clock" in robot_clock(event)
    assert "heard" not in event_words(Notice(50.0, "force", "backing off", robot_s=900.0, late_s=0.04))
