"""Shared by both sites: files, tasks, and what is allowed in which mode (`mode_table`); below them the model, the wire, the link and the arm.

In: nothing of either site. Out: types that both sites share. Next: `model`, then `wire`, `link`, `arm`.
"""
