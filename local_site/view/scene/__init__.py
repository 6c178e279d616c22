"""Scene of the page in space: shapes shared by both scenes; `arm` and `board` draw the two kinds of robot.

In: the console's picture. Out: nodes of the 3-D scene, sent only when they change. Next: `arm` and `board`.
"""
