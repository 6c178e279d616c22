"""A study of coins, for the tests of the runner: its trials tell in which process they ran."""

from __future__ import annotations

import math
import os
from typing import Any

import numpy as np

from farhand.common.errors import InvalidConfiguration
from farhand.evaluation.study import reporting_seeds

Case = dict[str, Any]


def cases(trials: int | None, seed: int) -> list[Case]:
    return [{"seed": each} for each in reporting_seeds(seed, trials or 5)]


def trial(case: Case) -> Case:
    if case["seed"] == next(iter(reporting_seeds(13, 1))):
        raise InvalidConfiguration("coin", "edge", "a side")
    heads = np.random.default_rng(case["seed"]).random() < 0.5
    return {**case, "success": heads, "process": os.getpid(), "undefined": math.nan}


def summarise(results: list[Case]) -> tuple[Case, str]:
    n = sum(result["success"] for result in results)
    return {"heads": np.int64(n), "share": np.float64(n / len(results))}, f"# Coins\n\n{n} heads"
