"""Assignment of a datapoint to a component when several task frames see it.

The paper leaves open how the distances in P frames become one. Four rules (see
`farhand.local_site.learning.dp_means`) learn the same six demonstrations of a task in which both frames matter, base
and handle; of the same with a third frame, a bystander that has nothing to do with it; and of the handle
beside the bystander alone; and of base and handle beside two bystanders, by the default rule. Each model is executed in a new scene, from the base, on the point plant, and
compared with the way that the hand means to go there. Success: the end within 5 mm, leaving the base and
coming to the handle within 20 degrees of their axes over 5 cm. *Dropped*: the share of bystanders that `farhand model
show` advises to drop, and of models of which it would drop base or handle.
"""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from farhand.common.errors import InvalidInput
from farhand.common.model.gaussian_product import frame_shares, idle_frames
from farhand.common.model.tphsmm import TPHSMM
from farhand.evaluation.metrics.motion_metrics import dtw_rms
from farhand.evaluation.metrics.tables import rate, spread, table, write_figure
from farhand.evaluation.paper.handle_task import (
    LAMBDA_M,
    N_DEMONSTRATIONS,
    HandleScene,
    demonstrate,
    random_scene,
)
from farhand.evaluation.study import Case, reporting_seeds
from farhand.local_site.learning.dp_means import FRAME_RULES
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.remote_site.reproduction.point_rollout import roll_out

Array = NDArray[np.float64]

FRAMES = {
    "base, handle": ("base", "handle"),
    "base, bystander, handle": ("base", "bystander", "handle"),
    "bystander, handle": ("bystander", "handle"),
    "base, two bystanders, handle": ("base", "bystander", "passer_by", "handle"),
}
_TRIALS = 40  # trials of each rule and set of frames
_TWO, _TRIALS_OF_TWO = "base, two bystanders, handle", 100  # by the default rule alone
_DEFAULT = LearnerSettings(LAMBDA_M).frame_rule
_IDLE = ("bystander", "passer_by")
_MAX_END_M, _MAX_ANGLE_DEG, _OVER_M = 0.005, 20.0, 0.05


def cases(trials: int | None, seed: int) -> list[Case]:
    """List every rule and set of frames with the same seeds."""
    return [
        {"seed": s, "frames": frames, "rule": rule}
        for frames, rule in product(FRAMES, FRAME_RULES)
        if frames != _TWO or rule == _DEFAULT
        for s in reporting_seeds(seed, trials or (_TRIALS_OF_TWO if frames == _TWO else _TRIALS))
    ]


def trial(case: Case) -> Case:
    """Learn six demonstrations, execute in a new scene."""
    random, names = np.random.default_rng([case["seed"], 0]), FRAMES[case["frames"]]
    model = taught(random, names, LearnerSettings(LAMBDA_M, frame_rule=case["rule"]))
    scene = random_scene(random)
    frames, way = scene.frames(names), scene.path()
    idle = {names[j] for j in idle_frames(frame_shares(model.residual_covariances), model.counts)}
    result = {
        **case,
        "n_components": int((~model.terminal).sum()),
        "idle_found": len(idle & set(_IDLE)) / max(1, len(set(names) & set(_IDLE))),
        "idle_wrong": bool(idle - set(_IDLE)),
    }
    try:
        motion = roll_out(model, scene.base.b, lambda t: frames)
    except InvalidInput:  # refused: it starts behind the goal
        return {**result, "success": False, "dtw_rms_m": float("nan"), "end_m": float("nan")}
    path = motion.position_m
    end_m = float(np.linalg.norm(path[-1] - scene.handle.b))
    angles = _angles_deg(scene, path)
    success = motion.arrived and end_m <= _MAX_END_M and max(angles) <= _MAX_ANGLE_DEG
    return {
        **result,
        "success": bool(success),
        "dtw_rms_m": dtw_rms(path, way),
        "end_m": end_m,
        "leaving_deg": angles[0],
        "coming_deg": angles[1],
    }


