"""Approach task as all studies use it: taught with the paper's lambda, executed under disturbances."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.evaluation.metrics.sensor import EXACT, TRACKER, Sensor
from farhand.evaluation.paper.approach_events import (
    Held,
    JumpingReceptacle,
    LateJumpingReceptacle,
    Push,
    Static,
    SwayingReceptacle,
)
from farhand.evaluation.paper.approach_task import (
    FAR_STARTS,
    LAMBDA_M,
    N_DEMONSTRATIONS,
    demonstrations,
    random_frame,
    turned_tool,
)
from farhand.evaluation.paper.closed_loop import Disturbance
from farhand.local_site.learning.online_learner import LearnerSettings
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import learn

Array = NDArray[np.float64]

SCENARIOS: dict[str, Callable[[TaskFrame, np.random.Generator], Disturbance]] = {
    "static": Static,
    "jump": JumpingReceptacle,
    "sway": SwayingReceptacle,
    "push": Push,
    "held": Held,
    "late jump": LateJumpingReceptacle,
}


def taught(
    seed: int,
    n: int = N_DEMONSTRATIONS,
    lambda_m: float = LAMBDA_M,
    oriented: bool = False,
    sensor: Sensor = TRACKER,
) -> tuple[list[Demonstration], TPHSMM]:
    """Return the synthetic hand's recorded demonstrations, and the model learned from them."""
    shown = demonstrations(np.random.default_rng([seed, 0]), n, oriented, sensor)
    return shown, learn(shown, LearnerSettings(lambda_m))


def hands(seed: int, n: int = N_DEMONSTRATIONS, oriented: bool = False) -> list[Demonstration]:
    """Return the same demonstrations without the sensor's errors."""
    return demonstrations(np.random.default_rng([seed, 0]), n, oriented, EXACT)


def scene(seed: int, scenario: str, oriented: bool = False) -> tuple[Disturbance, TaskFrame, Array]:
    """Return a trial's event, its receptacle, and the robot's first position or pose in the world."""
    random = np.random.default_rng([seed, 1])
    frame = random_frame(random)
    start = FAR_STARTS.sample(random)
    if oriented:
        start = np.concatenate([start, turned_tool(random)])
    return SCENARIOS[scenario](frame, random), frame, frame.to_world(start)


def stepping(model: TPHSMM) -> TPHSMM:
    """Return the same model without the ramp: the reference steps from mean to mean, as in the paper."""
    still = np.zeros_like(model.slopes)
    return replace(model, slopes=still, residual_covariances=model.covariances, ways=())
