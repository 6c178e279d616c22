"""Types of the method: manifolds, task frames and the TP-HSMM, with the compiled linear algebra below them.

In: arrays. Out: immutable models and the bytes of a model file. Next: `farhand.common.wire` carries models;
`farhand.local_site.learning` makes them and `farhand.remote_site.reproduction` executes them.
"""
