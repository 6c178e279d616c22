"""Filter of a tab's messages: five kinds, each to elements that accept it. All others are dropped unread."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any, Literal

import msgspec
import viser
from msgspec import Meta
from viser import _messages

from farhand.local_site.view.sessions import Sessions
from farhand.local_site.view.uploads import FilePart, FileStart, Uploads

LARGEST_BYTES = 4096
"""Largest size of a message that the page needs, but for parts of files [B]."""

_NEAREST_M = 1e-9
"""Least distance of a camera from the point that it looks at [m]."""

_Coordinate = Annotated[float, Meta(ge=-1e9, le=1e9)]  # which also rejects what is not a number
_Pixels = Annotated[float, Meta(ge=0, le=1e5)]
_Text = Annotated[str, Meta(max_length=200)]
_Vector = tuple[_Coordinate, _Coordinate, _Coordinate]
_Quaternion = tuple[_Coordinate, _Coordinate, _Coordinate, _Coordinate]
_OnScreen = tuple[_Coordinate, _Coordinate]


class _Message(msgspec.Struct, tag_field="type", forbid_unknown_fields=True):
    pass


class _Camera(_Message, tag="ViewerCameraMessage"):
    wxyz: _Quaternion
    position: _Vector
    fov: Annotated[float, Meta(gt=0, lt=math.pi)]
    near: _Coordinate
    far: _Coordinate
    image_height: _Pixels
    image_width: _Pixels
    look_at: _Vector
    up_direction: _Vector


class _Updates(msgspec.Struct, forbid_unknown_fields=True):
    value: bool | _Coordinate | _Text


class _Value(_Message, tag="GuiUpdateMessage"):
    uuid: _Text
    updates: _Updates


class _GizmoMoved(_Message, tag="TransformControlsUpdateMessage"):
    name: _Text
    wxyz: _Quaternion
    position: _Vector
    owner: Literal[""] = ""


class _GizmoTaken(_Message, tag="TransformControlsDragStartMessage"):
    name: _Text
    owner: Literal[""] = ""


class _GizmoLetGo(_Message, tag="TransformControlsDragEndMessage"):
    name: _Text
    owner: Literal[""] = ""


class _NodeDrag(_Message, tag="SceneNodeDragMessage"):
    phase: Literal["start", "update", "end"]
    name: _Text
    instance_index: int | None
    start_position: _Vector
    start_screen_pos: _OnScreen
    end_position: _Vector
    end_screen_pos: _OnScreen
    button: Literal["left"]
    modifier: _Text | None
    owner: Literal[""] = ""


_Gizmo = _GizmoMoved | _GizmoTaken | _GizmoLetGo
_DECODER = msgspec.msgpack.Decoder(
    _Camera | _Value | _GizmoMoved | _GizmoTaken | _GizmoLetGo | _NodeDrag | FileStart | FilePart
)

_TAKES: dict[type, Callable[[Any, object], bool]] = {
    viser.GuiButtonHandle: lambda _, value: value is True,
    viser.GuiCheckboxHandle: lambda _, value: isinstance(value, bool),
    viser.GuiSliderHandle: lambda _, value: isinstance(value, float) and not isinstance(value, bool),
    viser.GuiTextHandle: lambda _, value: isinstance(value, str),
    viser.GuiDropdownHandle: lambda handle, value: value in handle.options,
}
"""Elements of the page that have a value, and the accepted values of each."""


class Incoming:
    """Filter of each message before viser reads it. Used by the server's thread.

    viser itself lets a tab set any attribute of any element, upload into a button, and move what others hold.

    Args:
        server: Owns the elements.
        sessions: Open tabs, with the one that may act.
        refused: Called with a tab that tried to act but may not.
    """

    def __init__(self, server: viser.ViserServer, sessions: Sessions, refused: Callable[[int], None]):
        self._server, self._sessions, self._refused = server, sessions, refused
        self._for_everybody: set[str] = set()
        self._uploads = Uploads(server)
        self.n_dropped = 0
        """Number of dropped messages: unknown ones, and those of tabs that may not act."""

    def open_to_everybody(self, *handles: viser.GuiButtonHandle) -> None:
        """Let watching tabs press these buttons as well."""
        self._for_everybody.update(handle._impl.uuid for handle in handles)

    def admits(self, tab: int, data: bytes) -> bool:
        """Decide whether a tab's message may be read."""
        if len(data) > LARGEST_BYTES and not self._uploads.expects(tab):
            self.n_dropped += 1
            return False
        try:
            message = _DECODER.decode(data)
        except (msgspec.MsgspecError, ValueError):  # also invalid UTF-8
            self.n_dropped += 1
            return False
        if self._is_for_everybody(message):
            return True
        if not self._has_element(message):
            self.n_dropped += 1
            return False
        if self._sessions.acts(tab):
            self._uploads.note(tab, message)
            return True
        self.n_dropped += 1
        self._put_back(tab, message)
        self._refused(tab)
        return False

    def _is_for_everybody(self, message: object) -> bool:
        if isinstance(message, _Camera):
            return math.dist(message.position, message.look_at) > _NEAREST_M
        if not isinstance(message, _Value):
            return False
        return message.updates.value is True and message.uuid in self._for_everybody

    def _has_element(self, message: object) -> bool:
        """Decide whether the element that a message names exists and accepts it."""
        scene = self._server.scene
        if isinstance(message, _Value):
            handle = self._server.gui._gui_input_handle_from_uuid.get(message.uuid)
            takes = _TAKES.get(type(handle))
            return takes is not None and takes(handle, message.updates.value)
        if isinstance(message, FileStart | FilePart):
            return self._uploads.accepts(message)
        if isinstance(message, _NodeDrag):
            node = scene._handle_from_node_name.get(message.name)
            return node is not None and bool(node._impl.drag_cb)
        return isinstance(message, _Gizmo) and message.name in scene._handle_from_transform_controls_name

    def _put_back(self, tab: int, message: object) -> None:
        """Send the tab the true state of an element, which its browser has already changed."""
        client = self._server.get_clients().get(tab)
        if client is None:
            return
        if isinstance(message, FileStart):
            self._tell(client, message.all_received())
        elif isinstance(message, _Value):
            handle = self._server.gui._gui_input_handle_from_uuid[message.uuid]
            if not isinstance(handle, viser.GuiButtonHandle):
                self._tell(client, _messages.GuiUpdateMessage(message.uuid, {"value": handle.value}))
        elif isinstance(message, _Gizmo):
            node = self._server.scene._handle_from_transform_controls_name[message.name]
            position, wxyz = tuple(node.position.tolist()), tuple(node.wxyz.tolist())
            self._tell(client, _messages.SetPositionMessage(message.name, position))
            self._tell(client, _messages.SetOrientationMessage(message.name, wxyz))

    @staticmethod
    def _tell(client: viser.ClientHandle, message: _messages.Message) -> None:
        client._websock_connection.queue_message(message)
