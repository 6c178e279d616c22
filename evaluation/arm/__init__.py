"""Studies of the simulated arm with contact: insertion, extraction, robustness, soak.

In: the arm's samples. Out: results. Next: `farhand.evaluation.metrics`.
"""
