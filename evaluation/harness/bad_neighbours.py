"""Bad neighbours of a robot's port: suspended, deaf, generous with models, or talking nonsense.

A model as wide as may be, and with cycles: valid, and the most that somebody can make a robot try.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import msgpack
import numpy as np

from farhand.common.address import Address, endpoint_address
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.link.link import ZenohLink
from farhand.common.model.model_file import content_hash
from farhand.common.model.model_file import encode as encode_model
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import MAX_COMPONENTS, TPHSMM
from farhand.common.wire import keys
from farhand.common.wire.codec import encode
from farhand.common.wire.messages import (
    MAX_MODEL_BYTES,
    MOST_CONTENT_BYTES,
    SCHEMA,
    EventsRequest,
    ModelTransfer,
)
from farhand.deploy.places import find_point_task
from farhand.evaluation.harness.farhand_process import HOST, ReadyProcess
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.local_site.teaching.samples import sample_strokes


def cyclic_model(base: TPHSMM, n: int) -> TPHSMM:
    """Return a valid model whose components lead to each other in a circle, each with a way out to the last one.

    Args:
        base: Model whose components are taken, again and again.
        n: Number of components.
    """
    rng, pick = np.random.default_rng(1), np.arange(n) % (base.n_components - 1)
    transition = np.zeros((n, n))
    for i in range(n - 1):
        transition[i, (i + 1) % (n - 1)] = 0.9
        transition[i, n - 1] += 0.1
    arrays = {
        name: np.array(np.take(getattr(base, name), pick, axis=0 if getattr(base, name).ndim == 1 else 1))
        for name in ("initial", "means", "covariances", "duration_mean_s", "duration_variance_s2", "counts", "phase",
                     "elapsed_mean_s", "slopes", "residual_covariances", "start_means", "start_covariances")
    }  # fmt: skip
    initial = np.zeros(n)
    initial[0] = 1.0
    terminal, leaves = np.arange(n) == n - 1, np.zeros(n)
    leaves[-1] = 1.0
    arrays |= {"initial": initial, "phase": rng.permutation(np.linspace(0.0, 1.0, n))}
    return replace(
        base,
        transition=transition,
        time_share=transition / 2.0,
        exit=leaves,
        terminal=terminal,
        ways=(),
        **arrays,
    )


_PATIENCE_S = 60.0
_N_MODELS, _PERIOD_S = 100, 0.03


@contextlib.contextmanager
def neighbour(name: str, endpoint: str, folder: Path) -> Iterator[None]:
    """Have a neighbour at a robot's port for this block.

    Args:
        name: One of those of `evaluation/live/neighbours.py`.
        endpoint: The robot's.
        folder: Where the neighbour keeps what it keeps.
    """
    if name == "nobody":
        yield
        return
    if name == "a suspended watcher":
        watcher = ReadyProcess(
            "local", "--watch", "--task=planar", f"--connect={endpoint}", f"--data-dir={folder}/watcher"
        )
        try:
            os.kill(watcher.pid, signal.SIGSTOP)
            yield
        finally:
            watcher.kill()
        return
    over = threading.Event()
    deaf = DeafNetwork(endpoint) if name == "who reads nothing" else None
    link = ZenohLink(EndpointSettings(connect=deaf.endpoint if deaf else endpoint))
    act = _ask_for_events if deaf else _send_garbage if name == "garbage" else MODELS[name]
    thread = threading.Thread(target=act, args=(link, over), daemon=True)
    if deaf is not None:
        link.subscribe(keys.TELEMETRY, lambda _: deaf.stop_reading())
        link.subscribe(keys.EVENT, lambda _: None)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join(_PATIENCE_S)
        if deaf is not None:
            deaf.close()
        link.close()


def _ask_for_events(link: ZenohLink, over: threading.Event) -> None:
    while not over.wait(_PERIOD_S):
        link.ask(keys.EVENTS, encode(EventsRequest()), 600.0, lambda _: None)


def _send_garbage(link: ZenohLink, over: threading.Event) -> None:
    garbage = np.random.default_rng(0).bytes(200)
    while not over.wait(0.01):
        for channel in (keys.STOP, keys.INPUT, keys.HEARTBEAT, keys.TARGET):
            for _ in range(100):
                link.send(channel, garbage)


def _send_huge(link: ZenohLink, over: threading.Event) -> None:
    """Send models in one message each, which is larger than any may be."""
    for number in range(_N_MODELS):
        sent = {
            "schema": SCHEMA, "task": "planar", "session": "a stranger", "sha256": f"{number:064x}",
            "content": bytes(3_800_000),
        }  # fmt: skip
        link.ask(keys.MODEL, msgpack.packb(sent) or b"", _PATIENCE_S, lambda _: None)
        if over.wait(_PERIOD_S):
            return


def _send_in_parts(link: ZenohLink, over: threading.Event) -> None:
    """Send the largest models in parts, as a site does: each is put together, and is nothing but empty lists."""
    for number in range(_N_MODELS):
        data = (
            b"\xdd"
            + (MAX_MODEL_BYTES - 6).to_bytes(4, "big")
            + b"\x90" * (MAX_MODEL_BYTES - 6)
            + bytes([number])
        )
        for offset in range(0, len(data), MOST_CONTENT_BYTES):
            part = ModelTransfer(
                session="a stranger", task="planar", sha256=content_hash(data), size=len(data), offset=offset,
                content=data[offset : offset + MOST_CONTENT_BYTES],
            )  # fmt: skip
            link.ask_and_wait(keys.MODEL, encode(part), _PATIENCE_S)
            if over.is_set():
                return


def _send_widest(link: ZenohLink, over: threading.Event) -> None:
    """Send a model of the most components, which is tried each time."""
    data = _widest_model()
    sent = encode(ModelTransfer(session="a stranger", task="planar", sha256=content_hash(data), content=data))
    for _ in range(_N_MODELS):
        link.ask_and_wait(keys.MODEL, sent, _PATIENCE_S)
        if over.is_set():
            return


def _widest_model() -> bytes:
    task = find_point_task("planar")
    learner = OnlineLearner(LearnerSettings(0.22, min_std_m=0.01), 2, task.frame_names)
    frames = [TaskFrame(np.eye(2), np.array(task.target.origin_m))]
    for stroke in sample_strokes(task):
        learner.start()
        learner.observe_many(stroke.position_m, frames, stroke.time_s)
        learner.end()
    return encode_model(cyclic_model(learner.model(), MAX_COMPONENTS))


MODELS: dict[str, Callable[[ZenohLink, threading.Event], None]] = {
    "models of 3.8 MB": _send_huge,
    "models of 2 MB in parts": _send_in_parts,
    "the widest models": _send_widest,
}


class DeafNetwork:
    """Carries a connection to a robot, and takes nothing from it any more when told so."""

    def __init__(self, endpoint: str):
        self._robot: Address = endpoint_address(endpoint)
        self._reads = threading.Event()
        self._reads.set()
        listener = socket.create_server((HOST, 0))
        self._sockets = [listener]
        self.endpoint = f"tcp/{HOST}:{listener.getsockname()[1]}"
        threading.Thread(target=self._accept, args=(listener,), daemon=True).start()

    def stop_reading(self) -> None:
        """Take nothing from the robot any more."""
        self._reads.clear()

    def close(self) -> None:
        """End the connection."""
        self._reads.set()
        for each in self._sockets:
            each.close()

    def _accept(self, listener: socket.socket) -> None:
        near, _ = listener.accept()  # one only: it does not come back
        far = socket.socket()
        far.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
        far.connect(self._robot)
        self._sockets += [near, far]
        threading.Thread(target=self._carry, args=(near, far, None), daemon=True).start()
        threading.Thread(target=self._carry, args=(far, near, self._reads), daemon=True).start()

    @staticmethod
    def _carry(source: socket.socket, sink: socket.socket, may: threading.Event | None) -> None:
        with contextlib.suppress(OSError):
            while (may is None or may.wait()) and (data := source.recv(65536)):
                sink.sendall(data)
