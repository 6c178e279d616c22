"""Scene of the planar task: the operator's board and the robot's board, seen from above.

In: the console's picture. Out: nodes of the scene; strokes and drags become intents. Next:
`farhand.local_site.view.page` owns it.
"""
