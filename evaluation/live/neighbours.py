"""Bad neighbours of a robot's port, and what they cost: STOPs acknowledged, and control periods that begin late.

A robot's process has one neighbour: nobody; a watching site that is suspended; one whose network takes nothing any
more while it asks for all events at the rate of the robot's periods; somebody without the lease who sends 100
models of 3.8 MB, of 2 MB in parts that hold nothing but empty lists, or of the most components; garbage on every key. Meanwhile an operator sends 100
STOPs, each again every 0.2 s as a site does, and waits for its acknowledgement.

On the same machine another robot's process runs that nobody speaks to: how late its periods begin is what the machine
costs, and the peer of the figures. Both write down their own times, see `remote_site/site.py`.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from farhand.common.address import free_port
from farhand.common.errors import ProcessFailed
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import ZenohLink
from farhand.common.wire import keys
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import Stop, StopAck
from farhand.evaluation.harness.bad_neighbours import MODELS, neighbour
from farhand.evaluation.harness.farhand_process import HOST, ReadyProcess
from farhand.evaluation.live.tick import tick_lines
from farhand.evaluation.metrics.tables import table
from farhand.local_site.exchange.stop_sender import RESEND_S

Case = dict[str, Any]

STOPS, ACKNOWLEDGED_S, LATE_MS = 100, 0.5, 20.0
_SHORT_S, _LONG_S, _PATIENCE_S = 30.0, 300.0, 60.0


def cases(trials: int | None, seed: int) -> list[Case]:
    """List every neighbour; with `trials`, each for that many seconds at most."""
    found = [("a suspended watcher", _LONG_S), ("who reads nothing", _LONG_S)]
    found += [(name, _SHORT_S) for name in ("nobody", *MODELS, "garbage")]
    return [
        {"neighbour": name, "duration_s": min(duration_s, trials or duration_s), "seed": seed}
        for name, duration_s in found
    ]


def trial(case: Case) -> Case:
    """Run two robots, one with its neighbour and an operator, and read what both have written down."""
    with tempfile.TemporaryDirectory(prefix="farhand-neighbours-") as name, contextlib.ExitStack() as closing:
        folders = [Path(name) / which for which in ("robot", "peer")]
        endpoints = [f"tcp/{HOST}:{free_port()}" for _ in folders]
        robots = [
            ReadyProcess("remote", "--task=planar", f"--listen={endpoint}", f"--data-dir={folder}")
            for endpoint, folder in zip(endpoints, folders, strict=True)
        ]
        for robot in robots:
            closing.callback(robot.kill)
        operator = Stopping(EndpointSettings(connect=endpoints[0]))
        closing.callback(operator.close)
        closing.enter_context(neighbour(case["neighbour"], endpoints[0], Path(name)))
        took_s = operator.stop(STOPS, case["duration_s"])
        for robot in robots:
            robot.end()  # it writes down what there is before a minute is over
        late = [tick_lines(folder / "robot" / "rov1" / "events.jsonl") for folder in folders]
    return {**case, "took_s": took_s, "robot": late[0], "peer": late[1], "load": os.getloadavg()[0]}


class Stopping:
    """Sender of STOPs that hears their acknowledgements.

    Args:
        settings: Endpoint of the robot.
    """

    def __init__(self, settings: EndpointSettings):
        self._link = ZenohLink(settings)
        self._heard: dict[str, float] = {}
        self._changed = threading.Condition()
        self._link.subscribe(keys.STOP_ACK, self._take)

    def stop(self, n: int, duration_s: float) -> list[float | None]:
        """Send STOPs, evenly over a time, and return how long each acknowledgement took; None for none in time [s]."""
        began_s, took_s = time.monotonic(), list[float | None]()
        for number in range(n):
            time.sleep(max(0.0, began_s + number * duration_s / n - time.monotonic()))
            stop, sent_s = Stop(stop_id=f"neighbours-{number}", site_name="ann"), time.monotonic()
            heard = False
            while not heard and time.monotonic() < sent_s + _PATIENCE_S:  # sent again, as a site does
                self._link.send(keys.STOP, encode(stop))
                with self._changed:
                    heard = self._changed.wait_for(lambda stop=stop: stop.stop_id in self._heard, RESEND_S)
            took_s.append(self._heard[stop.stop_id] - sent_s if heard else None)
        return took_s

    def close(self) -> None:
        """End the link."""
        self._link.close()

    def _take(self, data: bytes) -> None:
        now_s, ack = time.monotonic(), decode(data, StopAck)
        with self._changed:
            self._heard.setdefault(ack.stop_id, now_s)
            self._changed.notify_all()


def summarise(results: list[Case]) -> tuple[Case, str]:
    """Count the acknowledgements in time, and hold the periods of each robot against its idle peer's."""
    rows, passed = [], True
    for result in results:
        took_s = [each for each in result["took_s"] if each is not None]
        if not took_s or not result["robot"] or not result["peer"]:
            raise ProcessFailed(f"beside {result['neighbour']}: nothing was acknowledged or written down")
        in_time = sum(each < ACKNOWLEDGED_S for each in took_s)
        late = [_late(result[which]) for which in ("robot", "peer")]
        passed = passed and in_time == len(result["took_s"])
        rows.append(
            (result["neighbour"], f"{result['duration_s']:.0f}", f"{in_time} of {len(result['took_s'])}",
             1e3 * max(took_s), *late[0], *late[1], f"{result['load']:.1f}")
        )  # fmt: skip
    header = (
        "neighbour", "s", f"acknowledged < {ACKNOWLEDGED_S:g} s", "slowest ms", "late p99 ms", "latest ms", "left out",
        "peer p99 ms", "latest ms", "left out", "load",
    )  # fmt: skip
    over = {r["neighbour"]: _late(r["robot"])[1] for r in results if _late(r["robot"])[1] > LATE_MS}
    lines = [
        "# Bad neighbours", "", _TEXT, "", table(header, rows), "",
        f"Robots with a period later than {LATE_MS:g} ms: {len(over)} of {len(results)}; idle peers: "
        f"{sum(_late(r['peer'])[1] > LATE_MS for r in results)} of {len(results)}.",
    ]  # fmt: skip
    return {"passed": passed, "later_than_limit_ms": over}, "\n".join(lines)


def _late(lines: list[Case]) -> tuple[float, float, int]:
    """Return the worst p99 and the worst of all [ms], and how many periods were left out."""
    return (
        max(line["late_p99_ms"] for line in lines),
        max(line["late_max_ms"] for line in lines),
        lines[-1]["overruns"],
    )


_TEXT = (__doc__ or "").split("\n", 1)[1].strip()
