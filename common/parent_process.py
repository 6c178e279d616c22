"""Coupling of a process to its parent: it ends when the process that started it dies, however that dies."""

from __future__ import annotations

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1


def end_with_parent(parent_pid: int) -> None:
    """Have SIGTERM sent to this process when the parent dies, or at once if it is dead. Linux only.

    Args:
        parent_pid: The parent's process id, as the parent itself knew it.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
        if os.getppid() != parent_pid:
            os.kill(os.getpid(), signal.SIGTERM)
