"""Robots: the paper's point, and an arm with a plug in front of a receptacle.

In: a task and the configuration. Out: an embodiment: plant, perception, skills. Next:
`farhand.remote_site.motion.motion` uses them through `farhand.remote_site.interface`.
"""