def taught(random: np.random.Generator, names: tuple[str, ...], settings: LearnerSettings) -> TPHSMM:
    """Learn a model from six demonstrations in random scenes."""
    learner = OnlineLearner(settings, 2, names)
    for _ in range(N_DEMONSTRATIONS):
        shown = demonstrate(random, random_scene(random), names)
        learner.start()
        learner.observe_many(shown.position_m, shown.frames_at(0), shown.time_s)
        learner.end()
    return learner.model()


def _angles_deg(scene: HandleScene, path: Array) -> tuple[float, float]:
    """Return the angles of the first 5 cm with the base's axis, and of the last with the handle's."""
    left = path[np.argmax(np.linalg.norm(path - path[0], axis=1) > _OVER_M)] - path[0]
    came = path[-1 - np.argmax(np.linalg.norm(path[::-1] - path[-1], axis=1) > _OVER_M)] - path[-1]
    return _angle_deg(left, scene.base.A[:, 1]), _angle_deg(came, scene.handle.A[:, 1])


def _angle_deg(a: Array, b: Array) -> float:
    length = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(np.degrees(np.arccos(np.clip(a @ b / length, -1.0, 1.0)))) if length > 0.0 else 180.0


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Make one row for each set of frames and rule."""
    summary: Case = {}
    rows = []
    for frames, rule in product(FRAMES, FRAME_RULES):
        part = [r for r in results if (r["frames"], r["rule"]) == (frames, rule)]
        if not part:
            continue
        column = {key: np.array([r.get(key, np.nan) for r in part]) for key in _MEASURES}
        summary[f"{frames}: {rule}"] = {key: float(np.nanmean(v)) for key, v in column.items()}
        rows.append(
            (
                frames,
                rule,
                f"{column['n_components'].mean():.1f}",
                spread(column["dtw_rms_m"][~np.isnan(column["dtw_rms_m"])], 100),
                f"{1e3 * np.nanmedian(column['end_m']):.1f}",
                f"{np.nanmedian(column['leaving_deg']):.1f}, {np.nanmedian(column['coming_deg']):.1f}",
                rate(column["success"].astype(bool).tolist()),
                f"{100 * column['idle_found'].mean():.0f} %, {100 * column['idle_wrong'].mean():.0f} %",
            )
        )
    header = (
        "frames",
        "rule",
        "components",
        "RMSE, DTW [cm]",
        "end [mm]",
        "leaving, coming [deg]",
        "success",
        "dropped",
    )
    text = (
        f"The default is `{_DEFAULT}`. Without the base's frame nobody can know how the base is "
        "turned, so that bystander and handle alone leave it anyhow."
    )
    return summary, "\n".join(
        ["# Assignment with several frames", "", _TEXT, "", table(header, rows), "", text]
    )


_TEXT = (__doc__ or "").strip()
_MEASURES = (
    "n_components",
    "success",
    "dtw_rms_m",
    "end_m",
    "leaving_deg",
    "coming_deg",
    "idle_found",
    "idle_wrong",
)


def draw(results: list[Case], out_dir: Path) -> list[str]:
    """Draw components and errors of each rule."""
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    panels = (("n_components", 1.0, "components"), ("dtw_rms_m", 100.0, "RMSE, DTW [cm]"))
    for axes, (key, scale, label) in zip(figure.subplots(1, 2), panels, strict=True):
        for number, frames in enumerate(frames for frames in FRAMES if frames != _TWO):
            values = [
                [scale * r[key] for r in results if (r["frames"], r["rule"]) == (frames, rule)]
                for rule in FRAME_RULES
            ]
            at = np.arange(len(FRAME_RULES)) + 0.25 * (number - 1)
            axes.errorbar(at, [np.nanmean(v) for v in values], [np.nanstd(v) for v in values], fmt="o", capsize=3, label=frames)  # fmt: skip
        axes.set_xticks(range(len(FRAME_RULES)), FRAME_RULES)
        axes.set(ylabel=label, ylim=(0, None))
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    write_figure(figure, out_dir / "assignment.png")
    return ["assignment.png"]
