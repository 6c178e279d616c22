"""Scene of an arm's task: both arms with their receptacles, model, path and ghost.

In: the console's picture and the robot's description. Out: nodes of the scene; drags become intents. Next:
`farhand.local_site.view.page` owns it.
"""
