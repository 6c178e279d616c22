"""The local process: link, library, console; a scripted operator or a page in front of it."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from common.errors import InvalidConfiguration, LinkError
from common.link import ZenohLink
from common.link_control import RelayControl
from common.task import Task
from local_site.config import LocalConfig
from local_site.console import Console
from local_site.scripted_operator import PlannedOutage, ScriptedOperator
from local_site.task_library import TaskLibrary

_log = logging.getLogger(__name__)


class LocalSite:
    """One operator's place.

    Args:
        config: Endpoints, names, timeouts.
        task: What is taught and done.
        data_dir: Where demonstrations and models are kept.
    """

    def __init__(self, config: LocalConfig, task: Task, data_dir: Path):
        self._config, self._task = config, task
        self._library = TaskLibrary(task, data_dir)
        self._stop = threading.Event()

    def stop(self) -> None:
        """Ask the site to end; safe in a signal handler."""
        self._stop.set()

    def run(self, ready: Callable[[], None]) -> None:
        """Serve until stopped. See `run_script` for the arguments and errors."""
        with _Opened(self._config, self._task, self._library, self._stop):
            ready()
            self._stop.wait()

    def run_script(self, outage: PlannedOutage | None, ready: Callable[[], None]) -> dict[str, Any]:
        """Have the scripted operator do the job once.

        Args:
            outage: How to cut the link on the way, or None.
            ready: Called once the robot has reported.

        Returns:
            The result, see `ScriptedOperator.run`.

        Raises:
            LinkError: When the robot does not report in time.
            JobFailed: When a step of the job did not come to its end.
        """
        control = relay_control(self._config.link_control)
        with _Opened(self._config, self._task, self._library, self._stop) as console:
            ready()
            return ScriptedOperator(console, self._task, control, outage, self._config.seed).run()


class _Opened:
    """The console while the link is open, connected to the robot."""

    def __init__(self, config: LocalConfig, task: Task, library: TaskLibrary, stop: threading.Event):
        self._config, self._stop = config, stop
        self._link = ZenohLink(config.link)
        self._console = Console(task, library, self._link, config.site_name)

    def __enter__(self) -> Console:
        try:
            self._console.start()
            where, timeout_s = self._config.link.connect, self._config.connect_timeout_s
            _log.info("connecting to the robot at %s", where)
            reported = self._console.wait_for(lambda p: p.robot is not None or self._stop.is_set(), timeout_s)
            if not reported:
                raise LinkError(
                    f"no robot reported at {where} within {timeout_s:g} s: is the remote site running, "
                    "and does the link lead there?"
                )
        except BaseException:
            self.__exit__()
            raise
        return self._console

    def __exit__(self, *_: object) -> None:
        self._console.close()
        self._link.close()


def relay_control(address: str) -> RelayControl | None:
    """The link process's control at host:port, or None for an empty address.

    Raises:
        InvalidConfiguration: When the address is not of that form.
    """
    if not address:
        return None
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal():
        raise InvalidConfiguration("configuration", "link_control", f"host:port, got {address!r}")
    return RelayControl(host, int(port))
