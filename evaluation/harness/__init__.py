"""Harness: both sites in one process and virtual time, or as real processes, for studies and tests.

In: configurations. Out: a running robot, link and console. Next: the shipped code itself.
"""
