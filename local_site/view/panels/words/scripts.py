"""Words of the page's scripts, which run in the browser: tabs, narrow window, a silent server, and the tour of five cards."""

from __future__ import annotations

import json
import re

from farhand.local_site.view.panels.words.controls import Folder, Label

_TOUR = (
    (
        "Two halves",
        "Left, blue: your own arm or board, a simulation. Right, amber: the robot as last reported. Grey is old.",
    ),
    (
        "STOP",
        "The red button, or Escape, stops the robot, in every tab. Over a dead link it is sent until the robot confirms it. "
        "It is no emergency stop.",
    ),
    (
        "The next step",
        "This line names the next step and has its buttons, the first one filled. A refusal stands here in red.",
    ),
    (
        "Teach, send, arm, preview, execute",
        "Record teaches your own arm, Send gives the robot the model, Arm allows motion, Preview shows the path in magenta, "
        "Execute runs it, even if the link dies.",
    ),
    (
        "What was, and the rest",
        "Drag along the timeline to look back. More has all other actions; Help shows these cards again.",
    ),
)  # fmt: skip
"""Title and text of each card; the numbers of the cards name in page.css what each is about."""

_NARROW_BUTTONS = (Label.PAUSE, Label.RESUME, Label.ABORT)
_ELSEWHERE = re.compile(
    rf"\b({'|'.join(re.escape(each) for each in (*Label, *Folder) if each not in (Label.STOP, *_NARROW_BUTTONS))}|the key)\b"
)
"""Buttons, folders and keys that a narrow window lacks."""

_WORDS = {
    "tabs": ("Timeline", "Executions", "Demonstrations", "Model", "Link", "Events"),
    "narrowButtons": _NARROW_BUTTONS,
    "narrow": "This window is too narrow for more: it watches, stops, pauses and aborts. From 700 px on it does all.",
    "noNews": "NO NEWS from the local site for {} s: what you see is old, and STOP cannot be sent from here. "
    "Stop the robot at its own site, or start farhand local again.",
    "more": "More",
    "close": "Close",
    "details": "Details",
    "past": "the robot is shown as it was, not now",
    "tour": {
        "open": "Help",
        "card": "Tour, card {} of {}",
        "back": "Back",
        "next": "Next",
        "end": "Done",
        "close": "Skip the tour",
        "cards": _TOUR,
    },
}


def in_narrow_window(words: str) -> str:
    """Return an advice as a narrow window gives it: what names a control that is not there needs a larger window."""
    return f"{words} Do that in a larger window." if _ELSEWHERE.search(words) else words


def script_words() -> str:
    """Return the words as a line of JavaScript, to run before the page's scripts."""
    return f"window.farhandWords = {json.dumps(_WORDS)};"
