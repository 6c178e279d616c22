"""Supervisory teleoperation: demonstrate a motion here, let a far-away arm execute the learned model.

The names below are the public face for library users: the method, and what a robot of one's own implements
(`farhand.testing` checks it). They are imported when first used, so that `import farhand` costs nothing.

The packages are folders of the repository's top level, linked here so that an installed Farhand occupies one
name only: `common` (what both sites agree on), `local_site`, `remote_site`, `deploy` and `evaluation`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from farhand.common.errors import FarhandError as FarhandError
    from farhand.common.errors import InvalidInput as InvalidInput
    from farhand.common.model.manifold import POSE as POSE
    from farhand.common.model.manifold import Manifold as Manifold
    from farhand.common.model.model_file import load as load_model
    from farhand.common.model.model_file import save as save_model
    from farhand.common.model.task_frame import TaskFrame as TaskFrame
    from farhand.common.model.tphsmm import TPHSMM as TPHSMM
    from farhand.local_site.learning.learner_settings import LearnerSettings as LearnerSettings
    from farhand.local_site.learning.online_learner import OnlineLearner as OnlineLearner
    from farhand.local_site.teaching.demonstration import Demonstration as Demonstration
    from farhand.local_site.teaching.offline_learning import learn as learn
    from farhand.remote_site.interface.arm_driver import ArmDriver as ArmDriver
    from farhand.remote_site.interface.arm_driver import ArmReading as ArmReading
    from farhand.remote_site.interface.camera import Camera as Camera
    from farhand.remote_site.interface.camera import CameraImage as CameraImage
    from farhand.remote_site.interface.camera import CameraView as CameraView
    from farhand.remote_site.interface.driver import Closable as Closable
    from farhand.remote_site.interface.driver import Haltable as Haltable
    from farhand.remote_site.interface.driver import Monitored as Monitored
    from farhand.remote_site.interface.driver import Startable as Startable
    from farhand.remote_site.interface.embodiment import Embodiment as Embodiment
    from farhand.remote_site.interface.plant import EffectorState as EffectorState
    from farhand.remote_site.interface.plant import Plant as Plant
    from farhand.remote_site.interface.sensing import Perception as Perception
    from farhand.remote_site.interface.sensing import TrueTarget as TrueTarget
    from farhand.remote_site.reproduction.executor import Executor as Executor
    from farhand.remote_site.reproduction.executor_settings import ExecutorSettings as ExecutorSettings
    from farhand.remote_site.reproduction.point_rollout import Rollout as Rollout
    from farhand.remote_site.reproduction.point_rollout import roll_out as roll_out

# Where each public name is defined: "module" or "module:name there". docs/api.md follows this order.
_PUBLIC = {
    "Manifold": "farhand.common.model.manifold",
    "POSE": "farhand.common.model.manifold",
    "TaskFrame": "farhand.common.model.task_frame",
    "Demonstration": "farhand.local_site.teaching.demonstration",
    "LearnerSettings": "farhand.local_site.learning.learner_settings",
    "OnlineLearner": "farhand.local_site.learning.online_learner",
    "learn": "farhand.local_site.teaching.offline_learning",
    "TPHSMM": "farhand.common.model.tphsmm",
    "save_model": "farhand.common.model.model_file:save",
    "load_model": "farhand.common.model.model_file:load",
    "ExecutorSettings": "farhand.remote_site.reproduction.executor_settings",
    "Executor": "farhand.remote_site.reproduction.executor",
    "Rollout": "farhand.remote_site.reproduction.point_rollout",
    "roll_out": "farhand.remote_site.reproduction.point_rollout",
    "EffectorState": "farhand.remote_site.interface.plant",
    "Plant": "farhand.remote_site.interface.plant",
    "Perception": "farhand.remote_site.interface.sensing",
    "TrueTarget": "farhand.remote_site.interface.sensing",
    "ArmReading": "farhand.remote_site.interface.arm_driver",
    "ArmDriver": "farhand.remote_site.interface.arm_driver",
    "CameraView": "farhand.remote_site.interface.camera",
    "CameraImage": "farhand.remote_site.interface.camera",
    "Camera": "farhand.remote_site.interface.camera",
    "Startable": "farhand.remote_site.interface.driver",
    "Closable": "farhand.remote_site.interface.driver",
    "Haltable": "farhand.remote_site.interface.driver",
    "Monitored": "farhand.remote_site.interface.driver",
    "Embodiment": "farhand.remote_site.interface.embodiment",
    "FarhandError": "farhand.common.errors",
    "InvalidInput": "farhand.common.errors",
}

__all__ = list(_PUBLIC)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _PUBLIC:
        raise AttributeError(f"module 'farhand' has no attribute {name!r}")
    module, _, there = _PUBLIC[name].partition(":")
    value = getattr(import_module(module), there or name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_PUBLIC})
