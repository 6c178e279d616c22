"""Jobs over one link profile in virtual time: telemetry at rest and while driving, models, a stop."""

from __future__ import annotations

import functools
import logging
import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from farhand.common.errors import FarhandError
from farhand.common.impairment.link_profile import LinkProfile, LinkTimeline, find_profile, load_profiles
from farhand.common.impairment.virtual_direction import Packet
from farhand.common.link.budget import OVERHEAD_BYTES
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.mode_table import Action, ControlMode
from farhand.common.model.model_file import content_hash, encode
from farhand.common.task import TaskSet
from farhand.common.wire import keys
from farhand.deploy.link.link_process import PROFILES_FILE
from farhand.deploy.places import find_point_task
from farhand.evaluation.harness.virtual_job import VirtualPlace
from farhand.evaluation.harness.virtual_sites import VirtualSites
from farhand.evaluation.paper.approach_trials import taught
from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.exchange.model_sender import ModelSender
from farhand.local_site.exchange.requests import Requests
from farhand.local_site.teaching.lesson import LearnedModel
from farhand.local_site.teaching.library import Library
from farhand.local_site.teaching.samples import sample_strokes
from farhand.remote_site.config import RemoteConfig

Case = dict[str, Any]

_PHASE_S, _SAMPLE_S, _PATIENCE_S = 60.0, 0.02, 1200.0
_HAND_S = 1.0 / 30.0
_STOP_AFTER_S = 2.0


def one_way_s(profile: LinkProfile) -> float:
    """Return the mean delay of the slower direction, without its spikes [s]."""
    return max(profile.uplink.delay_ms, profile.downlink.delay_ms) * 1e-3


def rate_bps(profile: LinkProfile) -> float:
    """Return the rate of the slower direction [bit/s]; 0: more than enough."""
    return min((way.rate_bps for way in (profile.uplink, profile.downlink) if way.rate_bps), default=0.0)


def measure(name: str) -> Case:
    """Run all jobs over the profile with this name."""
    logging.disable(logging.WARNING)
    try:
        with tempfile.TemporaryDirectory(prefix="farhand-profile-") as folder:
            return _VirtualProfile(find_profile(load_profiles(PROFILES_FILE), name), Path(folder)).run()
    finally:
        logging.disable(logging.NOTSET)


