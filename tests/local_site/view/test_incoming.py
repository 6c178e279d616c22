"""What tabs may send: every kind of message at every element, and STOP still works; who watches moves nothing."""

from __future__ import annotations

import dataclasses
import socket
import time
import typing
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import numpy as np
import pytest
import viser
from viser import _messages
from websockets.exceptions import ConnectionClosed

from farhand.common.wire.messages import MoveTarget, Stop
from farhand.local_site.console import intents
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.view.incoming import LARGEST_BYTES
from farhand.local_site.view.page import Page
from farhand.local_site.view.page_access import PageAccess
from farhand.local_site.view.scene.arm.arm_scene import HandGizmo
from farhand.local_site.view.server import PageServer
from farhand.local_site.view.sessions import Sessions
from farhand.local_site.view.uploads import MOST_FILE_BYTES, PART_BYTES
from tests.browser.raw_client import RawClient, raw_connection
from tests.local_site.robot_end import FRAMES, TASK, Desk, desk, stroke

FIRST_TAB = 0
VALUES = (True, False, 0, 1e12, float("nan"), "x", "planar", None, [1, 2], {"a": 1}, b"bytes", "x" * 300)
ATTRIBUTES = ("removed", "update_cb", "is_button", "disabled", "visible", "label", "sync_cb", "uuid")


@contextmanager
def opened(data_dir: Path) -> Iterator[tuple[Desk, Page]]:
    with desk(data_dir) as it:
        page = Page(it.console, TASK, None, PageAccess(), 0)
        page.start()
        try:
            yield it.connected(), page
        finally:
            page.close()


@contextmanager
def tab_of(page: Page) -> Iterator[RawClient]:
    with raw_connection(page.address) as connection:
        client = RawClient(connection)
        client.uuid("Path")  # the last element: all were sent
        yield client


def stops(it: Desk, client: RawClient) -> None:
    """Press STOP, and see that the robot hears a new one."""
    before = len(it.robot.heard(Stop))
    client.press("STOP")
    it.robot.wait_for(Stop, before + 1)


def incarnations(kind: type[_messages.Message], element: str) -> list[dict[str, typing.Any]]:
    """Messages of a kind that are about an element, of all that a tab might put into them."""
    hints = typing.get_type_hints(kind)
    fields = [field for field in dataclasses.fields(typing.cast(typing.Any, kind)) if field.init]
    samples = {int: 1, float: 1.0, str: element, bool: True, bytes: b"content"}
    content: dict[str, typing.Any] = {"type": kind.__name__}
    for field in fields:
        hint, origin = hints[field.name], typing.get_origin(hints[field.name])
        arguments = typing.get_args(hint)
        if origin is typing.Literal:
            content[field.name] = arguments[0]
        elif origin is tuple:
            content[field.name] = [1.0 for _ in arguments]
        else:
            content[field.name] = samples.get(hint, element)
    if "updates" not in content:
        return [content]
    return [content | {"updates": {"value": value}} for value in VALUES] + [
        content | {"updates": {attribute: value}} for attribute in ATTRIBUTES for value in (True, [], "x")
    ]


def elements(client: RawClient, page: Page) -> list[str]:
    scene = page._server.scene
    nodes = [*scene._handle_from_node_name, *scene._handle_from_transform_controls_name]
    return [*client.uuids.values(), *nodes, "", "root", "no such element"]


def test_every_kind_of_message_at_every_element_leaves_stop_working(tmp_path: Path) -> None:
    kinds = {kind for kind in _messages.Message.get_subclasses() if not kind.__name__.startswith("_")}
    assert {_messages.FileTransferPart, _messages.GuiUpdateMessage, _messages.RunJavascriptMessage} < kinds
    with opened(tmp_path) as (it, page), tab_of(page) as active, tab_of(page) as watching:
        incoming, tried, admitted = page._server.incoming, 0, []
        for element in elements(active, page):
            for content in (each for kind in kinds for each in incarnations(kind, element)):
                tried += 1
                if incoming.admits(FIRST_TAB, msgspec.msgpack.encode(content)):
                    admitted.append(content)
        assert tried > 5_000 and 10 < len(admitted) < 0.05 * tried
        assert {content["type"] for content in admitted} <= {
            "FileTransferStartUpload",
            "GuiUpdateMessage",
            "SceneNodeDragMessage",
            "ViewerCameraMessage",
        }
        for kind in kinds:  # the rest is not judged by the same words twice: once each through the socket
            admitted += incarnations(kind, active.uuid("STOP"))[:1]
        for content in admitted:
            active.send_raw(content)
            watching.send_raw(content)
        stops(it, watching)
        stops(it, active)
        with tab_of(page) as late:
            stops(it, late)


