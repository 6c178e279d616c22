"""Result of a job in words."""

from __future__ import annotations

from typing import Any


def summary(result: dict[str, Any]) -> list[str]:
    """Return the result of a job in a few lines per task."""
    return [line for task in result.get("tasks", [result]) for line in _of_task(task, result["link"])]


def _of_task(task: dict[str, Any], link: dict[str, Any]) -> list[str]:
    execution = task["execution"]
    ended = _inserted(execution) if "depth_m" in execution else _tracked(execution)
    return [
        f"task {task['task']}: {'SUCCESS' if task['success'] else 'FAILED'}",
        f"  learned     {task['n_components']} components, {task['n_paths']} paths from "
        f"{task['n_demonstrations']} demonstrations; {task['model_bytes']} B",
        f"  link        {link['profile']}, command round trip {link['command_round_trip_s']:.3f} s"
        + (f", cut by {link['outage']}" if link["outage"] else ""),
        f"  execution   {_arrival(execution)}, then {ended}",
    ]


def _arrival(execution: dict[str, Any]) -> str:
    after_s = execution["duration_s"]
    return f"arrived after {after_s:.2f} s" if after_s is not None else "never arrived"


def _tracked(execution: dict[str, Any]) -> str:
    rms_m, side_m = execution["rms_error_m"], execution["board_side_m"]
    if rms_m is None:
        return "unknown"
    return (
        f"{rms_m * 1e3:.1f} mm ({100 * rms_m / side_m:.2f} % of the board) RMS from the moving target over "
        f"{execution['rms_over_s']:.0f} s"
    )


def _inserted(execution: dict[str, Any]) -> str:
    if execution["depth_m"] is None:
        return "unknown"
    holding_n = execution["holding_force_n"]
    holding = f", {holding_n:.0f} N holding it" if holding_n is not None else ""
    depth_mm = execution["depth_m"] * 1e3
    where = f"{depth_mm:.1f} mm deep" if depth_mm > 0.0 else f"{-depth_mm:.1f} mm before the mouth"
    return (
        f"the plug {where}, {execution['lateral_m'] * 1e3:.1f} mm off the axis; "
        f"{execution['peak_force_n']:.0f} N at most{holding}"
    )
