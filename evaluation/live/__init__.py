"""Studies of the whole job with real processes in real time.

In: `farhand` processes. Out: results. Next: `farhand.evaluation.harness`.
"""
