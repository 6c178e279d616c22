"""What moves the plant in one control period: the operator's hand, an execution, a manoeuvre, or nothing.

In: the sensed state, a model, a coupling. Out: an acceleration for the plant; previews and committed paths.
Next: `farhand.remote_site.reproduction` computes an execution.
"""
