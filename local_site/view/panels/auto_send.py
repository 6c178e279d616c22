"""Switch for sending the model whenever it changes."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import viser

from farhand.local_site.console import intents
from farhand.local_site.console.console_state import ConsoleState

Submit = Callable[[intents.Intent], None]
Act = Callable[[int, Callable[[], None]], None]


class AutoSendSwitch:
    """Switch that shows the console's state, not the click.

    Args:
        gui: GUI of the server.
        submit: Hands an intent to the console.
        act: Has a tab's action done, from the server's thread; only enqueues.
    """

    def __init__(self, gui: viser.GuiApi, submit: Submit, act: Act):
        self._box = gui.add_checkbox("Send by itself", initial_value=False)

        @self._box.on_update
        async def _(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
            if event.client_id is not None:
                act(event.client_id, partial(submit, intents.AutoSend(bool(event.target.value))))

    def draw(self, picture: ConsoleState) -> None:
        """Show the console's state."""
        if self._box.value != picture.auto_send:
            self._box.value = picture.auto_send
