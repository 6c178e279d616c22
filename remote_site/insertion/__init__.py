"""The insertion skill: touch, jams, retries, and the contact's correction of the receptacle's estimated frame.

In: the sensed state and the wrench. Out: corrected task frames, and where to retreat to.
Next: `farhand.remote_site.motion.motion` follows; nothing here knows a simulation.
"""
