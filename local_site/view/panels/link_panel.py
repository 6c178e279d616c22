"""Panel of the simulated link: profiles, delay, jitter, loss, cuts and changes of its ports. Shown only while a link process answers.

Thread that talks to the link process, so that the page never waits for it.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from typing import Any

import viser

from farhand.common.clock import elapsed_s
from farhand.common.errors import InvalidConfiguration, LinkError
from farhand.common.event_loop import Mailbox
from farhand.common.impairment.link_control import RelayControl
from farhand.common.log import loop_logger
from farhand.local_site.view.panels.choices import Act
from farhand.local_site.view.panels.html import Html, element
from farhand.local_site.view.panels.words.controls import NO_PROFILE, Field, Folder, Hint, Label
from farhand.local_site.view.panels.words.lists import cut_words, link_name, loss_words, too_slow_words

_log = loop_logger(__name__)

_POLL_S = 1.0
_KEEP = 32

Request = Callable[[RelayControl], dict[str, Any]]


class LinkWorker:
    """Reader and setter of the link process's state.

    Args:
        control: Control socket of the link process.
        told_bps: Capacity of the link that the sites were told [bit/s]; 0 for more than enough.
    """

    def __init__(self, control: RelayControl, told_bps: float = 0.0):
        self._control, self.told_bps = control, told_bps
        self._requests: Mailbox[Request] = Mailbox(_KEEP)
        self._closed = threading.Event()
        self.status: dict[str, Any] | None = None
        self.problem = ""
        self._thread = threading.Thread(target=self._run, name="link-control", daemon=True)

    def start(self) -> None:
        """Start asking."""
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._requests.put(RelayControl.status)
        self._thread.join(timeout=6.0)

    def submit(self, request: Request) -> None:
        """Queue a change of the link's settings. Never blocks."""
        self._requests.put(request)

    def _run(self) -> None:
        while not self._closed.is_set():
            for request in self._requests.take_all() or [RelayControl.status]:
                if self._closed.is_set():
                    return
                self._do(request)
            self._requests.wait(_POLL_S)

    def _do(self, request: Request) -> None:
        try:
            self.status = request(self._control)
            self.problem = ""
        except InvalidConfiguration as error:
            self.problem = str(error)
        except LinkError as error:
            # No link process: the panel stays hidden until one answers.
            self.status = None
            _log.debug("%s", error)


DELAY_MS, JITTER_MS, LOSS_PERCENT, CUT_S = (0.0, 3000.0), (0.0, 500.0), (0.0, 50.0), (1.0, 60.0)
_PROFILES = ("lan", "geo", "leo", "acoustic")
_SETTLE_S = 1.5
"""Time after a change in which the page shows the operator's choice, and not the link's own state [s]."""

"""Queues a job for the page's thread, run only if the tab may act."""


