"""Operator's web page: draws the console's picture, and turns clicks and drags into intents.

In: the console's picture. Out: intents to the console. Next: `panels` for buttons and texts, `scene` for
everything drawn in space.
"""
