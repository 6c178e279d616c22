"""Measures of motions, peers to compare with, statistics and tables.

In: motions and counts. Out: errors, intervals, rows of tables. Next: every study.
"""
