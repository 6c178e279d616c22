"""Tables and rates as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from farhand.evaluation.metrics.statistics import wilson_interval


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table; numbers with three digits."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(_text(cell) for cell in line) + " |" for line in lines)


def rate(successes: Sequence[bool]) -> str:
    """Successes of trials in per cent, with Wilson's interval of 95 %."""
    n, k = len(successes), int(np.sum(successes))
    low, high = wilson_interval(k, n)
    return f"{k} of {n} = {100 * k / max(n, 1):.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


def spread(values: ArrayLike, scale: float = 1.0) -> str:
    """Mean and standard deviation."""
    array = np.asarray(values, dtype=float)
    return f"{scale * np.mean(array):.2f} ± {scale * np.std(array):.2f}"


def quantiles(values: ArrayLike, scale: float = 1.0) -> str:
    """Median and ninth decile."""
    middle, high = np.percentile(np.asarray(values, dtype=float), [50, 90])
    return f"{scale * middle:.3g} / {scale * high:.3g}"


def _text(cell: object) -> str:
    return f"{cell:.3g}" if isinstance(cell, float | np.floating) else str(cell)
