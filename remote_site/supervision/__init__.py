"""Robot's authority: judges every message, guards every control period, owns the mode.

In: messages and measurements. Out: replies, events, and which motion may run: commands, `stop`, `guards` and
`operator_silence` change the mode in `mode_machine`, by `farhand.common.mode_table`. Next:
`farhand.remote_site.motion.motion` moves the plant.
"""
