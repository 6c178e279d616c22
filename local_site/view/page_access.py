"""Access to the page: by name, by origin, and from other machines by a token.

A browser carries a request of any web page to any address that it can reach. `Host` and `Origin` tell such a
request from one of our own page; both come from outside, so they are compared with names that we know, not
with each other.
"""

from __future__ import annotations

import contextlib
import hmac
import html
import secrets
from collections.abc import Sequence
from dataclasses import dataclass, field
from http import HTTPStatus
from pathlib import Path
from urllib.parse import parse_qsl, urlencode, urlsplit

from farhand.common.address import is_loopback
from farhand.common.errors import InvalidConfiguration
from farhand.common.whole_file import read_whole, write_whole
from farhand.local_site.view.host_name import EVERY_ADDRESS, Name, default_gateway, reachable_address

TOKEN_FIELD = "token"
_TOKEN_BYTES, _MOST_TOKEN_BYTES = 16, 4096


@dataclass(frozen=True)
class Visit:
    """HTTP request, including the one that opens a websocket.

    Args:
        target: Path and query.
        headers: Names in lower case with their values, in order.
        peer: Address of the sender.
        arrived_at: Address of this machine at which it arrived.
    """

    target: str
    headers: Sequence[tuple[str, str]]
    peer: str
    arrived_at: str

    def all(self, header: str) -> list[str]:
        """Return each value of a header."""
        return [value for name, value in self.headers if name == header]

    @property
    def query(self) -> list[tuple[str, str]]:
        """Fields of the query; none of a target that is no path."""
        with contextlib.suppress(ValueError):
            return parse_qsl(urlsplit(self.target).query, keep_blank_values=True)
        return []

    def cookies(self, name: str) -> list[str]:
        """Return the values of a cookie."""
        pairs = (part.strip().partition("=") for line in self.all("cookie") for part in line.split(";"))
        return [value for key, _, value in pairs if key == name]


@dataclass(frozen=True)
class HttpReply:
    """Reply to a visit in place of the page.

    Args:
        status: HTTP status.
        page: HTML.
        headers: Headers beyond the usual ones.
        why: Reason and remedy of a refusal, for the log: the browser shows no refusal of a websocket.
    """

    status: HTTPStatus
    page: str
    headers: dict[str, str] = field(default_factory=dict)
    why: str = ""


