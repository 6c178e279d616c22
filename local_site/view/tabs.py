"""Browser tabs as they come and go: the camera of each, and what each is told about its role."""

from __future__ import annotations

from collections.abc import Callable

import viser

from farhand.local_site.view.panels.html import Html, element
from farhand.local_site.view.sessions import Role, Sessions

_WORDS = {
    Role.ACTIVE: "",
    Role.WATCHING: "This tab watches: another one is active. STOP works here too.",
    Role.FREE: "No tab is active: act here to take over.",
}


class Tabs:
    """The open tabs. Its callbacks only enqueue.

    Args:
        server: The page's.
        fit: Has the scene fill a tab's canvas.
        enqueue: Has something done on the page's thread.
        active_left: Called when the active tab was closed.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        fit: Callable[[viser.CameraHandle], None],
        enqueue: Callable[[Callable[[], None]], None],
        active_left: Callable[[], None],
    ):
        self.sessions = Sessions()
        self._fit_scene, self._active_left = fit, active_left
        self._clients: dict[int, viser.ClientHandle] = {}
        self._sizes: dict[int, tuple[int, int]] = {}
        self._roles: dict[int, Html] = {}

        async def joined(client: viser.ClientHandle) -> None:
            async def moved(_camera: viser.CameraHandle) -> None:
                enqueue(lambda: self._fit(client))

            client.camera.on_update(moved)
            enqueue(lambda: self._joined(client))

        async def left(client: viser.ClientHandle) -> None:
            enqueue(lambda: self._left(client.client_id))

        server.on_client_connect(joined)
        server.on_client_disconnect(left)

    def draw(self) -> None:
        """Tell each tab what it is."""
        for tab, role_html in self._roles.items():
            role = self.sessions.role(tab)
            role_html.show(element("session", role.value, "fh-active", hidden="") + _banner(role))

    def reset(self, tab: int) -> None:
        """Have the scene fill a tab's page again, however it was turned."""
        self._sizes.pop(tab, None)
        if tab in self._clients:
            self._fit(self._clients[tab])

    def _joined(self, client: viser.ClientHandle) -> None:
        self.sessions.joined(client.client_id)
        self._clients[client.client_id] = client
        self._roles[client.client_id] = Html(client.gui)
        self._fit(client)

    def _left(self, tab: int) -> None:
        was_active = self.sessions.active == tab
        self.sessions.left(tab)
        self._clients.pop(tab, None)
        self._sizes.pop(tab, None)
        self._roles.pop(tab, None)
        if was_active:
            self._active_left()

    def _fit(self, client: viser.ClientHandle) -> None:
        """Have the scene fill the page; only when its size has changed, so that a zoom stays."""
        size_px = (client.camera.image_width, client.camera.image_height)
        if client.client_id not in self._clients or self._sizes.get(client.client_id) == size_px:
            return
        self._sizes[client.client_id] = size_px
        with client.atomic():
            self._fit_scene(client.camera)
        client.flush()


def _banner(role: Role) -> str:
    words = _WORDS[role]
    dim = (
        "<style>.mantine-Paper-root[data-with-border] { opacity: .45; pointer-events: none; }</style>"
        if role is Role.WATCHING
        else ""
    )
    return (element("role", words, "fh-role", tag="div") if words else "") + dim
