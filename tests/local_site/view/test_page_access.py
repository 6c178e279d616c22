"""Who may come in: names, origins and tokens, judged alone and by a real server that is spoken to by raw sockets."""

from __future__ import annotations

import errno
import os
import socket
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from viser import _messages
from websockets.exceptions import InvalidStatus
from websockets.frames import OP_BINARY, Frame

from farhand.common.errors import InvalidConfiguration
from farhand.common.wire.messages import Stop
from farhand.local_site.view.host_name import Name, default_gateway
from farhand.local_site.view.page import Page
from farhand.local_site.view.page_access import PageAccess, Visit, kept_token
from tests.browser.raw_client import CAMERA, SUBPROTOCOL, RawClient, raw_connection
from tests.local_site.robot_end import TASK, Desk, desk

PORT = 8080
TOKEN = "a-token-that-nobody-guesses"
LOOPBACK_NAMES = [
    "127.0.0.1",
    "localhost",
    "LOCALHOST",
    "localhost.",
    "127.8.9.1",
    "[::1]",
    "[::ffff:127.0.0.1]",
]
EVIL_NAMES = ["evil.example", "127.0.0.1.evil.example", "localhost.evil.example", "0.0.0.0", "192.0.2.7", ""]


def visit(host: str = "127.0.0.1:8080", target: str = "/", peer: str = "127.0.0.1", **headers: str) -> Visit:
    lines = [("host", host), *((name.replace("_", "-"), value) for name, value in headers.items())]
    return Visit(target, lines, peer, "192.168.1.5" if peer != "127.0.0.1" else peer)


def enters(access: PageAccess, request: Visit, to_talk: bool = True) -> bool:
    return access.judge(request, PORT, to_talk) is None


# Names and origins ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", LOOPBACK_NAMES)
@pytest.mark.parametrize("to_talk", [True, False])
def test_this_machines_own_names_let_in(name: str, to_talk: bool) -> None:
    assert enters(PageAccess(), visit(f"{name}:8080"), to_talk)
    assert enters(PageAccess(), visit(f"{name}:8080", origin=f"http://{name}:8080"), to_talk)


@pytest.mark.parametrize("name", EVIL_NAMES)
@pytest.mark.parametrize("to_talk", [True, False])
def test_a_rebound_name_is_refused_though_its_origin_is_the_same(name: str, to_talk: bool) -> None:
    assert not enters(PageAccess(), visit(f"{name}:8080", origin=f"http://{name}:8080"), to_talk)
    assert not enters(PageAccess(), visit(f"{name}:8080"), to_talk)


@pytest.mark.parametrize(
    "origin",
    ["http://evil.example", "http://127.0.0.1:3000", "http://localhost:8080", "https://127.0.0.1", "null", "",
     "file://", "chrome-extension://abc", "http://127.0.0.1:8080@evil.example", "http://127.0.0.1:8080/x"],
)  # fmt: skip
def test_a_page_of_another_origin_may_not_talk(origin: str) -> None:
    assert not enters(PageAccess(), visit(origin=origin))


def test_two_hosts_or_two_origins_are_one_too_many() -> None:
    twice = Visit("/", [("host", "127.0.0.1"), ("host", "127.0.0.1")], "127.0.0.1", "127.0.0.1")
    assert not enters(PageAccess(), twice)
    good = ("origin", "http://127.0.0.1:8080")
    assert not enters(
        PageAccess(), Visit("/", [("host", "127.0.0.1:8080"), good, good], "127.0.0.1", "127.0.0.1")
    )
    assert not enters(PageAccess(), Visit("/", [], "127.0.0.1", "127.0.0.1"))


@given(st.text(max_size=40), st.text(max_size=40))
def test_whatever_stands_in_the_headers_is_judged_and_foreign_origins_never_enter(
    host: str, origin: str
) -> None:
    name = Name.of(host)
    if enters(PageAccess(), visit(host, origin=origin)):
        assert name is not None and name.is_loopback
        own = Name.of(origin)
        assert own is not None and own.host == name.host


@given(st.text(max_size=40), st.text(max_size=40))
@example("//[", "")
@example("http://[::1/?token=x", "farhand-8080")
def test_whatever_is_asked_for_with_whatever_cookie_is_refused_without_the_token(
    target: str, cookie: str
) -> None:
    asked = visit(target=target, peer="192.168.1.9", cookie=cookie)
    for to_talk in (False, True):
        assert not enters(PageAccess("192.168.1.5", token=TOKEN), asked, to_talk)


@pytest.mark.parametrize("configured", ["https://console.example", "console.example", "console.example:443"])
def test_a_proxy_that_rewrites_the_host_works_when_its_name_is_configured(configured: str) -> None:
    access = PageAccess(names=(configured,), token=TOKEN)
    browser = {"origin": "https://console.example", "cookie": f"farhand-{PORT}={TOKEN}"}
    assert enters(access, visit("127.0.0.1:8080", **browser))  # rewritten
    assert enters(access, visit("console.example", **browser))  # passed on
    assert not enters(PageAccess(), visit("127.0.0.1:8080", **browser))
    assert not enters(access, visit("console.example", **(browser | {"origin": "https://evil.example"})))
    assert not enters(access, visit("evil.example", **browser))


