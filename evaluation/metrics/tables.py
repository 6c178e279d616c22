"""Tables and rates as Markdown, with Wilson's interval, and figures as files."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from farhand.common.whole_file import write_whole


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Format a Markdown table; numbers have three digits."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(_text(cell) for cell in line) + " |" for line in lines)


def rate(successes: Sequence[bool]) -> str:
    """Format a success rate in per cent, with Wilson's interval of 95 %."""
    n, k = len(successes), int(np.sum(successes))
    low, high = wilson_interval(k, n)
    return f"{k} of {n} = {100 * k / max(n, 1):.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


def spread(values: ArrayLike, scale: float = 1.0) -> str:
    """Format mean and standard deviation."""
    array = np.asarray(values, dtype=float)
    return f"{scale * np.mean(array):.2f} ± {scale * np.std(array):.2f}"


def quantiles(values: ArrayLike, scale: float = 1.0) -> str:
    """Format median and ninth decile."""
    middle, high = np.percentile(np.asarray(values, dtype=float), [50, 90])
    return f"{scale * middle:.3g} / {scale * high:.3g}"


def _text(cell: object) -> str:
    return f"{cell:.3g}" if isinstance(cell, float | np.floating) else str(cell)


_Z_95 = 1.959963984540054


def wilson_interval(successes: int, trials: int, z: float = _Z_95) -> tuple[float, float]:
    """Return the interval of a rate from its successes and trials, by default of 95 % (Wilson 1927).

    Raises:
        ValueError: When the counts are not successes among trials.
    """
    if trials < 0 or not 0 <= successes <= trials:
        raise ValueError(f"0 <= successes <= trials, got {successes} of {trials}")
    if trials == 0:
        return 0.0, 1.0
    rate, square = successes / trials, z * z / trials
    centre = (rate + square / 2) / (1 + square)
    half = z / (1 + square) * math.sqrt(rate * (1 - rate) / trials + square / (4 * trials))
    low = 0.0 if successes == 0 else max(0.0, centre - half)
    high = 1.0 if successes == trials else min(1.0, centre + half)
    return low, high


def write_figure(figure: Figure, file: Path, dpi: int = 130) -> None:
    """Write a figure as a file of the kind that its name ends in.

    Raises:
        OSError: When it cannot be written; its content is unchanged.
    """
    drawn = BytesIO()
    figure.savefig(drawn, format=file.suffix[1:], dpi=dpi)
    write_whole(file, drawn.getvalue())
