"""Demonstrations: recorded, kept on disk, learned in order, undone, and grouped into revisions of a task.

In: points with their task frames, or recordings from files. Out: the model of a task; its undo (`lesson`) and revisions. Next:
`farhand.local_site.learning` turns datapoints into a model; `farhand.local_site.console.console` decides
when.
"""
