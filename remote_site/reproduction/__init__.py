"""Reproduction of a learned motion, Sec. III-B of the paper (sequence, reference, MPC).

In: a model, the task frames as they are now, and the state of the arm. Out: an acceleration for each control period.
Next: `farhand.remote_site.motion` runs an execution as one of the robot's motions.
"""