class _VirtualProfile:
    """Both sites over one profile."""

    def __init__(self, profile: LinkProfile, folder: Path):
        self._profile, task = profile, find_point_task("planar")
        rate = rate_bps(profile)
        self._library = Library(TaskSet([task]), folder)
        self._library.chosen.learn(sample_strokes(task))
        config = RemoteConfig(link=EndpointSettings(listen="tcp/127.0.0.1:0", rate_bps=rate))
        self._sites = VirtualSites(self._library, profile.settings, config)
        self._place = VirtualPlace(self._sites, profile.settings)
        self._sent_s: list[tuple[float, float]] = []  # arrival and sending of each report
        self._wire = {"there": 0, "back": 0, "parts": 0}
        self._sites.link.uplink.tap = self._on_packet_there
        self._sites.link.downlink.tap = self._on_packet_back
        _play(self._sites, profile.over_time(), self._sites.time.now_s())
        inquiries = Requests(self._sites.console_end, self._sites.console.owner.put, self._sites.time.now_s)
        self._answers: list[float] = []
        self._other = ModelSender(inquiries, self._place.now_s, self._sites.console._commanding.session, rate)

    def run(self) -> Case:
        """Run all jobs one after the other."""
        self._await("control of the robot", lambda picture: picture.in_control)
        telemetry = {"at rest": self._watch()}
        models = {"planar": self._send_planar()}
        self._command(Action.ARM, ControlMode.HOLD)
        self._command(Action.COUPLE, ControlMode.DIRECT)
        self._move_hand(self._place.now_s() + _PHASE_S + 2.0 * one_way_s(self._profile))
        self._place.pause(2.0 * one_way_s(self._profile))
        telemetry["driving"] = self._watch()
        stop_s, models["poses"], telemetry["sending the model of poses"] = self._send_poses_and_stop()
        return {
            "one_way_s": one_way_s(self._profile),
            "telemetry": telemetry,
            "models": models,
            "stop_s": stop_s,
        }

    def _watch(self) -> Case:
        from_s = self._place.now_s()
        self._place.pause(_PHASE_S)
        return age_and_rate(self._sent_s, from_s, self._place.now_s())

    def _send_planar(self) -> Case:
        learned, from_s = self._library.chosen.learned, self._begin_model()
        assert learned is not None
        self._place.submit(intents.SendModel())
        self._await("the planar model", lambda picture: picture.confirmed_sha256 == learned.sha256)
        return self._model(learned, from_s)

    def _send_poses_and_stop(self) -> tuple[float, Case, Case]:
        content = encode(model := taught(0, oriented=True)[1])
        learned, from_s = LearnedModel(model, content, content_hash(content)), self._begin_model()
        self._other.send("planar", learned, lambda *_: self._answers.append(self._place.now_s()))
        self._place.pause(_STOP_AFTER_S)
        stopped_s = self._stop()
        while not self._answers and self._place.now_s() < from_s + _PATIENCE_S:
            self._place.pause(_SAMPLE_S)
        until_s = max(self._place.now_s(), from_s + 20.0)
        self._place.pause(until_s - self._place.now_s())
        phase = age_and_rate(self._sent_s, from_s, until_s)
        return stopped_s, self._model(learned, from_s, self._answers[0]), phase

    def _stop(self) -> float:
        """Press Stop; return the time until the robot has it [s]."""
        pressed_s, supervisor = self._place.now_s(), self._sites.robot.supervisor
        self._place.submit(intents.CommandRobot(Action.STOP))
        while supervisor.mode is not ControlMode.STOPPED and self._place.now_s() < pressed_s + _PATIENCE_S:
            self._place.pause(_SAMPLE_S)
        return self._place.now_s() - pressed_s

    def _begin_model(self) -> float:
        self._wire.update(there=0, back=0, parts=0)
        return self._place.now_s()

    def _model(self, learned: LearnedModel, from_s: float, until_s: float | None = None) -> Case:
        return {
            "bytes": len(learned.content),
            "parts": self._wire["parts"],
            "wire_bytes": self._wire["there"],
            "wire_back_bytes": self._wire["back"],
            "took_s": (until_s or self._place.now_s()) - from_s,
        }

    def _command(self, action: Action, mode: ControlMode) -> None:
        self._place.submit(intents.CommandRobot(action))
        self._await(str(action), lambda picture: picture.mode is mode and not picture.pending)

    def _move_hand(self, until_s: float) -> None:
        now_s = self._place.now_s()
        position_m = (0.2 * math.cos(now_s), 0.2 * math.sin(now_s))
        self._sites.console.submit(intents.Hand(position_m, now_s))
        if now_s < until_s:
            self._sites.time.call_later(_HAND_S, functools.partial(self._move_hand, until_s))

    def _await(self, what: str, holds: Callable[[ConsoleState], bool]) -> None:
        if not self._place.wait_for(holds, _PATIENCE_S):
            raise FarhandError(
                f"waited for {what}: {[notice.text for notice in self._place.picture.notices]}"
            )

    def _on_packet_there(self, packet: Packet) -> None:
        if packet.channel is keys.MODEL:
            self._wire["there"] += len(packet.data) + OVERHEAD_BYTES
            self._wire["parts"] += 1

    def _on_packet_back(self, packet: Packet) -> None:
        if packet.channel is keys.MODEL:
            self._wire["back"] += len(packet.data) + OVERHEAD_BYTES
        elif packet.channel is keys.TELEMETRY:
            self._sent_s.append((self._place.now_s(), packet.sent_s))


def age_and_rate(arrivals: list[tuple[float, float]], from_s: float, until_s: float) -> Case:
    """Return the rate of the reports in an interval, and the age of the newest one at each moment.

    Args:
        arrivals: Arrival and sending of each report [s], in the order of arrival.
        from_s: Beginning of the interval [s].
        until_s: End of the interval [s].
    """
    arrived_s, sent_s = (np.array(times) for times in zip(*arrivals, strict=True))
    newest_s = np.maximum.accumulate(sent_s)
    moments = np.arange(from_s, until_s, _SAMPLE_S)
    moments = moments[moments >= arrived_s[0]]
    ages = moments - newest_s[np.searchsorted(arrived_s, moments, side="right") - 1]
    n = int(((arrived_s >= from_s) & (arrived_s < until_s)).sum())
    p50, p95 = np.quantile(ages, [0.5, 0.95])
    return {"rate_hz": n / (until_s - from_s), "age_p50_s": float(p50), "age_p95_s": float(p95)}


def _play(sites: VirtualSites, timeline: LinkTimeline, began_s: float, elapsed_s: float = 0.0) -> None:
    """Apply the timeline's settings, each at its time."""
    sites.link.change(timeline.at(elapsed_s))
    if (next_s := timeline.next_change_s(elapsed_s)) is not None:
        sites.time.call_at(began_s + next_s, functools.partial(_play, sites, timeline, began_s, next_s))
