"""A process that ends when the one that started it dies, however that dies."""

from __future__ import annotations

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1


def end_with_parent(parent_pid: int) -> None:
    """Be sent SIGTERM when the parent dies; at once, if it is dead already. Only Linux can do that.

    Args:
        parent_pid: The parent's process id, as the parent itself knew it.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
        if os.getppid() != parent_pid:
            os.kill(os.getpid(), signal.SIGTERM)
