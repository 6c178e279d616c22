"""Connection between the two sites: priorities, byte budgets, newest-only flows, and its health.

In: bytes with a channel. Out: bytes at the other site, or nothing: a lost message raises no error. Next:
`farhand.common.impairment.impairment` makes a link slow and lossy on purpose.
"""
