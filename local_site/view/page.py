"""Operator's page: its one thread draws the console's state and turns events into intents."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from functools import partial

import viser

from farhand.common.clock import elapsed_s
from farhand.common.impairment.link_control import RelayControl
from farhand.common.log import loop_logger
from farhand.common.model.manifold import POSE
from farhand.common.task import AnyTask, ArmTask, PointTask
from farhand.common.wire.scene_description import SceneDescription
from farhand.local_site.console.console import Console
from farhand.local_site.console.console_state import ConsoleState
from farhand.local_site.view.page_access import PageAccess
from farhand.local_site.view.panels import buttons
from farhand.local_site.view.panels.actions import ActionLine
from farhand.local_site.view.panels.buttons import Buttons, ButtonSpec
from farhand.local_site.view.panels.camera_panel import CameraPanel
from farhand.local_site.view.panels.charts import LinkHistory, TransitionGraph
from farhand.local_site.view.panels.choices import Legend, PaceSlider, TaskChoice, add_height_slider
from farhand.local_site.view.panels.drawer import Drawer
from farhand.local_site.view.panels.guidance import AdvicePanel
from farhand.local_site.view.panels.hand_panel import HandPanel
from farhand.local_site.view.panels.html import Html, element
from farhand.local_site.view.panels.link_panel import LinkWorker
from farhand.local_site.view.panels.list_panels import EventPanel
from farhand.local_site.view.panels.status_strip import StatusStrip
from farhand.local_site.view.panels.tables import DemonstrationList, ExecutionList
from farhand.local_site.view.panels.words.controls import Folder, Label
from farhand.local_site.view.panels.words.lists import TAKES_OVER
from farhand.local_site.view.redraw import Extent, Redraw
from farhand.local_site.view.robot_choice import RobotChoice, RobotsAtHub
from farhand.local_site.view.robot_half import RobotHalf
from farhand.local_site.view.scene.arm.arm_scene import ArmScene
from farhand.local_site.view.scene.board.planar_scene import PlanarScene
from farhand.local_site.view.scene.ghost import RobotPicture
from farhand.local_site.view.server import PageServer
from farhand.local_site.view.sessions import Sessions
from farhand.local_site.view.tabs import Tabs

_log = loop_logger(__name__)

_PERIOD_S = 1.0 / 30.0
_BEAT_S = 1.0
_DRAWER_PX = 300


class Page:
    """Web page of one console.

    Args:
        console: The operator's console.
        task: A task of the robot; its kind decides which scene is drawn.
        control: Control of the simulated link; None without one.
        access: Address of the page, and rules of access.
        port: Port; 0 takes a free one.
        own: Description of the operator's arm, for the tasks of an arm.
        robots: Robots at the hub, with the page of each; None for a single robot.
        warning: Returns what is wrong with the link's security, empty if nothing is; shown in red.

    Raises:
        LinkError: When the address or the port is not available.
    """

    def __init__(
        self,
        console: Console,
        task: AnyTask,
        control: RelayControl | None,
        access: PageAccess,
        port: int,
        own: SceneDescription | None = None,
        robots: RobotsAtHub | None = None,
        warning: Callable[[], str] = lambda: "",
    ):
        self._console, self._warning = console, warning
        self._events: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._shown: ConsoleState = console.picture
        self._sessions = Sessions()
        self._server = PageServer(access, port, self._sessions, self._refused)
        self._worker = LinkWorker(control, console.rate_bps) if control is not None else None
        self._build_head(self._server.gui, task)
        self._build_foot(self._server.gui)
        self._robots = RobotChoice(self._server.gui, robots)
        self._scene = self._make_scene(task, own)
        self._drawer = Drawer(
            self._server.gui, console.submit, self._act, self._on_press, self._server.save_in, self._scene.layers, self._worker,
        )  # fmt: skip
        self._build_view(self._server.gui)
        self._hand = HandPanel(self._server.gui, self._act, self._scene.jog)
        self._tabs = Tabs(self._server, self._sessions, self._scene, self._events.put)
        self._redraw = Redraw()
        self._beat_s, self._beats = float("-inf"), 0
        self._thread = threading.Thread(target=self._run, name="page", daemon=True)

    @property
    def address(self) -> str:
        """Address to open in a browser."""
        return self._server.address

    @property
    def port(self) -> int:
        """Port of the page."""
        return self._server.bound_port

    @property
    def tabs_open(self) -> tuple[int, ...]:
        """Open tabs."""
        return self._sessions.tabs

    def start(self) -> None:
        """Start drawing and listening."""
        if self._worker is not None:
            self._worker.start()
        self._thread.start()

    def close(self) -> None:
        """Close the page; the tabs show that it is gone."""
        self._events.put(None)
        self._thread.join(timeout=5.0)
        if self._worker is not None:
            self._worker.close()
        self._server.stop()

    # What is on the page ------------------------------------------------------------------------

    def _make_scene(self, task: AnyTask, own: SceneDescription | None) -> PlanarScene | ArmScene:
        if isinstance(task, ArmTask):
            assert own is not None, "the task of an arm is shown with one"
            return ArmScene(self._server.scene, own, self._console.submit, self._act)
        return PlanarScene(self._server.scene, task, self._console.submit, self._happened.explain, self._act)

    def _build_head(self, gui: viser.GuiApi, task: AnyTask) -> None:
        """Build what never scrolls: STOP, the band, the steps, and the action line with the advice."""
        gui.main_panel.dock_left()
        gui.main_panel.set_width(_DRAWER_PX)
        self._beat, self._strip = Html(gui), StatusStrip(gui, self._warning)
        self._stop = Buttons(gui, (buttons.STOP,), self._on_press)
        self._server.incoming.open_to_everybody(*self._stop.handles)
        with gui.add_folder(Folder.TASK):
            self._task = TaskChoice(gui, self._shown, self._console.submit, self._act)
        with gui.add_folder(Folder.NEXT):
            gui.add_html('<i class="fh-here fh-here-actions"></i>')
            self._guidance = AdvicePanel(gui)
            self._line = ActionLine(gui, buttons.EVERY, self._on_press)
            self._pace = PaceSlider(gui, self._console.submit, self._act)
            if isinstance(task, PointTask) and task.n_dims == POSE.n_dims:
                add_height_slider(gui, task, self._act, lambda height_m: self._scene.lift(height_m))  # noqa: PLW0108 (made later)
        with gui.add_folder(Folder.WATCHING):
            gui.add_html('<i class="fh-here fh-here-take"></i>')
            self._open_button(Label.TAKE_OVER, lambda tab: self._tabs.take_over(tab))  # noqa: PLW0108 (made later)
        with gui.add_folder(Folder.ANOTHER_TAB):
            gui.add_html('<i class="fh-here fh-here-keep"></i>')
            gui.add_html(f'<div class="fh-asked" role="alert">{TAKES_OVER}</div>')
            self._open_button(Label.KEEP_CONTROL, lambda tab: self._tabs.keep(tab))  # noqa: PLW0108 (made later)

    def _build_foot(self, gui: viser.GuiApi) -> None:
        """Build the tabs at the bottom: what was, what was taught, and how the link is."""
        self._happened, self._robot_half = EventPanel(gui), RobotHalf(gui, self._act)
        self._executions, self._demonstrations = ExecutionList(gui), DemonstrationList(gui)
        self._graph, self._history = TransitionGraph(gui), LinkHistory(gui)

    def _build_view(self, gui: viser.GuiApi) -> None:
        """Build what stands over the canvas: the views, each tab's own, and the legend, which hides and shows."""
        with gui.add_folder(Folder.VIEW):
            gui.add_html('<i class="fh-here fh-here-view"></i>')
            for view in self._scene.views:
                self._open_button(view, lambda tab, view=view: self._tabs.look(tab, view))
        with gui.add_folder(Folder.LEGEND):
            gui.add_html('<i class="fh-here fh-here-legend"></i>')
            self._legend = Legend(gui, self._scene.layers, self._act)
            self._camera = CameraPanel(gui, self._console.submit, self._act)

    def _open_button(self, label: str, do: Callable[[int], None]) -> None:
        """Add a button that works in watching tabs, too: it is about the tab alone."""
        handle = buttons.add_tab_button(self._server.gui, label, do, self._events.put)
        self._server.incoming.open_to_everybody(handle)

    # Events, from the server's threads: they only enqueue ---------------------------------------

    def _on_press(self, tab: int, spec: ButtonSpec) -> None:
        if spec is buttons.STOP:
            self._console.submit(spec.make(None))  # of any tab, and not delayed by the page's thread
            return
        self._act(tab, lambda: self._console.submit(spec.make(self._shown.mode)))

    def _refused(self, tab: int) -> None:
        self._events.put(partial(self._do_if_active, tab, lambda: None))

    def _act(self, tab: int, do: Callable[[], None]) -> None:
        self._events.put(partial(self._do_if_active, tab, do))

    # The owner ----------------------------------------------------------------------------------

    def _do_if_active(self, tab: int, do: Callable[[], None]) -> None:
        if self._sessions.acts(tab):
            do()
        else:
            self._tabs.refused(tab)

    def _run(self) -> None:
        due_s = elapsed_s()
        while True:
            try:
                event = self._events.get(timeout=max(due_s - elapsed_s(), 0.0))
            except queue.Empty:
                due_s = elapsed_s() + _PERIOD_S
                event = self._look
            else:
                self._redraw.soon()
            if event is None:
                return
            try:
                event()
            except Exception:  # one bad event must not end the page
                _log.exception("the page could not do something")

    def _look(self) -> None:
        """Draw the console's state, if it has changed."""
        state, now_s = self._console.picture, elapsed_s()
        self._robot_half.note(state, now_s)
        self._hand.move(state, now_s)
        extent = self._redraw.due(state, now_s, self._robot_half.plays)
        if extent is not Extent.NOTHING:
            self._draw(state, now_s, extent)

    def _draw(self, state: ConsoleState, now_s: float, extent: Extent) -> None:
        """Show a state of the console; each part sends only its changes, and all of them wake the server once."""
        self._shown = state
        picture = self._robot_half.draw(state, now_s)
        with self._server.atomic():
            self._scene.draw(state, picture)
            self._hand.draw(state)
            if extent is Extent.ALL:
                self._draw_words(state, picture, now_s)
        self._server.flush()

    def _draw_words(self, state: ConsoleState, picture: RobotPicture, now_s: float) -> None:
        if now_s - self._beat_s >= _BEAT_S:
            self._beat_s, self._beats = now_s, self._beats + 1
            self._beat.show(element("beat", self._beats, "fh-beat"))
        past = picture.then_s is not None
        self._line.draw(state, past)
        self._drawer.draw(state, self._line.hidden, now_s)
        self._legend.draw()
        self._demonstrations.draw(state, self._scene.layers.hidden_demonstrations)
        self._pace.draw(state, now_s)
        self._strip.draw(state, picture, now_s)
        self._camera.draw(state, picture.ghost, bool(self.tabs_open) and not past, now_s)
        self._history.draw(state, self._drawer.link_name, now_s)
        self._tabs.draw(state.recording, now_s)
        for part in (
            self._stop, self._task, self._guidance, self._happened, self._executions, self._graph, self._robots,
        ):  # fmt: skip
            part.draw(state)
