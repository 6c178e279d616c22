"""Pages of other web sites in the same browser: they press no button here. Our own works behind a proxy, too."""

from __future__ import annotations

import json
import re
import socket
import socketserver
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import msgspec
import pytest
from playwright.sync_api import Browser, expect, sync_playwright
from viser import _messages

from farhand.common.wire.messages import Stop
from farhand.local_site.view.page_access import PageAccess
from tests.browser.desk_page import page_of
from tests.browser.operator_page import CHROMIUM, WAIT_MS, launch
from tests.browser.raw_client import CAMERA, SUBPROTOCOL, RawClient, raw_connection

OUTSIDE = "evil.example", "console.example"

ATTACK = """<!doctype html><title>cats</title><iframe src="%(page)s"></iframe><script>
const tried = (window.tried = []);
function speak(address) {
  return new Promise((done) => {
    const socket = new WebSocket(address, %(protocols)s);
    socket.onopen = () => {
      tried.push("opened " + address);
      for (const message of %(messages)s) socket.send(Uint8Array.from(message));
    };
    socket.onclose = () => { tried.push("closed " + address); done(); };
  });
}
(async () => {
  for (const address of %(sockets)s) await speak(address);
  await fetch("%(page)s", { method: "POST", mode: "no-cors", body: Uint8Array.from(%(messages)s[1]) }).catch(() => 0);
  window.finished = true;
})();
</script>"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """One whose names of the outside lead to this machine, as a rebound name does."""
    if CHROMIUM is None:
        pytest.skip("NO CHROMIUM on this machine: the page is not tested (Debian: apt-get install chromium)")
    rules = ", ".join(f"MAP {name} 127.0.0.1" for name in OUTSIDE)
    with sync_playwright() as playwright:
        browser = launch(playwright, f"--host-resolver-rules={rules}")
        yield browser
        browser.close()


@contextmanager
def web_site(html: str) -> Iterator[int]:
    """A web site that serves one page."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(html.encode())

        def log_message(self, format: str, *args: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server.server_address[1]
        finally:
            server.shutdown()
            thread.join()


def attack_on(port: int) -> str:
    """A page that does all that it can to press STOP and Arm, and knows their names already."""
    with raw_connection(f"http://127.0.0.1:{port}") as connection:
        client = RawClient(connection)
        presses = [_messages.GuiUpdateMessage(client.uuid(each), {"value": True}) for each in ("STOP", "Arm")]
    messages = [list(msgspec.msgpack.encode(each.as_serializable_dict())) for each in (CAMERA, *presses)]
    sockets = [f"ws://{host}:{port}" for host in ("127.0.0.1", "localhost", *OUTSIDE)]
    return ATTACK % {
        "page": f"http://127.0.0.1:{port}/", "protocols": json.dumps([SUBPROTOCOL]),
        "messages": json.dumps(messages), "sockets": json.dumps(sockets),
    }  # fmt: skip


def test_a_page_of_another_origin_presses_nothing(browser: Browser, tmp_path: Path) -> None:
    with page_of(tmp_path) as (it, page), web_site(attack_on(page.port)) as other_port:
        for host in ("evil.example", "127.0.0.1", "localhost"):
            tab = browser.new_page()
            tab.goto(f"http://{host}:{other_port}/")
            tab.wait_for_function("() => window.finished", timeout=WAIT_MS)
            tried = tab.evaluate("() => window.tried")
            assert len(tried) == 2 + len(OUTSIDE) and not [
                each for each in tried if each.startswith("opened")
            ]
            framed = [frame.url for frame in tab.frames if frame is not tab.main_frame]
            assert framed == ["chrome-error://chromewebdata/"], "another page shows ours in a frame"
            tab.close()
        assert it.robot.heard(Stop) == [] and it.picture.stop is None and not it.picture.pending


def test_a_rebound_name_shows_why_it_is_refused_and_nothing_else(browser: Browser, tmp_path: Path) -> None:
    with page_of(tmp_path) as (it, page):
        port = page.port
        tab = browser.new_page()
        answer = tab.goto(f"http://evil.example:{port}/")
        assert answer is not None and answer.status == 403
        expect(tab.locator("body")).to_contain_text("not served under the name evil.example")
        expect(tab.locator("body")).to_contain_text("page_names")
        opened = "() => new Promise((done) => { const s = new WebSocket(`ws://${location.host}`, [%s]);"
        opened += " s.onopen = () => done(true); s.onclose = () => done(false); })"
        assert tab.evaluate(opened % json.dumps(SUBPROTOCOL)) is False
        assert it.robot.heard(Stop) == []
        tab.close()


def pump(source: socket.socket, sink: socket.socket) -> None:
    """Pass on what comes until one of both ends."""
    with suppress(OSError):
        while data := source.recv(65536):
            sink.sendall(data)
    with suppress(OSError):
        sink.shutdown(socket.SHUT_WR)


@contextmanager
def proxy_to(port: int) -> Iterator[int]:
    """A proxy that passes each connection on and rewrites `Host`, as many do by default."""

    class Handler(socketserver.BaseRequestHandler):
        def handle(self) -> None:
            head = b""
            while b"\r\n\r\n" not in head:
                if not (data := self.request.recv(65536)):
                    return
                head += data
            rewritten = re.sub(rb"(?im)^host:[^\r]*", b"Host: 127.0.0.1:%d" % port, head, count=1)
            with socket.create_connection(("127.0.0.1", port)) as server:
                server.sendall(rewritten)
                back = threading.Thread(target=pump, args=(server, self.request))
                back.start()
                pump(self.request, server)
                back.join()

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server.server_address[1]
        finally:
            server.shutdown()
            thread.join()


def test_the_page_works_behind_a_proxy_that_rewrites_the_host_once_its_name_is_configured(
    browser: Browser, tmp_path: Path
) -> None:
    # The proxy's port must be in the name, and the page's must be in the proxy: the proxy finds the page late.
    with socket.create_server(("127.0.0.1", 0)) as probe:
        page_port = probe.getsockname()[1]
    with proxy_to(page_port) as proxy_port:
        access = PageAccess(names=(f"http://console.example:{proxy_port}",), token="the-token-of-this-test")
        with page_of(tmp_path, access, page_port) as (it, _):
            tab = browser.new_page()
            refused = tab.goto(f"http://console.example:{proxy_port}/")
            assert refused is not None and refused.status == 403
            expect(tab.locator("body")).to_contain_text("needs its token")
            tab.goto(f"{access.address(page_port)}&fixedDpr=0.25")
            assert "token" not in tab.url and "fixedDpr" in tab.url
            expect(tab.locator("[data-tp=mode]")).to_have_text("DISARMED", timeout=WAIT_MS)
            tab.get_by_role("button", name="STOP", exact=True).click()
            it.robot.wait_for(Stop)
            tab.close()
