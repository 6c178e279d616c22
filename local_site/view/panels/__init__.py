"""Flat parts of the page: status, buttons, library, events, link, guidance.

In: the console's picture. Out: HTML and controls, sent only when they change; presses become intents. Next:
`farhand.local_site.console.console` handles the intents.
"""
