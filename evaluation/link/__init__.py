"""Studies of the link: delay, loss, outages, freshness, random faults.

In: both sites in virtual or real time. Out: results. Next: `farhand.evaluation.harness`.
"""
