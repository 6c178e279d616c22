"""Both sites' own code in virtual time under random links, mishaps and operators: every invariant of the modes.

Each trial is one seed: a random link (loss, bursts, duplicates, reorder, jitter, rate, changes of all of it),
stalls and cuts, a silent operator, a console that hangs, restarts of either side, an operator who does random
things, allowed or not, and old messages that are repeated or forged. A trial of 20 s is followed by the test
that DISARMED and STOPPED can be reached from where it ended. `--seed N --trials 1` repeats the trial of seed N.
"""

from __future__ import annotations

import functools
import logging
import tempfile
import time
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

from farhand.common.configuration import load_toml
from farhand.common.impairment.impairment import LinkSettings
from farhand.common.impairment.virtual_direction import Packet
from farhand.common.mode_table import Action, ControlMode
from farhand.common.task import PointTask, TaskSet
from farhand.common.wire.messages import Wish
from farhand.evaluation.harness.virtual_sites import Hooks, VirtualSites
from farhand.evaluation.link.chaos import DURATION_S, ChaosOperator, Mishap, Schedule, random_schedule
from farhand.evaluation.link.chaos_watch import ChaosWatch
from farhand.evaluation.metrics.tables import wilson_interval
from farhand.evaluation.modes.invariants import NOT_HERE, Violation, all_invariants
from farhand.local_site.console import intents
from farhand.local_site.teaching.library import Library
from farhand.local_site.teaching.samples import sample_strokes
from farhand.remote_site.config import RemoteConfig

Case = dict[str, Any]

TRIALS = 10_000
_TASK_FILE = Path(__file__).parents[2] / "deploy" / "tasks" / "planar.toml"
_CONTROL_HZ = 20.0
_CONFIG = RemoteConfig(control_hz=_CONTROL_HZ, telemetry_hz=10.0)
_LONGEST_MISHAP_S = 6.0
_ATTEMPTS = 25
"""Attempts of 2 s each.

The site waits up to 30 s for a command lost on the bad link before it may repeat it.
"""


def cases(trials: int | None, seed: int) -> list[Case]:
    """List one trial per seed, from the given seed on."""
    return [{"seed": seed + number} for number in range(trials or TRIALS)]


def trial(case: Case) -> Case:
    """Run the schedule of one seed."""
    logging.disable(logging.WARNING)  # refusals are expected, and are counted
    try:
        return _played(case["seed"])
    finally:
        logging.disable(logging.NOTSET)


def _played(seed: int) -> Case:
    wall_s, cpu_s = time.perf_counter(), time.process_time()
    run = _Run(seed)
    run.play()
    problems = run.watch.violations + run.reach_rest()
    return {
        "seed": seed,
        "violations": [asdict(problem) for problem in problems],
        "virtual_s": run.sites.time.now_s(),
        "wall_s": time.perf_counter() - wall_s,
        "cpu_s": time.process_time() - cpu_s,
        "periods": dict(run.watch.periods),
        "transitions": dict(run.watch.transitions),
        "n_arrived": run.watch.n_arrived,
        "n_ran": run.watch.n_ran,
        "mishaps": [mishap.kind for mishap in run.schedule.mishaps],
    }


class _Run:
    """One trial: both sites, the observer of the robot, the operator, and the faults."""

    def __init__(self, seed: int):
        task, library = _taught()
        self.schedule: Schedule = random_schedule(seed)
        self.sites = VirtualSites(library, self.schedule.timeline.at(0.0), _CONFIG)
        sites = self.sites
        self.watch = ChaosWatch(task, 1.0 / _CONTROL_HZ, _CONFIG.max_age_s, sites.time.now_s)
        self.operator = ChaosOperator(sites, seed)
        sites.hooks = Hooks(
            lambda: self.watch.before(sites.robot),
            lambda: self.watch.between(sites.robot),
            lambda: self.watch.after(sites.robot),
        )
        sites.link.uplink.tap = self._on_packet
        self._began_s = sites.time.now_s()

    def play(self) -> None:
        """Play the schedule to its end."""
        for mishap in self.schedule.mishaps:
            self.sites.time.call_at(self._began_s + mishap.at_s, functools.partial(self._befall, mishap))
        elapsed_s = 0.0
        while (change_s := self.schedule.timeline.next_change_s(elapsed_s)) is not None:
            settings, elapsed_s = self.schedule.timeline.at(change_s), change_s
            self.sites.time.call_at(
                self._began_s + change_s, functools.partial(self.sites.link.change, settings)
            )
        self.sites.run(DURATION_S)
        self.operator.done = True
        self.sites.run(_LONGEST_MISHAP_S)

    def reach_rest(self) -> list[Violation]:
        """Reach STOPPED and DISARMED from here over a good link; return what failed."""
        sites, problems = self.sites, []
        sites.link.change(LinkSettings())
        sites.console_frozen = False
        sites.console.submit(intents.WishControl(Wish.CONTROL))
        for action, mode in ((Action.STOP, ControlMode.STOPPED), (Action.RESET, ControlMode.DISARMED)):
            for _ in range(_ATTEMPTS):
                sites.console.submit(intents.CommandRobot(action))
                sites.run(2.0)
                if sites.robot.supervisor.mode is mode:
                    break
            else:
                told = "; ".join(
                    f"{notice.what}: {notice.text}" for notice in sites.console.picture.notices[-2:]
                )
                text = f"{mode} was not reached from {sites.robot.supervisor.mode} ({told})"
                problems.append(Violation("8", sites.time.now_s(), text))
        return problems

    def _on_packet(self, packet: Packet) -> None:
        self.operator.capture(packet)
        self.watch.on_packet(packet)

    def _befall(self, mishap: Mishap) -> None:
        sites, for_s = self.sites, mishap.duration_s
        match mishap.kind:
            case "stall":
                sites.link.stall(for_s)
            case "cut":
                sites.link.cut()
                sites.time.call_later(for_s, sites.link.mend)
            case "silent":
                self.operator.silent = True
                sites.time.call_later(for_s, functools.partial(setattr, self.operator, "silent", False))
            case "frozen":
                sites.console_frozen = True
                sites.time.call_later(for_s, functools.partial(setattr, sites, "console_frozen", False))
            case "robot restarts":
                sites.restart_robot(for_s)
            case "console restarts":
                sites.restart_console(for_s)