@dataclass(frozen=True)
class PageAccess:
    """Address of the page, and rules of access.

    Args:
        host: Address to bind; `0.0.0.0` or `::` for every address of this machine.
        names: Further hosts that browsers reach the page by, such as a proxy's: `HOST`, `HOST:PORT` or an origin.
            A proxy's visitors come from loopback too, so with names everybody needs the token.
        token: Token that visitors from other machines must show.
        published_at: Where the port of a container is published on the container's machine, such as
            `127.0.0.1:8080`; empty outside of one. At loopback, only that machine can come in, and it comes from the
            container's gateway: it needs no token. Who reaches the container in another way comes from elsewhere.

    Raises:
        InvalidConfiguration: When a name has another form.
    """

    host: str = "127.0.0.1"
    names: tuple[str, ...] = ()
    token: str = field(default_factory=lambda: secrets.token_urlsafe(_TOKEN_BYTES), repr=False)
    published_at: str = ""

    def __post_init__(self) -> None:
        for field_name, name in [
            *(("page_names", name) for name in self.names),
            *([("page_published_at", self.published_at)] if self.published_at else []),
        ]:
            if Name.of(name) is None:
                raise InvalidConfiguration(
                    "configuration", field_name,
                    f"hosts as in the page's address, such as https://console.example, got {name!r}",
                )  # fmt: skip

    def judge(self, visit: Visit, port: int, to_talk: bool) -> HttpReply | None:
        """Return the reply that refuses a visit; None to admit it.

        Args:
            visit: The request.
            port: Port of the page.
            to_talk: True for the opening of a websocket, through which a visitor could press buttons.
        """
        hosts, origins = visit.all("host"), visit.all("origin")
        host = Name.of(hosts[0]) if len(hosts) == 1 else None
        if host is None or not self._is_ours(host, visit.arrived_at):
            shown = f"under the name {host.host}" if host else "without a name"
            return _refused(
                f"This console is not served {shown}.",
                "If it should be, add the name to page_names in the configuration of the local site.",
            )
        origin = Name.of(origins[0]) if len(origins) == 1 else None
        if to_talk and origins and not (origin and self._is_own_page(origin, host)):
            return _refused(
                "This console takes commands from its own page alone, and not from one of "
                f"{origin.host if origin else 'a strange origin'}.",
                "Open its own address; where a proxy stands before it, add the proxy's name to page_names in the "
                "configuration of the local site.",
            )
        if self._needs_no_token(visit, host):
            return None
        cookie = f"farhand-{port}"
        if any(key == TOKEN_FIELD and self._opens(value) for key, value in visit.query):
            return None if to_talk else _remember(visit, cookie, self.token)
        if any(map(self._opens, visit.cookies(cookie))):
            return None
        return _refused(
            "This console needs its token.",
            f"Open the address that the terminal of the local site printed: it contains ?{TOKEN_FIELD}=... "
            "The browser keeps it in a cookie.",
        )

    def address(self, port: int) -> str:
        """Return the address to open in a browser, with the token where it is needed."""
        secret = f"/?{TOKEN_FIELD}={self.token}"
        name = Name.of(self.names[0]) if self.names else None
        if name is None and self._published_at_loopback:
            return f"http://{self.published_at}"
        if name is None:
            host = Name(reachable_address(self.host)).in_url
            return f"http://{host}:{port}{'' if Name(self.host).is_loopback else secret}"
        proxied = Name(self.host).is_loopback
        scheme = name.scheme or ("https" if proxied else "http")
        at = name.port or (None if proxied or name.scheme else port)
        return f"{scheme}://{name.in_url}{f':{at}' if at else ''}{secret}"

    def _is_ours(self, host: Name, arrived_at: str) -> bool:
        """Decide whether the page is served under a name.

        An address cannot be rebound, a foreign name can.
        """
        known = [self.host] if self.host not in EVERY_ADDRESS else [arrived_at]
        known += [name.host for name in map(Name.of, self.names) if name is not None]
        return host.is_loopback or host.host in (each.lower() for each in known)

    def _is_own_page(self, origin: Name, host: Name) -> bool:
        named = (name for name in map(Name.of, self.names) if name is not None)
        return origin.same_origin(host) or any(map(origin.same_origin, named))

    def _needs_no_token(self, visit: Visit, host: Name) -> bool:
        own = is_loopback(visit.peer) or (self._published_at_loopback and visit.peer == default_gateway())
        return not self.names and host.is_loopback and own

    @property
    def _published_at_loopback(self) -> bool:
        name = Name.of(self.published_at) if self.published_at else None
        return name is not None and name.is_loopback

    def _opens(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(errors="replace"), self.token.encode())


def kept_token(folder: Path) -> str:
    """Return the token that a folder keeps, a new one at first: open tabs survive a restart of the site.

    If it cannot be kept, it is valid until the site ends.
    """
    path, new = folder / "page-token", secrets.token_urlsafe(_TOKEN_BYTES)
    with contextlib.suppress(OSError, UnicodeError):
        kept = read_whole(path, _MOST_TOKEN_BYTES).decode("ascii").strip()
        if len(kept) >= len(new):
            return kept
    with contextlib.suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)  # what was damaged, with its mode
        write_whole(path, new.encode("ascii"), 0o600)
    return new


def _refused(what: str, remedy: str) -> HttpReply:
    words = "".join(f"<p>{html.escape(line)}</p>" for line in (what, remedy))
    return HttpReply(
        HTTPStatus.FORBIDDEN,
        f'<!doctype html><meta charset="utf-8"><title>Farhand: refused</title>'
        f'<body style="font: 18px sans-serif; max-width: 40em; margin: 3em auto">{words}',
        why=f"{what} {remedy}",
    )


def _remember(visit: Visit, cookie: str, token: str) -> HttpReply:
    """Move the token from the address bar into a cookie that no other site can use."""
    rest = [(key, value) for key, value in visit.query if key != TOKEN_FIELD]
    kept = f"{cookie}={token}; Path=/; HttpOnly; SameSite=Lax; Max-Age=31536000"
    return HttpReply(HTTPStatus.SEE_OTHER, "", {"Location": f"./?{urlencode(rest)}", "Set-Cookie": kept})
