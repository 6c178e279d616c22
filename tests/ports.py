"""Free ports of this machine."""

from __future__ import annotations

from farhand.common.address import free_port as free_port
