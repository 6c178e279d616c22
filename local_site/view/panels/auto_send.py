"""The switch that has the model sent whenever it changes."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import viser

from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState

Submit = Callable[[intents.Intent], None]
Act = Callable[[int, Callable[[], None]], None]


class AutoSendSwitch:
    """One switch; it shows what the console does, not what was clicked.

    Args:
        gui: Of the server.
        submit: Hands an intent to the console.
        act: Has something done for a tab, from the server's thread; only enqueues.
    """

    def __init__(self, gui: viser.GuiApi, submit: Submit, act: Act):
        self._box = gui.add_checkbox("Send by itself", initial_value=False)

        @self._box.on_update
        async def _(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
            if event.client_id is not None:
                act(event.client_id, partial(submit, intents.AutoSend(bool(event.target.value))))

    def draw(self, picture: ConsoleState) -> None:
        """Show what is so."""
        if self._box.value != picture.auto_send:
            self._box.value = picture.auto_send
