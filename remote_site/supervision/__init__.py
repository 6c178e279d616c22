"""Robot's authority: judges every message, guards every control period, owns the mode.

In: messages and measurements. Out: replies, events, and which motion may run. Next:
`farhand.remote_site.motion.motion` moves the plant.
"""