@pytest.mark.parametrize(
    "garbage", [b"", b"\xc1", b"\x81\xa4type\xa4\xff\xff\xff\xff", b"\xdd\xff\xff\xff\xff" * 9, "text"]
)
def test_what_is_no_message_is_dropped_and_the_tab_goes_on(tmp_path: Path, garbage: bytes | str) -> None:
    with opened(tmp_path) as (it, page), tab_of(page) as client:
        client.send_bytes(garbage)
        stops(it, client)


def test_an_upload_into_stop_kills_it_for_nobody(tmp_path: Path) -> None:
    with opened(tmp_path) as (it, page), tab_of(page) as active, tab_of(page) as watching:
        stop = watching.uuid("STOP")
        watching.send(_messages.FileTransferStartUpload(stop, "t", "f", "text/plain", 1, 4))
        watching.send(_messages.FileTransferPart(stop, "t", 0, b"stop"))
        watching.send(_messages.FileTransferStartUpload(stop, "u", "f", "text/plain", 0, 0))
        for client in (watching, active, watching, active):
            stops(it, client)


def upload(
    client: RawClient,
    content: bytes,
    name: str,
    label: str = "Upload demonstration",
    size_bytes: int | None = None,
) -> None:
    """Send a file as viser's page does, all parts at once."""
    uuid, parts = client.uuid(label), range(0, len(content), PART_BYTES)
    size = len(content) if size_bytes is None else size_bytes
    client.send(_messages.FileTransferStartUpload(uuid, name, name, "", len(parts), size))
    for index, at in enumerate(parts):
        named = {"type": "FileTransferPart", "source_component_uuid": uuid, "transfer_uuid": name}
        client.send_raw(named | {"part_index": index, "content": content[at : at + PART_BYTES]})


def a_file(n: int = 60, padding: int = 0) -> bytes:
    """A demonstration of the planar task; its source pads it, in characters that do not compress."""
    positions, times = stroke(n)
    source = "".join(map(chr, np.random.default_rng(0).integers(0x4E00, 0x9FA5, padding)))
    made = Demonstration.within(FRAMES, TASK.frame_names, times, positions)
    return dataclasses.replace(made, source=source).encode()


def test_a_file_is_learned_whole_in_one_part_or_in_several(tmp_path: Path) -> None:
    large = a_file(45, padding=280_000)
    assert PART_BYTES < len(large) <= MOST_FILE_BYTES
    with opened(tmp_path) as (it, page), tab_of(page) as client:
        upload(client, a_file(), "one.npz")
        it.told("upload: learned one.npz as demonstration 1")
        upload(client, large, "other.npz")
        it.told("upload: learned other.npz as demonstration 2")
        stops(it, client)


def test_a_watching_tab_uploads_nothing_and_its_button_is_freed(tmp_path: Path) -> None:
    with opened(tmp_path) as (it, page), tab_of(page) as active, tab_of(page) as watching:
        upload(watching, a_file(), "theirs.npz")
        assert watching.misses({"this tab only watches"}, 30.0) == set()
        upload(active, a_file(), "mine.npz")
        it.told("upload: learned mine.npz as demonstration 1")
        stops(it, watching)
        assert it.picture.n_demonstrations == 1


def test_a_file_that_is_too_large_or_more_than_announced_or_for_another_button_is_not_taken(
    tmp_path: Path,
) -> None:
    with opened(tmp_path) as (it, page), tab_of(page) as client:
        upload(client, bytes(MOST_FILE_BYTES + 1), "large.npz")
        upload(client, a_file(), "longer.npz", size_bytes=10)
        upload(client, a_file(), "stop.npz", label="STOP")
        stops(it, client)
        assert not it.picture.demonstrations and not [n for n in it.picture.notices if n.what == "upload"]
        upload(client, a_file(), "right.npz")  # a file that never ended is in nobody's way
        it.told("upload: learned right.npz as demonstration 1")


# Tabs that may not act --------------------------------------------------------------------------


def drag(client: RawClient, name: str, phase: typing.Literal["start", "update", "end"], x: float) -> None:
    client.send(
        _messages.SceneNodeDragMessage(
            phase, name, None, (0.0, 0.0, 0.0), (0.0, 0.0), (x, 0.5, 0.0), (0.0, 0.0), "left", None
        )
    )


