"""Process of the local site: link, library and console, operated by a script or through a page."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import structs

from farhand.common.address import parse_address
from farhand.common.arm.cell import Cell
from farhand.common.errors import LinkError
from farhand.common.impairment.link_control import RelayControl
from farhand.common.json_lines import JsonLinesFile
from farhand.common.link.connection_faults import explain_silence
from farhand.common.link.fleet import Fleet
from farhand.common.link.link import ZenohLink
from farhand.common.process_status import DataFolder, OperatorFacts
from farhand.common.task import TaskSet
from farhand.common.whole_file import Claim
from farhand.common.wire.messages import Wish
from farhand.common.wire.scene_description import SceneDescription
from farhand.local_site.config import LocalConfig
from farhand.local_site.console.console import Console
from farhand.local_site.console.facts import operator_facts
from farhand.local_site.exchange.fetching import KnownScenes
from farhand.local_site.exchange.rights import RightsWatch
from farhand.local_site.learning.warm_up import warm_up
from farhand.local_site.script.scripted_actions import PlannedOutage
from farhand.local_site.script.scripted_operator import ScriptedOperator
from farhand.local_site.teaching.library import Library
from farhand.local_site.workcell.workcell import SampleFiles, Workcell, make_workcell, no_files

if TYPE_CHECKING:
    from farhand.local_site.view.page import Page

_log = logging.getLogger(__name__)

_RELAY_ANSWERS_S = 1.0
_SILENT_S = 5.0
"""Silence of the robot after which its probable reason is logged [s]."""


class LocalSite:
    """Process of one operator's site.

    Args:
        config: Endpoints, timeouts.
        name: Name by which the robot and other operators know this site.
        tasks: Tasks to teach and execute.
        data_dir: Folder of demonstrations and models.
        sample_files: Returns the demonstrations that come with each task, if they are not in its own file.
        cell: The operator's arm in front of its receptacle, for the tasks of an arm.
        token_dir: Folder of the page's token, the same for all robots of an operator; None for `data_dir`.
    """

    def __init__(
        self,
        config: LocalConfig,
        name: str,
        tasks: TaskSet,
        data_dir: Path,
        sample_files: SampleFiles = no_files,
        cell: Cell | None = None,
        token_dir: Path | None = None,
    ):
        self._name, self._cell, self._token_dir = name, cell, token_dir or data_dir
        self._config, self._tasks, self._sample_files = config, tasks, sample_files
        self._claim = Claim(data_dir / "operator", "what was taught")
        self._library = Library(tasks, data_dir)
        self._event_log = data_dir / "operator" / name / "events.jsonl"
        self._data_dir, self._stop = data_dir, threading.Event()
        self._opened_now: _Opened | None = None

    def stop(self) -> None:
        """Ask the site to end; safe in a signal handler."""
        self._stop.set()

    def data_folder(self) -> DataFolder:
        """Return the state of the folder of demonstrations and models; from any thread."""
        opened = self._opened_now
        return DataFolder.of(self._data_dir, opened.log.error if opened is not None else None)

    def facts(self) -> OperatorFacts | None:
        """Return the state of this site, None while it starts; from any thread, and it may take a second."""
        opened = self._opened_now
        if opened is None:
            return None
        page = opened.page.address if opened.page is not None else ""
        return operator_facts(
            opened.console, page, relay_control(self._config.link_control, _RELAY_ANSWERS_S)
        )

    def warm_up(self) -> None:
        """Compile the kernels of the learner: some seconds at the first start on a machine."""
        first = self._tasks.first
        warm_up(first.space, len(first.frame_names))

    def run(self, ready: Callable[..., None]) -> None:
        """Serve until stopped.

        Args:
            ready: Called once the robot has reported; with the page's address, if there is a page.

        Raises:
            LinkError: When the robot does not report in time, or the page's address is not available.
        """
        with self._opened(page_port=self._config.page_port) as opened:
            ready(**({"page": opened.page.address} if opened.page is not None else {}))
            self._stop.wait()
        self._claim.release()

    def run_script(self, outage: PlannedOutage | None, ready: Callable[[], None]) -> dict[str, Any]:
        """Have the scripted operator do the job once.

        Args:
            outage: Outage during the execution; None for none.
            ready: Called once the robot has reported.

        Returns:
            The result, see `ScriptedOperator.run`.

        Raises:
            LinkError: When the robot does not report in time.
            JobFailed: When a step of the job failed.
        """
        control = relay_control(self._config.link_control)
        with self._opened(stepped=True) as opened:
            ready()
            return ScriptedOperator(opened.console, self._tasks, control, outage, self._config.seed).run()

    def _opened(self, page_port: int = 0, stepped: bool = False) -> _Opened:
        self.warm_up()
        first = self._tasks.first
        log = JsonLinesFile(self._event_log)
        place = make_workcell(first, self._cell, self._sample_files, self._config.seed, stepped)
        own = self._own_scene() if page_port else None
        opened = _Opened(
            self._config, self._name, self._library, place, log, self._stop, page_port, own, self._data_dir,
            self._token_dir,
        )  # fmt: skip
        self._opened_now = opened
        return opened

    def _own_scene(self) -> SceneDescription | None:
        """Return the drawing of the operator's own arm, None without one."""
        if self._cell is None:
            return None
        # Imported here: boards do not need the arm's physics.
        from farhand.common.arm.simulation.description import describe

        return describe(self._cell)


