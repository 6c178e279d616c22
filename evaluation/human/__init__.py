"""Studies on people's own demonstrations: leave one out, learn, reproduce.

In: recordings of people. Out: results. Next: `farhand.evaluation.metrics`.
"""
