"""Motion of the plant in one control period: by the operator's hand, an execution, a manoeuvre, or nothing.

In: the sensed state, a model, a coupling. Out: an acceleration for the plant; previews (`preview_worker`, `plans`) and committed paths.
Next: `farhand.remote_site.reproduction` computes an execution.
"""
