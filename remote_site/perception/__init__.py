"""Sight of the task frames: measurements, filters, and how long an unseen target is predicted.

In: late and noisy measurements. Out: estimated task frames with their age. Next:
`farhand.remote_site.supervision` guards on them; `farhand.remote_site.motion.motion` follows them.
"""
