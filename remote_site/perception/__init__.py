"""Sight of the task frames: measurements, filters, and what counts as seen.

In: late and noisy measurements. Out: estimated task frames with their age.
Next: `farhand.remote_site.supervision` guards on them; `farhand.remote_site.motion.motion` follows them.
"""
