"""Effects of each link profile on telemetry, a model and the whole job, with real processes.

Robot and link are processes, the operator's console is in this one; bytes are counted by the relay, so TCP's
and IP's own are not among them. Age is that of what the operator sees, at every moment of half a minute at
rest: the processes read the one monotonic clock of this machine. Then the model of the task's samples is
sent; and the scripted operator of `farhand demo` does the whole planar job.
"""

from __future__ import annotations

import os
import time
from typing import Any

from farhand.common.errors import ProcessFailed
from farhand.common.impairment.link_profile import find_profile, load_profiles
from farhand.deploy.link.link_process import PROFILES_FILE
from farhand.evaluation.harness.real_sites import RealSites
from farhand.evaluation.link.link_delay import scheduling
from farhand.evaluation.link.link_profiles import holds, seen, verdict
from farhand.evaluation.link.profile_jobs import age_and_rate, one_way_s, rate_bps
from farhand.evaluation.metrics.tables import table
from farhand.local_site.console import intents

Case = dict[str, Any]

_WATCHED_S = 30.0


def cases(trials: int | None, seed: int) -> list[Case]:
    """List one case per run: concurrent cases would disturb each other."""
    del seed  # nothing here is random
    return [{"profiles": list(load_profiles(PROFILES_FILE))[:trials]}]


def trial(case: Case) -> Case:
    """Run all profiles."""
    profiles = [_measure(name) for name in case["profiles"]]
    return {"profiles": profiles, "scheduling": scheduling(), "load": os.getloadavg()[0]}


def _measure(name: str) -> Case:
    profile = find_profile(load_profiles(PROFILES_FILE), name)
    rate = rate_bps(profile)
    with RealSites(None, profile=name, rate_bps=rate) as sites:
        sites.wait_for("control of the robot", lambda picture: picture.in_control)
        before, from_s = sites.control.status(), time.monotonic()
        sites.wait_until_heard("reports", lambda heard: heard.arrived_s > from_s + _WATCHED_S)
        after, until_s = sites.control.status(), time.monotonic()
        there, back = (
            (after[way]["delivered_bytes"] - before[way]["delivered_bytes"]) / (until_s - from_s)
            for way in ("uplink", "downlink")
        )
        arrivals = [(heard.arrived_s, heard.sent_s) for heard in sites.heard]
        model_s = _send_model(sites)
    return {
        "profile": name,
        "one_way_s": one_way_s(profile),
        "telemetry": {"at rest": age_and_rate(arrivals, from_s, until_s)},
        "there_bytes_s": there,
        "back_bytes_s": back,
        "model_s": model_s,
        "job": _job(name, rate),
    }


def _send_model(sites: RealSites) -> float:
    """Send the model of the task's samples; return the time until it is confirmed [s]."""
    sites.console.submit(intents.LoadSamples())
    sites.wait_for("the model", lambda picture: picture.learned is not None and not picture.recording)
    from_s = time.monotonic()
    sites.console.submit(intents.SendModel())
    sites.wait_for("its confirmation", lambda picture: bool(picture.confirmed_sha256))
    return time.monotonic() - from_s


def _job(name: str, rate: float) -> Case:
    try:
        with RealSites(None, with_console=False, profile=name, rate_bps=rate) as sites:
            success = sites.run_demo()["success"]
    except ProcessFailed as error:
        return {"success": False, "why": str(error)}
    return {"success": success, "why": "" if success else "the error was too large"}


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Make one row per profile."""
    profiles = results[0]["profiles"]
    kept = all(holds(each) for each in profiles)
    passed = kept and all(each["job"]["success"] for each in profiles)
    rows = [
        (
            each["profile"], f"{each['one_way_s']:.3g}", seen(each["telemetry"]["at rest"]),
            f"{each['there_bytes_s']:.0f} / {each['back_bytes_s']:.0f}", f"{each['model_s']:.2f}",
            "done" if each["job"]["success"] else f"FAILED: {each['job']['why']}",
        )
        for each in profiles
    ]  # fmt: skip
    header = (
        "", "one way [s]", "at rest: rate, age p50 / p95 [s]", "there / back at rest [B/s]",
        "model until confirmed [s]", "planar job",
    )  # fmt: skip
    lines = ["# Link profiles with real processes", "", _TEXT, "", verdict(kept), "", table(header, rows), ""]
    lines.append(f"Scheduled with {results[0]['scheduling']}; load of the machine {results[0]['load']:.1f}.")
    return {"passed": passed, "profiles": profiles}, "\n".join(lines)


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()
