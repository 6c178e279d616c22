"""Operator's console: every intent and report passes one queue; its owner alone changes state.

In: intents (from the page or the script) and reports. Out: requests to the robot and one immutable picture.
Next: `farhand.local_site.view` draws the picture; `farhand.local_site.exchange` carries the requests.
"""