@functools.cache
def _taught() -> tuple[PointTask, Library]:
    """Learn the task's samples once per process; nothing is recorded during a trial."""
    task = load_toml(_TASK_FILE, PointTask)
    library = Library(TaskSet([task]), Path(tempfile.mkdtemp(prefix="farhand-chaos-")))
    library.chosen.learn(sample_strokes(task))
    return task, library


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Tabulate violations by invariant, coverage, and speed."""
    failing = [result["seed"] for result in results if result["violations"]]
    by_invariant = Counter(each["invariant"] for result in results for each in result["violations"])
    periods, transitions = (
        sum((Counter(result[name]) for result in results), Counter()) for name in ("periods", "transitions")
    )
    virtual_s, wall_s, cpu_s = (
        sum(result[name] for result in results) for name in ("virtual_s", "wall_s", "cpu_s")
    )
    summary = {
        "trials": len(results),
        "seeds": [results[0]["seed"], results[-1]["seed"]],
        "failing_seeds": failing,
        "violations": dict(by_invariant),
        "failure_rate_interval": wilson_interval(len(failing), len(results)),
        "periods_checked": sum(periods.values()),
        "periods_by_mode": dict(periods),
        "transitions": dict(transitions),
        "messages_watched": sum(result["n_arrived"] for result in results),
        "commands_done": sum(result["n_ran"] for result in results),
        "virtual_s": virtual_s,
        "speed_factor_per_core": virtual_s / wall_s,
        "speed_factor_per_cpu_s": virtual_s / cpu_s,
    }
    return summary, _markdown(summary, results)


def _markdown(summary: Case, results: list[Case]) -> str:
    task, _ = _taught()
    _, high = summary["failure_rate_interval"]
    lines = [
        "# Chaos on the link, in virtual time",
        "",
        f"{summary['trials']} random schedules (seeds {summary['seeds'][0]} to {summary['seeds'][1]}), "
        f"{summary['virtual_s'] / 3600:.1f} h of virtual time, {summary['periods_checked']} control periods checked, "
        f"{summary['commands_done']} commands done. {len(summary['failing_seeds'])} schedules with a violation "
        f"(95 % Wilson interval of the rate: up to {100 * high:.3f} %).",
        f"Speed: {summary['speed_factor_per_core']:.0f} times real time per process, "
        f"{summary['speed_factor_per_cpu_s']:.0f} per second of CPU time.",
        "",
        "| invariant | | violations |",
        "|---|---|---|",
    ]
    for invariant in all_invariants(task, _CONFIG.max_age_s):
        lines.append(
            f"| {invariant.number} | {invariant.sentence} | {summary['violations'].get(invariant.number, 0)} |"
        )
    for number, sentence in NOT_HERE.items():
        lines.append(f"| {number} | {sentence} | {summary['violations'].get(number, 0)} |")
    lines += ["", "| mode | control periods |", "|---|---|"]
    lines += [f"| {mode} | {count} |" for mode, count in sorted(summary["periods_by_mode"].items())]
    for result in [result for result in results if result["violations"]][:20]:
        lines += [
            "",
            f"Seed {result['seed']} (`farhand evaluate link-chaos --trials 1 --seed {result['seed']}`):",
        ]
        lines += [
            f"- {each['time_s']:.2f} s, invariant {each['invariant']}: {each['text']}"
            for each in result["violations"]
        ]
    return "\n".join(lines)
