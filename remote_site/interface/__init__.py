"""Interface that a robot of your own implements: plant, perception, embodiment.

In: accelerations. Out: measured state. Next: `farhand.remote_site.robots` has two examples.
"""
