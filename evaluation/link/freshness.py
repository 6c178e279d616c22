"""Freshness and silence: ages on the robot's clock alone, and silence while driving.

An operator drives for 90 s (longer where the delay is long); the clocks of the two sites agree, differ by an hour,
or drift apart. During each drive everything on the line is held back once for 2 to 8 s and then arrives at once;
the robot's process is restarted once; and four times, before and after that, an eavesdropper replays inputs that
are at least 16 s old.
The shipped supervisor judges every input that arrives, and so do three rules that compare the sender's
wall clock with the receiver's: with the 0.1 s of MoveIt Servo, the 0.5 s of dimos, and 0.5 s more than the
line's delay.

*Stale motion*: an input was accepted although it had been sent more than the delay plus one second earlier. *False
refusal*: an input of the present coupling was refused although it arrived within the delay and the line's jitter. An
operator who is decoupled couples again, three times in all: at first, after the outage and after the restart. A
further time would mean that a coupling ended without cause.
"""

from __future__ import annotations

from itertools import product
from random import Random
from typing import Any

from farhand.evaluation.link import silence
from farhand.evaluation.link.freshness_world import (
    DT_S,
    JITTER_S,
    TELEMETRY_S,
    DrivingWorld,
    MessageArrival,
    StampRule,
    a_stall,
)
from farhand.evaluation.metrics.tables import table
from farhand.evaluation.study import reporting_seeds

Case = dict[str, Any]

DELAYS_S = (0.05, 0.3, 1.0, 3.0, 5.0)
# Lead of the operator's wall clock over the robot's [s], and its drift: that of a good crystal
# after a day without being set.
CLOCKS = {
    "agree": (0.0, 0.0),
    "ahead by an hour": (3600.0, 0.0),
    "behind by an hour": (-3600.0, 0.0),
    "a day of +50 ppm": (4.32, 50e-6),
    "a day of -50 ppm": (-4.32, -50e-6),
}
RULES: tuple[str, ...] = ("ours", "0.1 s", "0.5 s", "delay + 0.5 s")
_DURATION_S, _STALL_S, _RESTART_S = 90.0, (25.0, 35.0), 60.0
_REPLAYS_S = (20.0, 58.0, 64.0, 80.0)
_REPLAYED_S, _REPLAY_AGE_S = 1.0, 16.0
_STALE_S = 1.0
_SLOWER_BY_S = 5.0
"""Delay at which everything takes twice as long [s]."""
_TRIALS, _SILENCES = 200, 3
"""Number of drives, and of silences per drive."""


def cases(trials: int | None, seed: int) -> list[Case]:
    """List every delay with every state of the clocks in turn, each with its own seed; then the silences."""
    kinds = list(product(DELAYS_S, CLOCKS))
    found = []
    for number, its_seed in enumerate(reporting_seeds(seed, trials or _TRIALS)):
        delay_s, clocks = kinds[number % len(kinds)]
        found.append({"delay_s": delay_s, "clocks": clocks, "seed": its_seed})
    return found + silence.cases(_SILENCES * len(found), seed)


