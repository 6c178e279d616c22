"""Outcome of the scripted job, as `farhand demo --json` writes it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from farhand.common.arm.cell import Receptacle
from farhand.common.task import AnyTask, ArmTask, PointTask
from farhand.common.wire.messages import ExecutionReport
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.script.scripted_actions import PlannedOutage


def job_result(task: AnyTask, state: ConsoleState, report: ExecutionReport) -> dict[str, Any]:
    """Collect the lesson, the robot's execution of it, and whether the task succeeded."""
    learned = state.learned
    assert learned is not None
    return {
        "task": task.name,
        "success": succeeded(task, report),
        "n_demonstrations": state.n_demonstrations,
        "n_components": int((~learned.model.terminal).sum()),
        "n_paths": learned.model.n_paths,
        "model_bytes": len(learned.content),
        "model_sha256": learned.sha256,
        "model_acknowledged": state.confirmed_sha256 == learned.sha256,
        "execution": {
            "duration_s": report.arrived_after_s,
            "end_error_m": report.end_error_m,
            "rms_error_m": report.rms_error_m,
            "rms_over_s": report.tracked_s,
            "control_overruns": report.overruns,
            **(_of_point(task) if isinstance(task, PointTask) else _of_arm(task, report)),
        },
    }


def whole_result(results: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Combine the results of all tasks: the only one, or a list that succeeded if each of them did.

    A list of which none failed and one is not judged is not judged (None).
    """
    if len(results) == 1:
        return results[0]
    judged = [result["success"] for result in results]
    return {"success": False if False in judged else None if None in judged else True, "tasks": list(results)}


def succeeded(task: AnyTask, report: ExecutionReport) -> bool | None:
    """Judge the task: a point by its distance from the target, an arm by the robot's report.

    None: it was done, and nobody knows where the target really is.
    """
    if isinstance(task, PointTask):
        return None if report.rms_error_m is None else report.rms_error_m < task.success_rms_m
    return report.succeeded


def link_result(
    state: ConsoleState, status: Mapping[str, Any], outage: PlannedOutage | None
) -> dict[str, Any]:
    """Collect the link's settings and the times of the commands.

    Args:
        state: Present state of the console.
        status: Status of the link process; empty where there is none.
        outage: The planned cut, or None.
    """
    trips = state.command_round_trips_s
    uplink = status.get("settings", {}).get("uplink", {})
    return {
        "profile": status.get("profile"),
        "delay_s": uplink.get("delay_ms", 0.0) * 1e-3,
        "outage": f"{outage.kind}:{outage.duration_s:g}" if outage else None,
        "command_round_trip_s": float(np.median(trips)),
        "command_round_trips_s": [round(trip, 4) for trip in trips],
        "relay_lateness_ms": {name: _lateness_ms(status.get(name, {})) for name in ("uplink", "downlink")},
    }


def _of_point(task: PointTask) -> dict[str, Any]:
    return {
        "board_side_m": max(task.workspace_m),
        "target_amplitude_m": float(np.linalg.norm(task.target.amplitude_m or 0.0)),
        "target_period_s": task.target.period_s,
    }


def _of_arm(task: ArmTask, report: ExecutionReport) -> dict[str, Any]:
    end_error_m = None
    if task.skill == "insert" and report.depth_m is not None and report.lateral_m is not None:
        end_error_m = math.hypot(report.depth_m - Receptacle().depth_m, report.lateral_m)
    return {
        "end_error_m": end_error_m,
        "depth_m": report.depth_m,
        "lateral_m": report.lateral_m,
        "peak_force_n": report.peak_force_n,
        "holding_force_n": report.holding_force_n,
    }


def _lateness_ms(traffic: Mapping[str, Any]) -> dict[str, float | None]:
    """Return the delay that the link process added [ms]; unknown for a real link."""
    return {name: traffic.get(f"lateness_{name}_ms") for name in ("p50", "p99", "max")}
