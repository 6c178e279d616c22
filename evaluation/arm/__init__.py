"""Studies of the simulated arm with contact: insertion, removal, robustness, soak.

In: the arm's samples. Out: results. Next: `farhand.evaluation.metrics`.
"""
