"""A real `farhand up` for the browser tests: the three processes, each at a port of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections import deque
from pathlib import Path
from types import TracebackType

from tests.ports import free_port

_READY = "all three are ready"
_END_PATIENCE_S = 20.0


class Stack:
    """Both sites, the link and the page, until the end of the `with` block.

    Args:
        data_dir: Where demonstrations and models go.
        link: Profile of the link.
    """

    def __init__(self, data_dir: Path, link: str = "lan"):
        self.address = f"http://127.0.0.1:{(port := free_port())}"
        self._command = [
            sys.executable, "-m", "deploy.cli", "up", "--task=planar", f"--link={link}", f"--port={port}",
            f"--data-dir={data_dir}",
        ]  # fmt: skip
        self._words: deque[str] = deque(maxlen=40)
        self._ready = threading.Event()

    def __enter__(self) -> Stack:
        self._process = subprocess.Popen(self._command, stderr=subprocess.PIPE, text=True)
        self._reader = threading.Thread(target=self._listen, name="stack")
        self._reader.start()
        self._ready.wait()
        if self._process.poll() is not None:
            self._reader.join()
            raise RuntimeError("farhand up did not start:\n" + "\n".join(self._words))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.send_signal(signal.SIGINT)
        try:
            self._process.wait(_END_PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join()

    def process_id(self, role: str) -> int:
        """The child that is the `local`, `remote` or `link` process."""
        pid = self._process.pid
        for child in map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split()):
            if role in Path(f"/proc/{child}/cmdline").read_text().split("\0"):
                return child
        raise LookupError(role)

    def kill(self, role: str) -> None:
        """End one of the three without warning."""
        os.kill(self.process_id(role), signal.SIGKILL)

    def _listen(self) -> None:
        assert self._process.stderr is not None
        with self._process.stderr as lines:
            for line in lines:
                self._words.append(line.rstrip())
                if _READY in line:
                    self._ready.set()
        self._ready.set()
