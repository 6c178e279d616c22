"""Studies: the paper's evaluation and what goes beyond. May import both sites; no site imports it."""
