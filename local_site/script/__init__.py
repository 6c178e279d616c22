"""Scripted operator: does the whole job through the same intents as a person at the page.

In: the console's picture. Out: intents, and the result that `farhand demo --json` writes. Next:
`farhand.local_site.console.console`.
"""
