"""Files, messages and option values as nobody wrote them: mutated by the hundred thousand, given to the shipped code.

In: what the product writes itself. Out: each is refused in one line, or accepted and right. Next: `study`.
"""
