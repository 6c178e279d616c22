"""Shared by both sites: the model, the wire, tasks, the link, impairments and the arm, each built on those before it.

In: nothing of either site. Out: types that both sites share. Beside the folders: what is allowed in which mode
(`mode_table`), configurations, clocks, logs, reading and writing of files.
"""
