"""Insertion skill: estimates the receptacle by sight and touch, detects jams, retreats and retries.

In: the sensed state and the wrench on the tool. Out: corrected task frames, and where to retreat to. Next:
`farhand.remote_site.motion.motion` follows them. No simulation is imported here.
"""
