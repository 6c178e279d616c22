"""Several robots and operators: the hub's process, who is at a hub, and one operator's sites for several robots.

In: endpoints, certificates, names of robots. Out: processes. Next: `farhand.common.link.hub` routes and holds the rights.
"""
