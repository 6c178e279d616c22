"""Browser tabs as they open and close: the camera of each, and the notice of its role."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
import viser
from numpy.typing import NDArray

from farhand.common.clock import elapsed_s
from farhand.local_site.view.panels.html import Html, element
from farhand.local_site.view.panels.words.lists import ASKED, KEPT, NOT_DONE, ROLE_WORDS
from farhand.local_site.view.panels.words.scripts import in_narrow_window
from farhand.local_site.view.sessions import Role, Sessions


class Scene(Protocol):
    """Scene as the tabs look at it."""

    views: tuple[str, ...]
    """Names of the views; the first one shows all."""
    teaching_view: str
    """Name of the view in which a demonstration is recorded."""

    @property
    def extent_m(self) -> tuple[float, ...]:
        """Sizes that the views fit into a canvas [m]."""
        ...

    def fit(self, camera: viser.CameraHandle, name: str) -> None:
        """Fit a named view into a tab's canvas."""
        ...

    def let_go(self) -> None:
        """End the drag of a closed tab."""
        ...


class Tabs:
    """Open tabs. Its callbacks only enqueue.

    Args:
        server: Server of the page.
        sessions: Open tabs, with the one that may act.
        scene: What the tabs look at; the hand lets go when the active tab is closed.
        enqueue: Has a function called on the page's thread.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        sessions: Sessions,
        scene: Scene,
        enqueue: Callable[[Callable[[], None]], None],
    ):
        self._sessions = sessions
        self._scene, self._extent_m = scene, scene.extent_m
        self._fit_scene, self._active_left = scene.fit, scene.let_go
        self._clients: dict[int, viser.ClientHandle] = {}
        self._sizes: dict[int, tuple[int, int]] = {}
        self._first_view, self._teaching_view = scene.views[0], scene.teaching_view
        self._views: dict[int, str] = {}
        self._teaches = False
        self._before: tuple[int, str, NDArray[np.float64], NDArray[np.float64]] | None = None
        """Tab whose camera is at the view for teaching, with the view and the camera that it had before."""
        self._roles: dict[int, Html] = {}
        self._told: dict[int, str] = {}
        """Text for a watching tab beside its role."""

        async def joined(client: viser.ClientHandle) -> None:
            async def moved(_camera: viser.CameraHandle) -> None:
                enqueue(lambda: self._fit(client))

            client.camera.on_update(moved)
            sessions.joined(client.client_id)
            enqueue(lambda: self._joined(client))

        async def left(client: viser.ClientHandle) -> None:
            was_active = sessions.left(client.client_id)
            enqueue(lambda: self._left(client.client_id, was_active))

        server.on_client_connect(joined)
        server.on_client_disconnect(left)

    def draw(self, teaches: bool, now_s: float) -> None:
        """Show each tab its role, and the active one the view for teaching as long as a demonstration is recorded.

        Args:
            teaches: True while a demonstration is recorded.
            now_s: Present time [s]: a tab that asked takes over once it is time.
        """
        if self._sessions.take_over_if_due(now_s):
            self._active_left()
        if teaches and not self._teaches:
            self._begin_teaching()
        elif self._teaches and not teaches:
            self._end_teaching()
        self._teaches = teaches
        self._follow_scene()
        self._draw_roles()

    def _follow_scene(self) -> None:
        """Fit the views again once the scene has another extent."""
        if self._scene.extent_m != self._extent_m:
            self._extent_m = self._scene.extent_m
            self._sizes.clear()
            for client in list(self._clients.values()):
                self._fit(client)

    def _draw_roles(self) -> None:
        asker = self._sessions.asker
        for tab, role_html in self._roles.items():
            role = self._sessions.role(tab)
            if role is not Role.WATCHING:
                self._told.pop(tab, None)
            words = ASKED if tab == asker else self._told.get(tab, ROLE_WORDS[role])
            narrow = {"data-in-narrow": in_narrow_window(words)}
            told = element("role", words, "fh-role", tag="div", role="status", **narrow) if words else ""
            style = _WATCHER_STYLE if role is Role.WATCHING else _KEEP_STYLE if asker is not None else ""
            role_html.show(element("session", role.value, "fh-active", hidden="") + told + style)

    def refused(self, tab: int) -> None:
        """Show one tab that it may not act."""
        if tab in self._clients:
            self._told[tab] = NOT_DONE

    def take_over(self, tab: int) -> None:
        """Have a watching tab become the active one, unless that objects."""
        self._told.pop(tab, None)
        self._sessions.ask(tab, elapsed_s())

    def keep(self, tab: int) -> None:
        """Have the active tab object to another one that asks to take over."""
        asker = self._sessions.keep(tab)
        if asker is not None:
            self._told[asker] = KEPT

    def look(self, tab: int, view: str) -> None:
        """Fit a view into a tab's canvas, however the present one was turned."""
        self._views[tab] = view
        self._sizes.pop(tab, None)
        if tab in self._clients:
            self._fit(self._clients[tab])

    def _begin_teaching(self) -> None:
        active = self._sessions.active
        client = self._clients.get(active) if active is not None else None
        if client is None or self._teaching_view == self._first_view:
            return
        camera, tab = client.camera, client.client_id
        self._before = tab, self._view_of(client), camera.position.copy(), camera.look_at.copy()
        self.look(tab, self._teaching_view)

    def _end_teaching(self) -> None:
        """Show the tab again what it showed before, unless another view was chosen meanwhile."""
        before, self._before = self._before, None
        if before is None or (client := self._clients.get(before[0])) is None:
            return
        tab, view, position_m, look_at_m = before
        if self._views.get(tab) != self._teaching_view:
            return
        self._views[tab] = view
        with client.atomic():
            client.camera.position, client.camera.look_at = position_m, look_at_m
        client.flush()

    def _view_of(self, client: viser.ClientHandle) -> str:
        return self._views.get(client.client_id, self._first_view)

    def _joined(self, client: viser.ClientHandle) -> None:
        self._clients[client.client_id] = client
        self._roles[client.client_id] = Html(client.gui)
        self._fit(client)

    def _left(self, tab: int, was_active: bool) -> None:
        self._told.pop(tab, None)
        self._clients.pop(tab, None)
        self._sizes.pop(tab, None)
        self._roles.pop(tab, None)
        self._views.pop(tab, None)
        if was_active:
            self._active_left()

    def _fit(self, client: viser.ClientHandle) -> None:
        """Fit the scene into the page if the page's size has changed; otherwise a zoom is kept."""
        size_px = (client.camera.image_width, client.camera.image_height)
        if client.client_id not in self._clients or self._sizes.get(client.client_id) == size_px:
            return
        self._sizes[client.client_id] = size_px
        with client.atomic():
            self._fit_scene(client.camera, self._view_of(client))
        client.flush()


_WATCHER_STYLE = """<style>
.mantine-Paper-root[data-with-border]:not(:has(.fh-here-take, .fh-here-view)) :is(.mantine-Button-root, input, [role=slider]) { visibility: hidden; }
.mantine-Paper-root[data-with-border]:has(.fh-here-take) { display: block; }
</style>"""
"""Only what a watching tab may press is drawn in it, and can be reached by its keyboard."""
_KEEP_STYLE = """<style>
.mantine-Paper-root[data-with-border]:has(.fh-here-keep) { display: block; }
</style>"""
"""The active tab may object while another one asks."""
