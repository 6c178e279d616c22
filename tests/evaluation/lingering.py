"""A study whose trials leave a thread behind, as one that closes a connection."""

from __future__ import annotations

import threading
import time

from farhand.evaluation.study import Case

LASTS_S = 120.0


def cases(trials: int | None, seed: int) -> list[Case]:
    return [{"seed": seed + k} for k in range(trials or 1)]


def trial(case: Case) -> Case:
    threading.Thread(target=time.sleep, args=(LASTS_S,)).start()
    return case


def summarise(results: list[Case]) -> tuple[Case, str]:
    return {"trials": len(results)}, "# Lingering"
