"""Studies of the paper's claims on a point: the planar example, the approach task, ProMP, few shots, lambda.

In: synthetic demonstrations. Out: results. Next: `farhand.evaluation.metrics`.
"""
