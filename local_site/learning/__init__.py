"""Online model learning, Sec. III-A of the paper (Algorithm 1, count form)."""
