"""Shared by both sites: files, modes and tasks; below them the model, the wire, the link and the arm.

In: nothing of either site. Out: types that both sites share. Next: `model`, then `wire`, `link`, `arm`.
"""