def test_a_page_on_all_addresses_is_served_under_the_one_that_was_reached() -> None:
    access = PageAccess("0.0.0.0", token=TOKEN)
    cookie = f"farhand-{PORT}={TOKEN}"
    assert enters(access, visit("192.168.1.5:8080", peer="192.168.1.9", cookie=cookie))
    assert not enters(access, visit("192.168.1.6:8080", peer="192.168.1.9", cookie=cookie))
    assert not enters(access, visit("evil.example:8080", peer="192.168.1.9", cookie=cookie))


# The token --------------------------------------------------------------------------------------


def test_off_this_machine_the_token_is_asked_for_and_kept_in_a_cookie() -> None:
    access = PageAccess("192.168.1.5", token=TOKEN)
    far = {"host": "192.168.1.5:8080", "peer": "192.168.1.9"}
    refused = access.judge(visit(**far), PORT, to_talk=False)
    assert (
        refused is not None
        and refused.status == 403
        and "?token=" in refused.page
        and TOKEN not in refused.page
    )
    taken = access.judge(visit(**far, target=f"/?token={TOKEN}&fixedDpr=1"), PORT, to_talk=False)
    assert taken is not None and taken.status == 303 and taken.headers["Location"] == "./?fixedDpr=1"
    cookie = taken.headers["Set-Cookie"].partition(";")[0]
    assert {"HttpOnly", "SameSite=Lax"} <= set(taken.headers["Set-Cookie"].split("; "))
    assert enters(access, visit(**far, cookie=f"theme=dark; {cookie}"), to_talk=False)
    assert enters(access, visit(**far, cookie=cookie))
    for wrong in (TOKEN[:-1], TOKEN + "x", "", TOKEN.upper(), "\udcff"):
        assert not enters(access, visit(**far, cookie=f"farhand-{PORT}={wrong}"))
        assert not enters(access, visit(**far, target="/?token=" + wrong.encode(errors="replace").decode()))


def test_this_machine_needs_no_token_but_a_proxy_on_it_does() -> None:
    assert enters(PageAccess("0.0.0.0", token=TOKEN), visit("127.0.0.1:8080"))
    assert not enters(PageAccess(names=("console.example",), token=TOKEN), visit("127.0.0.1:8080"))
    assert not enters(PageAccess("0.0.0.0", token=TOKEN), visit("127.0.0.1:8080", peer="192.168.1.9"))


@pytest.mark.skipif(not default_gateway(), reason="this machine has no way out, so no gateway")
def test_a_page_published_at_loopback_asks_nobody_who_comes_through_the_gateway_and_all_others() -> None:
    here, elsewhere = visit(peer=default_gateway()), visit(peer="192.168.1.77")
    published = PageAccess("0.0.0.0", published_at="127.0.0.1:8080")
    assert enters(published, here)
    assert not enters(published, elsewhere)
    assert not enters(published, visit("evil.example:8080", peer=default_gateway()))
    assert not enters(PageAccess("0.0.0.0"), here)
    assert not enters(PageAccess("0.0.0.0", published_at="192.168.1.5:8080"), here)
    assert published.address(8080) == "http://127.0.0.1:8080"


@pytest.mark.parametrize(
    ("access", "address"),
    [
        (PageAccess(token=TOKEN), "http://127.0.0.1:8080"),
        (PageAccess("::1", token=TOKEN), "http://[::1]:8080"),
        (PageAccess("192.168.1.5", token=TOKEN), f"http://192.168.1.5:8080/?token={TOKEN}"),
        (PageAccess(names=("console.example",), token=TOKEN), f"https://console.example/?token={TOKEN}"),
        (PageAccess("0.0.0.0", ("ship",), token=TOKEN), f"http://ship:8080/?token={TOKEN}"),
        (PageAccess(names=("http://ship:81",), token=TOKEN), f"http://ship:81/?token={TOKEN}"),
    ],
)
def test_the_printed_address_opens_the_page(access: PageAccess, address: str) -> None:
    assert access.address(PORT) == address


def test_a_printed_address_of_all_addresses_is_one_that_can_be_reached() -> None:
    assert "0.0.0.0" not in PageAccess("0.0.0.0").address(PORT)


@pytest.mark.parametrize("name", ["", "a b", "http://", "ftp://a", "a/b", "a:99999", "user@a"])
def test_a_name_that_is_none_is_refused_at_the_start(name: str) -> None:
    with pytest.raises(InvalidConfiguration, match="page_names"):
        PageAccess(names=(name,))


def test_tokens_are_random_kept_and_readable_by_their_owner_alone(tmp_path: Path) -> None:
    token = kept_token(tmp_path / "new")
    file = tmp_path / "new" / "page-token"
    assert kept_token(tmp_path / "new") == token and file.stat().st_mode & 0o777 == 0o600
    assert kept_token(tmp_path / "other") != token and len(token) >= 22
    assert len(kept_token(Path("/dev/null"))) >= 22


