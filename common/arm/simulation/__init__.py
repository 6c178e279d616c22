"""Simulated arm, receptacle and water: physics, scenery and pictures.

In: joint velocities. Out: measured joints, wrench, contacts, and the truth that judges a task. Next:
`farhand.remote_site.robots` and `farhand.local_site.workcell` put a controller in front of the simulation.
"""
