"""Drawer of the page: actions that are possible, but not the next step."""

from __future__ import annotations

import viser

from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.panels import buttons
from farhand.local_site.view.panels.buttons import Buttons, ButtonSpec, OnPress
from farhand.local_site.view.panels.choices import Act, AutoSendSwitch, Standings, Submit
from farhand.local_site.view.panels.file_panel import FilePanel, Save
from farhand.local_site.view.panels.link_panel import LinkPanel, LinkWorker
from farhand.local_site.view.panels.list_panels import LibraryPanel
from farhand.local_site.view.panels.words.controls import Folder
from farhand.local_site.view.panels.words.lists import link_name
from farhand.local_site.view.scene.nodes import Layers


class Drawer:
    """Folders of the drawer. Used by the page's thread.

    Args:
        gui: GUI of the server.
        submit: Hands an intent to the console.
        act: Has a tab's action done, from the server's thread; only enqueues.
        on_press: Called with the tab and the pressed button, from the server's thread; only enqueues.
        save: Has a tab's browser save a file.
        layers: What the operator hides and shows in the scene.
        worker: Talks to the simulated link; None without one.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        submit: Submit,
        act: Act,
        on_press: OnPress,
        save: Save,
        layers: Layers,
        worker: LinkWorker | None,
    ):
        with gui.add_folder(Folder.TEACH):
            self._buttons = [Buttons(gui, buttons.TEACH, on_press)]
            self._auto_send = AutoSendSwitch(gui, submit, act)
        with gui.add_folder(Folder.LIBRARY):
            self._standings = Standings(gui)
            self._buttons.append(Buttons(gui, (buttons.SEND_LIBRARY,), on_press))
            self._library = LibraryPanel(gui, submit, act)
            self._buttons.append(Buttons(gui, buttons.LIBRARY, on_press))
        with gui.add_folder(Folder.DEMONSTRATIONS):
            self._files = FilePanel(gui, submit, act, save, layers)
        with gui.add_folder(Folder.ROBOT):
            self._buttons.append(Buttons(gui, buttons.ROBOT, on_press))
        self._link = LinkPanel(gui, worker, act) if worker is not None else None
        with gui.add_folder(Folder.CONTROL):
            self._buttons.append(Buttons(gui, buttons.CONTROL, on_press))

    @property
    def link_name(self) -> str:
        """Name of the link, for people."""
        return self._link.link_name if self._link is not None else link_name("")

    def draw(self, state: ConsoleState, elsewhere: tuple[ButtonSpec, ...], now_s: float) -> None:
        """Show a state of the console, without the buttons that are drawn elsewhere."""
        for group in self._buttons:
            group.draw(state, elsewhere)
        self._auto_send.draw(state)
        self._standings.draw(state)
        self._library.draw(state)
        self._files.draw(state)
        if self._link is not None:
            self._link.draw(now_s)
