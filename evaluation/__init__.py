"""Studies: the paper's evaluation and what goes beyond it. No site imports them.

In: the shipped code of both sites. Out: `DIR/STUDY.json` and `DIR/STUDY.md`, written by `study`. Next:
`paper`, `human`, `arm`, `live`, `link`, `modes`; `harness` and `metrics` serve all of them.
"""
