"""Online model learning, Sec. III-A of the paper (Algorithm 1, count form).

In: datapoints of a demonstration, one after the other. Out: a `farhand.common.model.tphsmm.TPHSMM`, and no
datapoint kept. Next: `farhand.local_site.teaching` asks for models and keeps revisions; the robot executes them.
"""
