"""The page of an arm's task as a test drives it: where things are in the picture, the arrows at the plug."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from playwright.sync_api import Locator, expect

from farhand.common.arm.cell import Cell
from farhand.common.arm.simulation.description import describe
from farhand.common.model.task_frame import TaskFrame
from farhand.deploy.places import find_robot
from farhand.local_site.view.scene.arm.arm_camera import Half, arm_camera
from farhand.local_site.view.scene.arm.hand_drag import SIZE_M
from farhand.local_site.workcell.arm_view import ArmView
from farhand.local_site.workcell.held_arm import HeldArm
from tests.browser.board_picture import blueness, picture_of
from tests.browser.operator_page import WAIT_MS, OperatorPage, Point
from tests.cells import JACO

Array = NDArray[np.float64]

_COLUMN_M = (0.0, 0.0, 0.12)
"""A place on every arm of this kind, whatever its joints [m]."""
_GRIP_M = 0.93 * SIZE_M
"""Where an arrow is taken hold of, from the plug's tip: by its head, away from the arcs [m]."""

DEEP = re.compile("(7[5-9]|8[0-9]|9[0-5]) mm deep")
_SEATED_OR_ENDED = """() => document.querySelector('[data-tp=phase]')?.textContent === 'SEATED'
  || document.querySelector('[data-tp=mode]')?.textContent !== 'AUTONOMOUS'"""
_EXECUTE = (("Preview", "plan", re.compile("^preview: [0-9]+ s left")), ("Execute", "mode", "AUTONOMOUS"))
_TOWARDS_SEATED = {
    "DISARMED": (("Arm", "mode", "HOLD"), *_EXECUTE),
    "HOLD": _EXECUTE,
    "AUTONOMOUS": (),
    "PAUSED": (("Resume", "mode", "AUTONOMOUS"),),
    "STOPPED": (("Reset", "mode", "DISARMED"), ("Arm", "mode", "HOLD"), *_EXECUTE),
}
"""What to press in each mode: on a busy machine the receptacle is out of sight for too long, or a deadline missed."""


@cache
def half_of(arm: str) -> Half:
    """The half of the scene that an arm needs, by its name."""
    return Half.of(describe(Cell(robot=find_robot(arm))))


class ArmPage(OperatorPage):
    """One tab of the operator's page of an arm's task."""

    seed = 0
    """Of where the operator's arm and receptacle are, see `new_place`."""
    arms = ("jaco", "jaco")
    """The operator's own arm, and the robot."""
    columns_m: tuple[ArrayLike, ArrayLike] = (_COLUMN_M, _COLUMN_M)
    """A place on each of them that is seen whatever its joints [m]."""

    @property
    def local(self) -> Locator:
        """What it says above the operator's arm."""
        return self.page.locator(".fh-local")

    def await_scene(self) -> None:
        """Wait until both arms are drawn where they belong: blue left and amber right."""

        def misplaced() -> str:
            picture = picture_of(self.page.screenshot())
            own, robot = (blueness(picture, self.arm_pixel(self.columns_m[it], it)) for it in (False, True))
            right = own > 40 and -robot > 40
            return "" if right else f"the arms are not drawn where they belong: {own}, {robot}"

        self.draw_until(misplaced)

    def arm_pixel(self, at_m: ArrayLike, remote: bool = False) -> Point:
        """Where a point is on the page, seen from the base of one of the arms [px]."""
        box = self.canvas.bounding_box()
        assert box is not None
        own, robot = map(half_of, self.arms)
        point = np.asarray(at_m) + (robot if remote else own).base_m(remote)
        across, down = arm_camera((box["width"], box["height"]), own, robot).pixel(point)
        return box["x"] + across, box["y"] + down

    def new_place(self, seed: int | None = None) -> ArmView:
        """Put the operator's arm and receptacle elsewhere, the next place or a later one; returns how they are."""
        for _ in range(1 if seed is None else seed - self.seed):
            self.press("New place")
            self.seed += 1
        done = self.tp("message").filter(has_text="your arm is back at ready")
        expect(done).to_have_count(self.seed, timeout=WAIT_MS)
        self.next_frame()
        return HeldArm("insert", JACO, self.seed).view()

    def execute_until_seated(self, *first: str) -> None:
        """Press what the page advises, until the plug is seated."""
        for button in (*first, "Send model"):
            self.advises(button)
            self.press(button)
        self.says("model", re.compile("robot has it"))
        self.seat(advised=True)

    def seat(self, advised: bool = False) -> None:
        """Press what leads from the robot's mode to a seated plug; where `advised`, the page must advise each at first."""
        for attempt in range(6):
            self._execute(advised and attempt == 0)
            self.page.wait_for_function(_SEATED_OR_ENDED, timeout=2.0 * WAIT_MS)
            if self.tp("phase").inner_text() == "SEATED":
                break
        else:
            raise AssertionError(f"the plug was never seated: {self.tp('message').all_inner_texts()}")
        self.says("depth", DEEP)

    def _execute(self, advised: bool) -> None:
        """Press what leads from the robot's mode to an execution, which does not begin if its preview ends before."""
        for button, name, words in _TOWARDS_SEATED[self.tp("mode").inner_text()]:
            if advised:
                self.advises(button)
            if button != "Execute":
                self.insist(button, name, words)
                continue
            # Where the preview's minute has run out, `seat` goes on from the robot's mode.
            with suppress(AssertionError):
                self.insist(button, name, words, last_ms=WAIT_MS / 6.0)

    @contextmanager
    def hold_arrow(
        self, tip: Array, axis: int, length_m: float, n_moves: int = 8, view_reset: bool = False
    ) -> Iterator[None]:
        """Take one of the arrows at the plug and drag it along itself; let go at the end of the block.

        Where the mouse misses the arrow, because the browser is busy drawing, the camera is turned instead.

        Args:
            tip: Pose of the plug's tip from the base of the operator's arm. Shape (7,).
            axis: 0, 1 or 2: of the tool.
            length_m: How far [m].
            n_moves: Of the mouse.
            view_reset: Whether `Both` was pressed already: a click takes a busy browser seconds.
        """
        if not view_reset:
            self.press("Both")
        mouse, frame = self.page.mouse, TaskFrame.at(tip)
        along = np.eye(3)[axis]
        mouse.move(*self.arm_pixel(frame.to_world(_GRIP_M * along)))
        self.next_frame()  # what is under the mouse is found when the page draws
        self.next_frame()
        mouse.down()
        self.next_frame()
        for part in np.linspace(0.0, 1.0, n_moves + 1)[1:]:
            mouse.move(*self.arm_pixel(frame.to_world((_GRIP_M + part * length_m) * along)))
            self.next_frame()
        try:
            yield
        finally:
            mouse.up()


def torso_m(arm: str) -> NDArray[np.float64]:
    """The middle of what stands at an arm's base [m]."""
    base = describe(Cell(robot=find_robot(arm))).links[0]
    return np.concatenate([mesh.vertices_m for mesh in base.meshes]).mean(axis=0).astype(float)


class BaxterPage(ArmPage):
    """One tab of the page between Baxter's arms."""

    arms = ("baxter-left", "baxter-right")
    columns_m = (torso_m("baxter-left"), torso_m("baxter-right"))


BAXTER = tuple(f"--{option}={arm}" for option, arm in zip(("own-arm", "robot"), BaxterPage.arms, strict=True))
"""Options of `farhand up` for Baxter's left arm at the operator's site, and its right arm as the robot."""