DAMAGE: dict[str, Callable[[Path], object]] = {
    "short": lambda file: file.write_text("short"),
    "empty": lambda file: file.write_bytes(b""),
    "no text": lambda file: file.write_bytes(b"\xff" * 40),
    "vast": lambda file: file.write_bytes(b"x" * 10_000_000),
    "a pipe": lambda file: (file.unlink(missing_ok=True), os.mkfifo(file)),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_token_is_replaced_for_good(
    tmp_path: Path, damage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("farhand.common.whole_file._PATIENCE_MS", 50)
    file = tmp_path / "page-token"
    file.touch(0o644)
    DAMAGE[damage](file)
    token = kept_token(tmp_path)
    assert 22 <= len(token) < 100 and kept_token(tmp_path) == token
    assert file.is_file() and file.stat().st_mode & 0o777 == 0o600


def test_a_token_that_could_not_be_kept_is_kept_once_the_disk_has_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        assert len(kept_token(tmp_path)) >= 22 and list(tmp_path.iterdir()) == []
    assert kept_token(tmp_path) == kept_token(tmp_path)


# A real server ----------------------------------------------------------------------------------


@contextmanager
def served(it: Desk, access: PageAccess) -> Iterator[Page]:
    page = Page(it.console, TASK, None, access, 0)
    page.start()
    try:
        yield page
    finally:
        page.close()


def base(page: Page) -> str:
    return page.address.partition("/?")[0]


def bytes_of_an_early_press(page: Page, uuid: str, **headers: str) -> bytes:
    """A handshake and presses of a button behind it, at once: nothing waits for the handshake's answer."""
    messages = [CAMERA, _messages.GuiUpdateMessage(uuid, {"value": True})]
    frames = [
        Frame(OP_BINARY, msgspec.msgpack.encode(message.as_serializable_dict())).serialize(mask=True)
        for message in messages
    ]
    lines = [
        "GET / HTTP/1.1", *(f"{name}: {value}" for name, value in headers.items()),
        "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==", f"Sec-WebSocket-Protocol: {SUBPROTOCOL}", "", "",
    ]  # fmt: skip
    return "\r\n".join(lines).encode() + b"".join(frames)


def test_what_a_refused_connection_sends_is_never_read(tmp_path: Path) -> None:
    with desk(tmp_path) as it, served(it, PageAccess()) as page:
        it.connected()
        with raw_connection(base(page)) as connection:
            stop = RawClient(connection).uuid("STOP")
        host = base(page).removeprefix("http://")
        for headers in (
            {"Host": host, "Origin": "http://evil.example"},
            {"Host": "evil.example", "Origin": "http://evil.example"},
            {"Host": host, "Origin": "null"},
            {"Host": "evil.example"},
        ):
            port = int(host.rpartition(":")[2])
            with socket.create_connection(("127.0.0.1", port)) as raw:
                raw.sendall(bytes_of_an_early_press(page, stop, **headers))
                answer = b"".join(iter(lambda: raw.recv(4096), b""))
            assert answer.startswith(b"HTTP/1.1 403")
        assert it.robot.heard(Stop) == [] and it.picture.stop is None
        with socket.create_connection(("127.0.0.1", int(host.rpartition(":")[2]))) as raw:
            raw.sendall(bytes_of_an_early_press(page, stop, Host=host, Origin=f"http://{host}"))
            it.robot.wait_for(Stop)  # the same bytes from the page itself: all that came before them was done


def test_a_refused_tab_does_not_become_the_active_one(tmp_path: Path) -> None:
    with desk(tmp_path) as it, served(it, PageAccess()) as page:
        for _ in range(3):
            with pytest.raises(InvalidStatus) as refused, raw_connection(base(page), "http://evil.example"):
                pass
            assert refused.value.response.status_code == 403
        assert page.tabs_open == ()


def test_the_refused_page_says_why_and_no_page_can_frame_ours(tmp_path: Path) -> None:
    with desk(tmp_path) as it, served(it, PageAccess()) as page:
        request = urllib.request.Request(base(page), headers={"Host": "evil.example"})
        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(request)
        assert refused.value.code == 403 and "page_names" in refused.value.read().decode()
        with urllib.request.urlopen(base(page)) as answer:
            assert answer.headers["X-Frame-Options"] == "DENY"
            assert "frame-ancestors 'none'" in answer.headers["Content-Security-Policy"]


def test_the_page_is_served_over_ipv6(tmp_path: Path) -> None:
    with desk(tmp_path) as it, served(it, PageAccess("::1")) as page:
        assert page.address.startswith("http://[::1]:")
        with urllib.request.urlopen(page.address) as answer:
            assert answer.status == 200
        with raw_connection(page.address) as connection:
            RawClient(connection).press("STOP")
            it.robot.wait_for(Stop)
