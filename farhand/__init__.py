"""Supervisory teleoperation: demonstrate a motion here, let a far-away arm execute the learned model.

The five packages are folders of the repository's top level, linked here so that an installed Farhand occupies one
name only: `common` (what both sites agree on), `local_site`, `remote_site`, `deploy` and `evaluation`.
"""