class _Opened:
    """Console while the link is open, connected to the robot; with a page if a port is given."""

    def __init__(
        self,
        config: LocalConfig,
        name: str,
        library: Library,
        place: Workcell,
        log: JsonLinesFile,
        stop: threading.Event,
        page_port: int,
        own: SceneDescription | None,
        data_dir: Path,
        token_dir: Path,
    ):
        self._token_dir = token_dir
        self._config, self._library, self._stop, self._page_port = config, library, stop, page_port
        self.log, self._data_dir, self._own = log, data_dir, own
        self._name, self._link = name, ZenohLink(structs.replace(config.link, site=name))
        wish = Wish.WATCH if config.watch else Wish.CONTROL
        self.console = Console(
            library, self._link, name, log, wish, rate_bps=config.link.rate_bps, place=place,
            known=KnownScenes(data_dir / "scenes", (own,)) if own is not None else None,
        )  # fmt: skip
        self.page: Page | None = None
        self._fleet: Fleet | None = None
        self._rights: RightsWatch | None = None

    def __enter__(self) -> _Opened:
        try:
            self.console.start()
            if self._config.link.certificates:
                self._rights = RightsWatch(
                    self._link, self._config.link.speaks_as, self._config.link.vehicle,
                    self.console.is_served, self.console.refused,
                )  # fmt: skip
            if self._page_port:
                self.page = self._open_page()
            self._wait_for_robot()
        except BaseException:
            self.__exit__()
            raise
        if not self._stop.is_set():
            _log.info("the robot reports")
        return self

    def _wait_for_robot(self) -> None:
        """Wait for the robot's first report; after some seconds log the probable reason of its silence.

        Raises:
            LinkError: When no report came in time.
        """
        where, timeout_s = self._config.link.connect, self._config.connect_timeout_s
        for_how_long = f"for at most {timeout_s:g} s" if timeout_s else "without a time limit"
        _log.info("connecting to the robot at %s, %s", where, for_how_long)
        first_s = min(timeout_s or _SILENT_S, _SILENT_S)
        if self._robot_reports(first_s):
            return
        if why := explain_silence(self._config.link, bool(self._link.connected_to())):
            _log.warning("the robot has not reported yet: %s", why)
        if (timeout_s <= first_s and timeout_s) or not self._robot_reports(
            timeout_s - first_s if timeout_s else None
        ):
            hint = why or "is the remote site running, and does the link lead there?"
            raise LinkError(f"no robot reported at {where} within {timeout_s:g} s: {hint}")

    def _robot_reports(self, timeout_s: float | None) -> bool:
        """Wait for a report, or for the end of the site."""
        return self.console.wait_for(lambda p: p.robot is not None or self._stop.is_set(), timeout_s)

    def __exit__(self, *_: object) -> None:
        if self.page is not None:
            self.page.close()
        for part in (self._rights, self._fleet):
            if part is not None:
                part.close()
        self.console.close()
        self._link.close()
        self.log.close()

    def _open_page(self) -> Page:
        """Open the page before the robot has reported: it shows that it waits."""
        # Imported here: it takes half a second, and a site without a page does not need it.
        from farhand.local_site.view.page import Page
        from farhand.local_site.view.page_access import PageAccess, kept_token
        from farhand.local_site.view.robot_choice import RobotsAtHub

        control = relay_control(self._config.link_control)
        config = self._config
        access = PageAccess(
            config.page_host, config.page_names, kept_token(self._token_dir), config.page_published_at
        )  # fmt: skip
        robots = None
        if pages := config.page_ports:
            self._fleet = Fleet(structs.replace(config.link, site=self._name), tuple(pages))
            addresses = {name: access.address(port) for name, port in pages.items()}
            robots = RobotsAtHub(config.link.vehicle, addresses, self._fleet.states)
        page = Page(
            self.console,
            self._library.task,
            control,
            access,
            self._page_port,
            self._own,
            robots,
            self._link.warning,
        )
        page.start()
        _log.info("the page is at %s", page.address)
        return page


def relay_control(address: str, timeout_s: float = 5.0) -> RelayControl | None:
    """Return the control of the link process at HOST:PORT, or None for an empty address.

    Raises:
        InvalidConfiguration: When the address has another form.
    """
    if not address:
        return None
    return RelayControl(*parse_address(address, "link_control", "configuration"), timeout_s)
