"""Words of the page's scripts, which run in the browser: tabs, narrow window, a silent server, and the tour of five cards."""

from __future__ import annotations

import json

_TOUR = (
    (
        "Two halves",
        "Left and blue is your own arm or board, a simulation. Right and amber is the robot as it last reported, with "
        "the age of that report. What is grey is old.",
    ),
    (
        "STOP",
        "The red button and the Escape key stop the robot, in every tab and at every moment. Over a dead link the stop is "
        "sent again until the robot confirms that it stands. It is no emergency stop: keep one at the robot.",
    ),
    (
        "The next step",
        "This line always names the next step and has its buttons, the first one filled. What is impossible now is not "
        "drawn. A refusal stands here in red, with its reason.",
    ),
    (
        "Teach, send, arm, preview, execute",
        "Record shows the task to your own arm, Send model carries what was learned to the robot, Arm allows it to move, "
        "Preview shows its path in magenta, Execute runs it: on its own, also while the link is down.",
    ),
    (
        "What was, and the rest",
        "Drag along the timeline to see the robot as it was; Back to now returns. The other tabs list executions and "
        "demonstrations. More opens all that is possible beside the next step. Help shows these cards again.",
    ),
)  # fmt: skip
"""Title and text of each card; the numbers of the cards name in page.css what each is about."""

_WORDS = {
    "tabs": ("Timeline", "Executions", "Demonstrations", "Model", "Link", "Events"),
    "narrowButtons": ("Pause", "Resume", "Abort"),
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


def script_words() -> str:
    """Return the words as a line of JavaScript, to run before the page's scripts."""
    return f"window.farhandWords = {json.dumps(_WORDS)};"
