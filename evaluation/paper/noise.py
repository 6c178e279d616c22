"""Effect of a sensor's noise on what is taught: it should have none.

The same hands, recorded by an exact sensor and by worse ones: white noise, noise that is correlated over 0.3 s,
other rates, quantised positions, drop-outs, a marker that is lost every other second on average for up to 0.2 s
and reported up to half a metre away. White noise is per axis; "mm, degrees" name both.

*Synthetic hot-stab*: five demonstrations (see `hot-stab-point`), executed from a new start. *Way* counts only what
lies inside of the motion: the last 5 cm within 5 degrees of the axis and 5 mm beside it, seen from where the motion ended;
where the demonstrations ended may be off by the mean of the sensor's error. *Samples*: the five demonstrations
that come with the task of the arm. *People*: every fold of their recordings (see `human`), taught with a millimetre
of noise and without, beside a ProMP of the paper's setting; the letters and the handwriting are some centimetres large.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.tphsmm import TPHSMM
from farhand.deploy.rollout import roll_out
from farhand.evaluation.arm.hot_stab import recorded
from farhand.evaluation.human.human_report import SETS, files, fold, recordings
from farhand.evaluation.metrics.baselines import PAPER, PrompBaseline
from farhand.evaluation.metrics.motion_metrics import MAX_ANGLE_DEG, MAX_LATERAL_M, approach_of, arc_rms
from farhand.evaluation.metrics.sensor import EXACT, TRACKER, Sensor
from farhand.evaluation.metrics.tables import quantiles, rate, table
from farhand.evaluation.paper.approach_task import LAMBDA_M
from farhand.evaluation.paper.approach_trials import scene, taught
from farhand.evaluation.paper.closed_loop import execute
from farhand.evaluation.study import Case, reporting_seeds
from farhand.local_site.learning.online_learner import LearnerSettings
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import learn

Array = NDArray[np.float64]


def _white(mm: float, degrees: float, **other: float) -> Sensor:
    return Sensor(white_m=1e-3 * mm, white_rad=math.radians(degrees), **other)


SENSORS = {
    "exact": EXACT,
    "0.5 mm, 0.2 degrees": _white(0.5, 0.2),
    "1 mm, 0.5 degrees": TRACKER,
    "2 mm, 1 degree": _white(2.0, 1.0),
    "4 mm, 2 degrees": _white(4.0, 2.0),
    "1 mm, 0.5 degrees, 100 Hz": _white(1.0, 0.5, rate_hz=100.0),
    "2 mm, 1 degree, 100 Hz": _white(2.0, 1.0, rate_hz=100.0),
    "1 mm, 0.5 degrees, 10 Hz": _white(1.0, 0.5, rate_hz=10.0),
    "1 mm, 0.5 degrees, 1 kHz": _white(1.0, 0.5, rate_hz=1000.0),
    "correlated 2 mm, 1 degree": Sensor(coloured_m=0.002, coloured_rad=math.radians(1.0)),
    "quantised, 2 mm": Sensor(quantum_m=0.002),
    "a fifth missing, 1 mm, 0.5 degrees": _white(1.0, 0.5, missing=0.2),
    "marker lost, 1 mm, 0.5 degrees": _white(1.0, 0.5, jumps_hz=0.5),
}
_TRIALS = 200  # trials of each sensor


def cases(trials: int | None, seed: int) -> list[Case]:
    """List every sensor, with the same seeds and on the samples, and all folds of people's recordings."""
    seeds = reporting_seeds(seed, trials or _TRIALS)
    hands: list[Case] = [{"kind": "hand", "sensor": name, "seed": s} for name in SENSORS for s in seeds]
    samples: list[Case] = [{"kind": "samples", "sensor": name} for name in SENSORS]
    people: list[Case] = [
        {"kind": name, "file": str(file), "left_out": k, "seed": seed}
        for name in SETS
        for file in files(name)
        for k in range(len(recordings(name, str(file))))
    ]
    return hands + samples + (people if trials is None else people[:: max(1, len(people) // trials)])


def trial(case: Case) -> Case:
    """Learn one model, and measure its executions."""
    if case["kind"] == "hand":
        return {**case, **_hand(case["seed"], SENSORS[case["sensor"]])}
    if case["kind"] == "samples":
        model = learn(recorded(SENSORS[case["sensor"]]), LearnerSettings(LAMBDA_M))
        return {**case, **_size(model)}
    taught_by, last = fold(case["kind"], case["file"], case["left_out"])
    random = np.random.default_rng([case["seed"], case["left_out"]])
    noisy = [Sensor(white_m=0.001).record(d, random) for d in taught_by]
    motion = last.in_frame()
    exact_m, noisy_m = (
        {
            "ours": arc_rms(roll_out(learn(shown), last).in_frame(), motion),
            "ProMP": arc_rms(_promp(shown, motion), motion),
        }
        for shown in (taught_by, noisy)
    )
    return {**case, "exact_m": exact_m, "noisy_m": noisy_m}


def _promp(shown: list[Demonstration], motion: Array) -> Array:
    """Return what the paper's ProMP makes of the demonstrations, from a motion's start to its end."""
    promp = PrompBaseline.fit([d.time_s for d in shown], [d.in_frame() for d in shown], PAPER)
    return promp.motion((0.0, motion[0]), (1.0, motion[-1]))


def _hand(seed: int, sensor: Sensor) -> Case:
    _, exact = taught(seed, oriented=True, sensor=EXACT)
    _, model = taught(seed, oriented=True, sensor=sensor)
    event, _, start = scene(seed, "static", oriented=True)
    executed = execute(model, start, event, rest_s=1.0)
    approach, inside = approach_of(executed.local), approach_of(executed.local - executed.local[-1])
    way = inside.angle_deg <= MAX_ANGLE_DEG and inside.lateral_m <= MAX_LATERAL_M
    return {
        **_size(model),
        "components_ratio": _size(model)["n_components"] / _size(exact)["n_components"],
        "duration_ratio": _size(model)["duration_s"] / _size(exact)["duration_s"],
        "end_m": approach.end_m,
        "success": bool(executed.arrived and approach.success),
        "way": bool(executed.arrived and way),
    }


def _size(model: TPHSMM) -> Case:
    """Return components, paths, ends, and the mean duration of the demonstrations."""
    into = model.initial * model.n_demonstrations
    visits = np.linalg.solve(np.eye(model.n_components) - model.transition.T, into)
    return {
        "n_components": int((~model.terminal).sum()),
        "n_ends": int(model.terminal.sum()),
        "n_paths": model.n_paths,
        "duration_s": float(model.duration_mean_s @ visits / model.n_demonstrations),
    }


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Make one row for each sensor, and one for each set of people's recordings."""
    summary: Case = {}
    rows = []
    for name in SENSORS:
        part = [r for r in results if r.get("sensor") == name]
        hand = [r for r in part if r["kind"] == "hand"]
        samples = next(r["n_components"] for r in part if r["kind"] == "samples")
        success, way = [r["success"] for r in hand], [r["way"] for r in hand]
        ratio = float(np.mean([r["components_ratio"] for r in hand]))
        summary[name] = {
            "components_ratio": ratio,
            "samples": samples,
            "success_rate": float(np.mean(success)),
            "way_rate": float(np.mean(way)),
        }
        rows.append(
            (
                name,
                f"{np.mean([r['n_components'] for r in hand]):.1f}",
                f"{ratio:.2f}",
                f"{np.mean([r['duration_ratio'] for r in hand]):.2f}",
                f"{np.mean([r['n_ends'] for r in hand]):.2f}",
                rate(success),
                rate(way),
                quantiles([r["end_m"] for r in hand], 1e3),
                str(samples),
            )
        )
    header = ("sensor", "components", "/ exact", "duration / exact", "ends", "success", "way", "end [mm], median / 90 %", "components of the samples")  # fmt: skip
    lines = ["# Noise of the sensor", "", _TEXT, "", table(header, rows)]
    people = []
    for name in SETS:
        part = [r for r in results if r["kind"] == name]
        if part:
            row, summary[name] = [name, str(len(part))], {}
            for method in ("ours", "ProMP"):
                exact, noisy = (float(np.mean([r[k][method] for r in part])) for k in ("exact_m", "noisy_m"))
                summary[name][method] = {"exact_m": exact, "noisy_m": noisy, "ratio": noisy / exact}
                row += [f"{1e3 * exact:.2f}", f"{1e3 * noisy:.2f}", f"{noisy / exact:.3f}"]
            people.append(row)
    header = ("people", "folds", "ours [mm]", "with noise [mm]", "ratio (at most 1.05)", "ProMP [mm]", "with noise [mm]", "ratio")  # fmt: skip
    return summary, "\n".join([*lines, "", table(header, people)])


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()
