"""Exhaustive check of the modes: every event in every order against independent rules.

In: the shipped supervisor. Out: states, transitions, mutants found. Next: `farhand.evaluation.harness`.
"""
