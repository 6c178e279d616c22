"""Reproduction of a learned motion, Sec. III-B of the paper (sequence, reference, MPC)."""