def trial(case: Case) -> Case:
    """Run one drive and count each rule's errors about its inputs; or run one silence."""
    if "silence" in case:
        return silence.trial(case)
    judge = _Judge(case["delay_s"], *CLOCKS[case["clocks"]])
    world, random = DrivingWorld(case["delay_s"], case["seed"], judge.arrived), Random(case["seed"])
    stall_s, until_s = a_stall(random, *_STALL_S)
    slower = 1.0 + case["delay_s"] / _SLOWER_BY_S

    def now(at_s: float, for_s: float = DT_S) -> bool:
        return 0.0 <= world.now_s - 100.0 - slower * at_s < for_s

    while not now(_DURATION_S):
        world.step()
        if now(stall_s):
            for line in (world.up.line, world.down.line):
                line.stall(world.now_s, world.now_s + until_s - stall_s)
        if now(_RESTART_S):
            world.restart()
            judge.restart()
        if any(now(begin_s, _REPLAYED_S) for begin_s in _REPLAYS_S):
            _replay(world, random)
    return {
        **case,
        "n_inputs": judge.n_inputs,
        "n_replayed": judge.n_old,
        "n_couplings": len(judge.couplings),
        "stale": judge.stale,
        "refused": judge.refused,
    }


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Make the tables of drives and silences."""
    summary, text = _drives([result for result in results if "silence" not in result])
    silences = [result for result in results if "silence" in result]
    if silences:
        summary["silence"], told = silence.summarise(silences)
        text = f"{text}\n\n{told}"
    return summary, text


def _drives(results: list[Case]) -> tuple[Case, str]:
    """Tabulate the wrong judgements of each rule, over all drives and by the state of the clocks."""
    n_inputs = sum(r["n_inputs"] for r in results)
    totals = {
        rule: {key: sum(r[key][rule] for r in results) for key in ("stale", "refused")} for rule in RULES
    }
    runs = {rule: sum(bool(r["stale"][rule] or r["refused"][rule]) for r in results) for rule in RULES}
    summary = {
        "n_inputs": n_inputs,
        "n_replayed": sum(r["n_replayed"] for r in results),
        "most_couplings": max(r["n_couplings"] for r in results),
        "stale_motions": {rule: totals[rule]["stale"] for rule in RULES},
        "false_refusals": {rule: totals[rule]["refused"] for rule in RULES},
        "success_rate": 1.0 - runs["ours"] / len(results),
    }
    header = ["clocks", *(f"{rule}: stale / refused" for rule in RULES)]
    rows = []
    for clocks in [*CLOCKS, None]:
        part = [r for r in results if clocks in (None, r["clocks"])]
        cells = [f"{sum(r['stale'][q] for r in part)} / {sum(r['refused'][q] for r in part)}" for q in RULES]
        rows.append([f"{clocks or 'all'} ({len(part)} drives)", *cells])
    lines = [
        "# Freshness", "", (__doc__ or "").split("\n", 1)[1].strip(), "",
        f"{len(results)} drives at one-way delays of {', '.join(map(str, DELAYS_S))} s, {n_inputs:,} inputs, "
        f"{summary['n_replayed']:,} of them recorded and sent again. Stale motions / false refusals:", "",
        table(header, rows), "",
        f"Drives without a wrong judgement: {', '.join(f'{q} {len(results) - runs[q]}' for q in RULES)} "
        f"of {len(results)}. Couplings in a drive: at most {summary['most_couplings']}.",
    ]  # fmt: skip
    return summary, "\n".join(lines)


class _Judge:
    """Judge of each arrival by every rule, with knowledge of the truth."""

    def __init__(self, delay_s: float, ahead_s: float, drift: float):
        self._delay_s, self._ahead_s, self._drift = delay_s, ahead_s, drift
        self._rules = dict(
            zip(RULES[1:], (StampRule(0.1), StampRule(0.5), StampRule(delay_s + 0.5)), strict=True)
        )
        self.stale = dict.fromkeys(RULES, 0)
        self.refused = dict.fromkeys(RULES, 0)
        self.n_inputs = self.n_old = 0
        self.couplings: set[tuple[str, int]] = set()
        """Couplings in which inputs counted, by boot."""

    def arrived(self, arrival: MessageArrival) -> None:
        """Judge one input."""
        self.n_inputs += 1
        age_s = arrival.now_s - arrival.sent_s
        self.n_old += age_s >= _REPLAY_AGE_S
        if arrival.counted:
            self.couplings.add((arrival.message.echo.boot, arrival.message.coupling_id))
        # Stamps that the wall clocks of sender and receiver would give.
        stamp_s = arrival.sent_s + self._ahead_s + self._drift * (arrival.sent_s - 100.0)
        verdicts = {"ours": arrival.counted}
        for name, rule in self._rules.items():
            verdicts[name] = rule.accepts(arrival.message.seq, stamp_s, arrival.now_s)
        usual_s = self._delay_s + JITTER_S + DT_S
        in_time = age_s <= usual_s and arrival.age_shown_s <= usual_s + TELEMETRY_S
        for name, accepted in verdicts.items():
            self.stale[name] += accepted and age_s > self._delay_s + _STALE_S
            self.refused[name] += not accepted and in_time and arrival.current

    def restart(self) -> None:
        """Restart the rule with the robot."""
        for rule in self._rules.values():
            rule.restart()


def _replay(world: DrivingWorld, random: Random) -> None:
    """Replay inputs that somebody recorded a while ago."""
    old = [sent for sent in world.sent if world.now_s - sent[1] >= _REPLAY_AGE_S]
    for sent in random.sample(old, min(2, len(old))):
        world.arrive(*sent)
