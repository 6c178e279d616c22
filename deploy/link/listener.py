"""Listening sockets, with an error that says what to do when the port is taken."""

from __future__ import annotations

import errno
import os
import socket

from farhand.common.errors import LinkError, PortTaken

Address = tuple[str, int]
"""Host and port."""


def bind(address: Address, receive_buffer_bytes: int = 0) -> socket.socket:
    """A non-blocking socket that listens.

    Args:
        address: Host and port; port 0 takes a free one.
        receive_buffer_bytes: Size of the kernel's buffer of each connection; 0 leaves it to the kernel.

    Raises:
        LinkError: The port is in use, not allowed or out of range, or the address is not of this machine.
    """
    host, port = address
    if not 0 <= port <= 65535:
        raise LinkError(f"cannot listen on {host} port {port}: choose a port up to 65535")
    sock: socket.socket | None = None
    try:
        family, kind, _, _, resolved = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        sock = socket.socket(family, kind)
        if os.name == "posix":  # elsewhere this would let two processes share the port
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if receive_buffer_bytes:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer_bytes)
        sock.bind(resolved)
        sock.listen()
        sock.setblocking(False)
    except OSError as error:
        if sock:
            sock.close()
        kind = PortTaken if error.errno == errno.EADDRINUSE else LinkError
        raise kind(_explain(host, port, error)) from error
    return sock


def _explain(host: str, port: int, error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        return f"port {port} on {host} is in use: end the process that holds it, or choose another port"
    remedy = "choose an address of this machine and a free port"
    return f"cannot listen on {host} port {port}: {error.strerror}; {remedy}"
