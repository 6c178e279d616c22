"""Operator's hand: arrows at the tip of the operator's arm, to teach, or to drive while coupled; rings on request."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import viser
from numpy.typing import NDArray

from farhand.common.clock import elapsed_s
from farhand.local_site.console import intents
from farhand.local_site.view.scene.nodes import put

Array = NDArray[np.float64]
Act = Callable[[int, Callable[[], None]], None]

SIZE_M = 0.24
"""Length of the arrows [m]."""
_REACH_M = 2.0
"""No hand is further away from the arm's base than this [m]."""


class HandGizmo:
    """Gizmo that turns drags into intents. Its callback only enqueues; the page's thread does the rest.

    Args:
        scene: Scene of the server.
        parent: Name of the node of the operator's arm's base.
        submit: Hands an intent to the console.
        act: Has a tab's action done.
    """

    def __init__(
        self, scene: viser.SceneApi, parent: str, submit: Callable[[intents.Intent], None], act: Act
    ):
        self._submit, self._held = submit, False
        self._hand = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
        self._node = scene.add_transform_controls(
            f"{parent}/hand", SIZE_M, line_width=3.0, depth_test=False, opacity=0.9,
            disable_rotations=True, disable_sliders=True,
        )  # fmt: skip

        @self._node.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            pose = np.concatenate([event.target.position, event.target.wxyz])
            if event.client_id is not None:
                act(event.client_id, partial(self._drag, event.phase, pose))

    def draw(self, tip: Array) -> None:
        """Place the gizmo at the arm's tip, unless somebody holds it. Shape (7,)."""
        if not self._held:
            put(self._node, tip)

    def show_rings(self, shown: bool) -> None:
        """Show the rings that turn the plug, or the arrows alone."""
        self._node.disable_rotations = not shown

    def lead(self, phase: str, pose: Array) -> None:
        """Move the hand as if by a drag: "update", or "end". A pose of shape (7,)."""
        put(self._node, pose)
        self._drag(phase, pose)

    def let_go(self) -> None:
        """End the drag of a closed tab."""
        if self._held:
            self._drag("end", self._hand)

    def _drag(self, phase: str, pose: Array) -> None:
        """Check a drag that a tab sends; a bad pose changes nothing, but the hand still lets go."""
        good = np.isfinite(pose).all() and np.abs(pose[:3]).max() <= _REACH_M and pose[3:].any()
        if not good and phase != "end":
            return
        if good:
            self._hand = np.concatenate([pose[:3], pose[3:] / np.linalg.norm(pose[3:])])
        self._held = phase != "end"
        self._submit(intents.Hand(tuple(self._hand.tolist()), elapsed_s(), released=not self._held))
