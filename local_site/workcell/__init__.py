"""Workcell: the operator's own arm or board; the hand moves it, demonstrations are taken from it.

In: where the hand wants the tool. Out: where the tool really is, with the task frames seen from it. Next:
`farhand.local_site.console.teaching` records the reached poses.
"""