class LinkPanel:
    """Panel whose callbacks only enqueue; the page's thread does the rest.

    Args:
        gui: GUI of the server.
        worker: Talks to the link process.
        act: Enqueues a tab's action.
    """

    def __init__(self, gui: viser.GuiApi, worker: LinkWorker, act: Act):
        self._worker, self._act = worker, act
        self._changed_s = float("-inf")
        self._folder = gui.add_folder(Folder.LINK, visible=False)
        with self._folder:
            self._profile = gui.add_dropdown(
                Field.PROFILE, (*_PROFILES, NO_PROFILE), initial_value=NO_PROFILE
            )
            self._delay = gui.add_slider(Field.DELAY, *DELAY_MS, step=10.0, initial_value=0.0)
            self._jitter = gui.add_slider(Field.JITTER, *JITTER_MS, step=5.0, initial_value=0.0)
            self._loss = gui.add_slider(
                Field.LOSS, *LOSS_PERCENT, step=0.5, initial_value=0.0, visible=False,
                hint=Hint.LOSS,
            )  # fmt: skip
            self._without_loss, self._too_slow = Html(gui), Html(gui)
            self._cut_s = gui.add_slider(Field.CUT_FOR, *CUT_S, step=1.0, initial_value=5.0)
            self._cut = gui.add_button(Label.CUT, color="orange")
            self._rebind = gui.add_button(
                Label.CHANGE_PORTS, color="gray", visible=False, hint=Hint.CHANGE_PORTS
            )  # fmt: skip
            self._state = Html(gui)
        self._hear(self._profile.on_update, self._take_profile)
        self._hear(self._delay.on_update, self._take_delay)
        self._hear(self._jitter.on_update, self._take_delay)
        self._hear(self._loss.on_update, self._take_loss)
        self._hear(self._cut.on_click, self._cut_link)
        self._hear(self._rebind.on_click, lambda: self._worker.submit(RelayControl.rebind))

    @property
    def link_name(self) -> str:
        """Name of the link, for people."""
        status = self._worker.status
        if status is None:
            return link_name("")
        return link_name(status.get("profile") or NO_PROFILE)

    def draw(self, now_s: float) -> None:
        """Show the state of the link process."""
        status = self._worker.status
        if self._folder.visible != (status is not None):
            self._folder.visible = status is not None
        if status is None:
            return
        outage = status["outage"]
        cut = "" if outage["kind"] == "none" else cut_words(outage["remaining_s"])
        self._state.show(element("cut", self._worker.problem or cut, "fh-cut", tag="div"))
        self._offer_loss(status)
        rates = [
            way["rate_bps"]
            for way in status["settings"].values()
            if isinstance(way, dict) and way.get("rate_bps")
        ]
        slow = too_slow_words(min(rates, default=0.0), self._worker.told_bps)
        self._too_slow.show(element("too-slow", slow, "fh-hint fh-bad", tag="div"))
        if now_s - self._changed_s > _SETTLE_S:
            settings = status["settings"]["uplink"]
            _set(self._profile, status.get("profile") or NO_PROFILE)
            _set(self._delay, clamp(settings["delay_ms"], DELAY_MS))
            _set(self._jitter, clamp(settings["jitter_ms"], JITTER_MS))
            _set(self._loss, clamp(settings["loss"], LOSS_PERCENT))

    def _offer_loss(self, status: dict[str, Any]) -> None:
        """Offer what only datagrams can suffer while the link carries some; otherwise say why it is not offered."""
        transport = status.get("transport", "")  # an older link process does not tell it
        for handle in (self._loss, self._rebind):
            if handle.visible != (transport == "udp"):
                handle.visible = transport == "udp"
        words = loss_words(transport, bool(status["settings"]["uplink"]["gemodel_p"]))
        self._without_loss.show(element("loss", words, "fh-hint", tag="div"))

    def _hear(self, register: Callable[[Callable[..., Any]], Any], handle: Callable[[], None]) -> None:
        async def heard(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                self._changed_s = elapsed_s()  # else drawing may show the old value again before it is taken
                self._act(event.client_id, handle)

        register(heard)

    def _take_profile(self) -> None:
        self._changed_s = elapsed_s()
        name = self._profile.value
        if name in _PROFILES:
            self._worker.submit(lambda control: control.profile(name))

    def _take_delay(self) -> None:
        """Send the chosen delay, clamped here: limits in the page are cosmetic, a tab may send anything."""
        self._changed_s = elapsed_s()
        delay_ms = clamp(self._delay.value, DELAY_MS)
        jitter_ms = min(clamp(self._jitter.value, JITTER_MS), delay_ms)
        _set(self._delay, delay_ms)
        _set(self._jitter, jitter_ms)
        change: dict[str, Any] = {"delay_ms": delay_ms, "jitter_ms": jitter_ms}
        if jitter_ms:
            change["distribution"] = "uniform"
        self._worker.submit(lambda control: control.set(uplink=change, downlink=change))

    def _take_loss(self) -> None:
        self._changed_s = elapsed_s()
        loss = clamp(self._loss.value, LOSS_PERCENT)
        _set(self._loss, loss)
        change = {"loss": loss, "gemodel_p": 0.0}  # losses in bursts are another model of the same thing
        self._worker.submit(lambda control: control.set(uplink=change, downlink=change))

    def _cut_link(self) -> None:
        duration_s = clamp(self._cut_s.value, CUT_S)
        _set(self._cut_s, duration_s)
        self._worker.submit(lambda control: control.outage("stall", duration_s))


def clamp(value: float, limits: tuple[float, float]) -> float:
    """Return the value within the limits; the lower limit for what is not a number."""
    value = float(value)
    return min(max(value, limits[0]), limits[1]) if math.isfinite(value) else limits[0]


def _set(handle: Any, value: Any) -> None:
    """Show a value, unless it is shown already."""
    if handle.value != value:
        handle.value = value
