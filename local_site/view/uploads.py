"""Files that a tab sends to the page: one at a time, of a bounded size, into a button that takes files.

A file comes in parts that are larger than all other messages, and a STOP in the same tab waits behind them: a file
that is too large for that is not sent (`page.js`), and would not be taken here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import msgspec
import viser
from msgspec import Meta
from viser import _messages

PART_BYTES = 512 * 1024
"""Size of the parts in which viser's page sends a file [B]."""
MOST_FILE_BYTES = 1_000_000
"""Largest size of a file [B]."""
_MOST_PARTS = -(-MOST_FILE_BYTES // PART_BYTES)
_Text = Annotated[str, Meta(max_length=200)]


class FileStart(msgspec.Struct, tag_field="type", tag="FileTransferStartUpload", forbid_unknown_fields=True):
    """Announcement of a file."""

    source_component_uuid: _Text
    transfer_uuid: _Text
    filename: Annotated[str, Meta(max_length=300)]
    mime_type: _Text
    part_count: Annotated[int, Meta(ge=0, le=_MOST_PARTS)]
    size_bytes: Annotated[int, Meta(ge=0, le=MOST_FILE_BYTES)]

    def all_received(self) -> _messages.Message:
        """Return the message for which the tab's button waits, for a file that is not taken."""
        size, uuid = self.size_bytes, self.source_component_uuid
        return _messages.FileTransferPartAck(uuid, self.transfer_uuid, size, size)


class FilePart(msgspec.Struct, tag_field="type", tag="FileTransferPart", forbid_unknown_fields=True):
    """Part of a file."""

    source_component_uuid: _Text
    transfer_uuid: _Text
    part_index: Annotated[int, Meta(ge=0, lt=_MOST_PARTS)]
    content: Annotated[bytes, Meta(max_length=PART_BYTES)]


@dataclass
class _Arriving:
    """File that is arriving, with the number of bytes that may still come [B]."""

    tab: int
    start: FileStart
    left_bytes: int


class Uploads:
    """Filter of the files that tabs send. Used by the server's thread.

    Args:
        server: Owns the buttons.
    """

    def __init__(self, server: viser.ViserServer):
        self._server = server
        self._arriving: _Arriving | None = None

    def expects(self, tab: int) -> bool:
        """Decide whether a tab may send a message as large as a part of a file."""
        return self._arriving is not None and self._arriving.tab == tab

    def accepts(self, message: FileStart | FilePart) -> bool:
        """Decide whether a file has a button that takes it, or a part belongs to the file that is arriving."""
        if isinstance(message, FileStart):
            handle = self._server.gui._gui_input_handle_from_uuid.get(message.source_component_uuid)
            return isinstance(handle, viser.GuiUploadButtonHandle)
        arriving = self._arriving
        return (
            arriving is not None
            and message.transfer_uuid == arriving.start.transfer_uuid
            and message.source_component_uuid == arriving.start.source_component_uuid
            and message.part_index < arriving.start.part_count
            and len(message.content) <= arriving.left_bytes
        )

    def note(self, tab: int, message: object) -> None:
        """Note how far a file has come, from a message that viser is given; another file replaces one that never ended."""
        if isinstance(message, FileStart):
            if self._arriving is not None:
                transfers = self._server.gui._current_file_upload_states
                transfers.pop(self._arriving.start.transfer_uuid, None)
            self._arriving = _Arriving(tab, message, message.size_bytes)
        elif isinstance(message, FilePart) and self._arriving is not None:
            self._arriving.left_bytes -= len(message.content)
        if self._arriving is not None and not self._arriving.left_bytes:
            self._arriving = None
