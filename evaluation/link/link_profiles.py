"""Effects of each link profile on models and telemetry, and of single precision on executions.

Both sites' own code in virtual time over each profile of `deploy/link_profiles.toml`, each message with
70 bytes for transport and network on top of its own: telemetry for a minute at rest and for a minute of
driving; the planar model, sent from the console; and a model of poses (five demonstrations of the synthetic
approach), which the planar robot answers, and refuses, when all of it is there. While that one is under way
somebody presses Stop. Age is that of what the operator sees, at every moment. (`link-profiles-real`: real
processes over the real relay.)

Single precision: the same executions with the model as it was learned, in double precision, and as it arrives,
rounded to single. Errors after the arrival: RMS over 10 s to the centre of the oscillating U on the board; at
the mouth, and of the turn, for poses. Bytes: of all arrays as learned, and of the model as it travels.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from farhand.common.impairment.link_profile import load_profiles
from farhand.common.model.model_file import decode, encode
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import ARRAY_FIELDS, TPHSMM
from farhand.deploy.link.link_process import PROFILES_FILE
from farhand.deploy.places import find_point_task
from farhand.evaluation.link import profile_jobs
from farhand.evaluation.metrics.motion_metrics import rms
from farhand.evaluation.metrics.tables import quantiles, table
from farhand.evaluation.paper.approach_trials import scene, taught
from farhand.evaluation.paper.closed_loop import execute
from farhand.evaluation.paper.planar import OscillatingU
from farhand.evaluation.study import reporting_seeds
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.samples import sample_strokes

Array = NDArray[np.float64]

Case = dict[str, Any]

LEAST_HZ, SLACK_S, ONE_WAYS = 0.5, 3.0, 2.0
_TRIALS = 50


def cases(trials: int | None, seed: int) -> list[Case]:
    """List each profile, and the executions."""
    profiles = [{"what": "profile", "profile": name} for name in load_profiles(PROFILES_FILE)]
    seeds = reporting_seeds(seed, trials or _TRIALS)
    return [*profiles, *({"what": kind, "seed": s} for kind in KINDS for s in seeds)]


def trial(case: Case) -> Case:
    """Run one case."""
    if case["what"] == "profile":
        return {**case, **profile_jobs.measure(case["profile"])}
    return {**case, **compare(case["what"], case["seed"])}


def age_limit_s(one_way_s: float) -> float:
    """Return the bound of the telemetry's age at the 95th percentile [s]."""
    return ONE_WAYS * one_way_s + SLACK_S


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Make one row per profile, and one per kind of model."""
    profiles = [r for r in results if r["what"] == "profile"]
    told = {kind: [r for r in results if r["what"] == kind] for kind in KINDS}
    summary: Case = {
        "profiles": {r["profile"]: holds(r) for r in profiles},
        "precision": {kind: _cost(part) for kind, part in told.items()},
    }
    summary["passed"] = all(summary["profiles"].values())
    lines = [
        "# Link profiles", "", _TEXT, "", verdict(summary["passed"]), "", _telemetry(profiles), "",
        _models(profiles), "", "## Single precision on the wire", "", _precision(told),
    ]  # fmt: skip
    return summary, "\n".join(lines)


def holds(result: Case) -> bool:
    """Decide whether telemetry is frequent and fresh enough, whatever else goes on."""
    return all(
        phase["rate_hz"] >= LEAST_HZ and phase["age_p95_s"] <= age_limit_s(result["one_way_s"])
        for phase in result["telemetry"].values()
    )


def verdict(passed: bool) -> str:
    """State the limits, and whether every profile keeps them."""
    return (
        f"Telemetry at least {LEAST_HZ:g} Hz and its age p95 at most {ONE_WAYS:g} x one way + {SLACK_S:g} s "
        f"{'on every profile' if passed else 'NOT on every profile'}."
    )


def seen(phase: Case) -> str:
    """Return rate and ages in words."""
    return f"{phase['rate_hz']:.2f} Hz, {phase['age_p50_s']:.2f} / {phase['age_p95_s']:.2f}"


def _telemetry(results: list[Case]) -> str:
    phases = list(results[0]["telemetry"])
    rows = [
        (r["profile"], f"{r['one_way_s']:.3g}", *(seen(r["telemetry"][phase]) for phase in phases))
        for r in results
    ]
    header = ("", "one way [s]", *(f"{phase}: rate, age p50 / p95 [s]" for phase in phases))
    return table(header, rows)


def _models(results: list[Case]) -> str:
    rows = [
        (
            r["profile"],
            *(
                f"{m['bytes']} B in {m['parts']} parts: {m['wire_bytes']} B there, {m['wire_back_bytes']} B back, "
                f"{m['took_s']:.2f} s"
                for m in r["models"].values()
            ),
            f"{r['stop_s']:.2f}",
        )
        for r in results
    ]
    names = list(results[0]["models"])
    return table(
        ("", *(f"{name}, on the wire, until answered" for name in names), "stop there after [s]"), rows
    )


def _cost(results: list[Case]) -> Case:
    return {
        measure: max(abs(r["single"][measure] - r["double"][measure]) for r in results)
        for measure in results[0]["double"]
    }


def _precision(told: dict[str, list[Case]]) -> str:
    rows = []
    for kind, part in told.items():
        for measure in part[0]["double"]:
            double, single = ([r[which][measure] for r in part] for which in ("double", "single"))
            worst = float(np.max(np.abs(np.subtract(single, double))))
            sizes = [np.median([r[name] for r in part]) for name in ("double_bytes", "single_bytes")]
            rows.append(
                (kind, measure, quantiles(double), quantiles(single), f"{worst:.1g}",
                 f"{sizes[0]:.0f} / {sizes[1]:.0f}", len(part))
            )  # fmt: skip
    header = (
        "", "error", "double, median / 90 %", "single, median / 90 %", "largest difference",
        "as learned / as it travels [B]", "n",
    )  # fmt: skip
    return table(header, rows)


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()


Measure = Callable[[TPHSMM], dict[str, float]]

KINDS = ("planar", "poses")
_AFTER_S = 10.0


def compare(kind: str, seed: int) -> Case:
    """Return the errors of both models, and their sizes [B]."""
    model, measure = _planar(seed) if kind == "planar" else _poses(seed)
    content = encode(model)
    return {
        "double": measure(model),
        "single": measure(decode(content)),
        "double_bytes": sum(getattr(model, name).nbytes for name in ARRAY_FIELDS),
        "single_bytes": len(content),
    }


def _planar(seed: int) -> tuple[TPHSMM, Measure]:
    """Learn the task's strokes, and measure an execution's distance from the U."""
    task = find_point_task("planar")
    strokes = sample_strokes(task, seed)
    settings = LearnerSettings(task.learning.max_distance_m or 0.22, task.learning.min_std_m)
    learner = OnlineLearner(settings, 2, task.frame_names)
    at = [TaskFrame(np.eye(2), np.array(task.target.origin_m))]
    for stroke in strokes:
        learner.start()
        learner.observe_many(stroke.position_m, at, stroke.time_s.tolist())
        learner.end()

    def measure(model: TPHSMM) -> dict[str, float]:
        event = OscillatingU(task, seed)
        done = execute(model, strokes[seed % len(strokes)].position_m[0], event, rest_s=_AFTER_S)
        after = done.time_s > done.time_s[-1] - _AFTER_S
        return {"after the arrival [mm]": 1e3 * rms(done.world[after] - event.truth(done.time_s[after]))}

    return learner.model(), measure


def _poses(seed: int) -> tuple[TPHSMM, Measure]:
    """Learn the synthetic approach, and measure where an execution ends."""

    def measure(model: TPHSMM) -> dict[str, float]:
        event, _, start = scene(seed, "static", oriented=True)
        done = execute(model, start, event, rest_s=1.0)
        end_mm = 1e3 * float(np.linalg.norm(done.local[-1]))
        return {"at the mouth [mm]": end_mm, "turn [deg]": float(done.turn_deg[-1])}

    return taught(seed, oriented=True)[1], measure