def test_a_watching_tab_moves_neither_hand_nor_target_nor_sliders(tmp_path: Path) -> None:
    with opened(tmp_path) as (it, page), tab_of(page) as active, tab_of(page) as watching:
        names = [
            name for name, node in page._server.scene._handle_from_node_name.items() if node._impl.drag_cb
        ]
        assert len(names) >= 3  # both boards and what lies beside them
        for name in names:
            for phase in ("start", "update", "end"):
                drag(watching, name, phase, 0.3)
        watching.set("Speed [%]", value=20.0)
        watching.press("Arm")
        # Its own browser is put right, and told why, in whichever order.
        assert watching.misses({"'value': 100", "this tab only watches"}, 30.0) == set()
        stops(it, watching)  # by which all that came before it was done
        assert it.robot.heard(MoveTarget) == [] and not it.picture.pending
        assert page._server.gui._gui_input_handle_from_uuid[active.uuid("Speed [%]")].value == 100.0
        assert not active.shows("this tab only watches", 0.5)


@pytest.fixture
def gizmo() -> Iterator[tuple[PageServer, list[intents.Intent]]]:
    """The arrows at the operator's plug, and what they ask the console for."""
    submitted: list[intents.Intent] = []
    sessions = Sessions()
    server = PageServer(PageAccess(), 0, sessions, lambda _tab: None)

    async def joined(client: viser.ClientHandle) -> None:
        sessions.joined(client.client_id)

    server.on_client_connect(joined)

    def act(tab: int, do: typing.Callable[[], None]) -> None:
        if sessions.acts(tab):
            do()

    HandGizmo(server.scene, "/local", submitted.append, act)
    yield server, submitted
    server.stop()


def test_a_watching_tabs_drag_does_not_move_the_arm_by_a_hair(
    gizmo: tuple[PageServer, list[intents.Intent]],
) -> None:
    server, submitted = gizmo
    (name,) = server.scene._handle_from_transform_controls_name
    with raw_connection(server.address) as one, raw_connection(server.address) as other:
        active, watching = RawClient(one), RawClient(other)
        here, there = np.array([0.1, 0.2, 0.3, 1, 0, 0, 0.0]), np.array([0.29, 0.2, 0.3, 1, 0, 0, 0.0])
        held = active.drag(name, np.array([here]))
        next(held)
        for _ in watching.drag(name, np.tile(there, (20, 1))):
            pass
        assert watching.shows_pose(name, here[:3], 30.0)  # its own browser is put right
        assert list(held) == []  # the active tab holds still, and lets go
        last = await_released(submitted)
        assert {tuple(round(x, 6) for x in hand.point) for hand in last} == {tuple(here.tolist())}


def await_released(submitted: list[intents.Intent]) -> list[intents.Hand]:
    """The hand's intents, once it was let go."""
    end_s = time.monotonic() + 30.0
    while not any(isinstance(each, intents.Hand) and each.released for each in submitted):
        assert time.monotonic() < end_s
        time.sleep(0.01)
    return [each for each in submitted if isinstance(each, intents.Hand) and any(each.point[:3])]


# What a tab may cost ----------------------------------------------------------------------------


def resident_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


def test_what_a_tab_sends_costs_no_memory(tmp_path: Path) -> None:
    with opened(tmp_path) as (it, page), tab_of(page) as active, tab_of(page) as watching:
        before = resident_bytes()
        stop = watching.uuid("STOP")
        part = {
            "type": "FileTransferPart",
            "source_component_uuid": stop,
            "transfer_uuid": "t",
            "part_index": 0,
        }
        for index in range(200):
            watching.send(_messages.FileTransferStartUpload(stop, f"{index}", "f", "x", 2, 10**9))
            watching.send_raw(part | {"transfer_uuid": f"{index}", "content": bytes(LARGEST_BYTES // 2)})
        into = active.uuid("Upload demonstration")
        for index in range(200):  # files that never end, also of the tab that may send some
            active.send(_messages.FileTransferStartUpload(into, f"{index}", "f", "x", 2, MOST_FILE_BYTES))
            part |= {
                "source_component_uuid": into,
                "transfer_uuid": f"{index}",
                "content": bytes(PART_BYTES // 8),
            }
            active.send_raw(part)
            watching.send_raw(part)
        stops(it, watching)
        stops(it, active)
        with pytest.raises(ConnectionClosed):
            watching.send_raw(part | {"content": bytes(2 * PART_BYTES)})
            while True:
                watching.receive()
        assert resident_bytes() - before < 50e6


def test_a_flood_of_one_tab_delays_no_stop_of_another(tmp_path: Path) -> None:
    with opened(tmp_path) as (it, page), tab_of(page) as active, tab_of(page) as flooding:
        for _ in range(2_000):
            flooding.press("Arm")
        stops(it, active)


def test_idle_connections_keep_no_operator_out(tmp_path: Path) -> None:
    with opened(tmp_path) as (it, page):
        port = int(page.address.rpartition(":")[2])
        idle = [socket.create_connection(("127.0.0.1", port)) for _ in range(300)]
        try:
            with tab_of(page) as client:
                stops(it, client)
        finally:
            for each in idle:
                each.close()
