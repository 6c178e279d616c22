"""Contents that travel packed, and are named by the hash of what they hold."""

from __future__ import annotations

import hashlib
import zlib

MOST_BYTES = 4_000_000
"""Largest size of a content [B]."""


def pack(content: bytes) -> bytes:
    """Return a content as it travels."""
    return zlib.compress(content, 9)


def unpack(data: bytes, sha256: str) -> bytes | None:
    """Return the content with this SHA-256 that arrived as it is or packed; None if it has another hash.

    Never more than `MOST_BYTES` are unpacked.
    """
    if hashlib.sha256(data).hexdigest() == sha256:
        return data
    unpacking = zlib.decompressobj()
    try:
        content = unpacking.decompress(data, MOST_BYTES)
    except zlib.error:
        return None
    return content if unpacking.eof and hashlib.sha256(content).hexdigest() == sha256 else None
