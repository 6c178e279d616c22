"""Cameras of one's own that behave well and badly, as a package that a process of its own finds."""

from __future__ import annotations

import os
from pathlib import Path

from farhand.deploy.places import find_task
from farhand.remote_site.camera.camera_process import CameraProcess
from farhand.remote_site.camera.process import Setup
from farhand.remote_site.config import DriverChoice, RemoteConfig

MODULE = """
import os, threading
import numpy as np
from farhand import CameraImage


class Camera:
    def __init__(self, task, options):
        self.does = options["does"]
        if self.does == "refuse":
            raise ValueError("no such device: /dev/video7")

    def capture(self):
        if self.does == "die":
            os._exit(3)
        if self.does == "hang":
            threading.Event().wait()
        if self.does == "raise":
            raise RuntimeError("the cable is unplugged")
        black = np.zeros((90, 160, 3), np.uint8)
        print("a library that talks on the standard output", flush=True)
        return {
            "work": CameraImage(black + 128, age_s=0.25), "nothing": None, "list": [[0, 0, 0]],
            "grey": CameraImage(black[..., 0]), "floats": CameraImage(black / 2), "old": CameraImage(black, age_s=np.nan),
        }[self.does]
"""


def put_camera(folder: Path) -> None:
    """Put a package with the cameras `mine` and `missing` into a folder, which `PYTHONPATH` must name."""
    (folder / "my_camera.py").write_text(MODULE, encoding="utf-8")
    about = folder / "my_camera-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: my-camera\nVersion: 1.0\n", encoding="utf-8"
    )
    points = "[farhand.cameras]\nmine = my_camera:Camera\nmissing = no_such_module:Camera\n"
    (about / "entry_points.txt").write_text(points, encoding="utf-8")


def camera(does: str, use: str = "mine", answer_s: float = 60.0) -> CameraProcess:
    """A camera of one's own in a process of its own."""
    config = RemoteConfig(camera=DriverChoice(use, {"does": does}))
    return CameraProcess(Setup(os.getpid(), config, find_task("planar"), None), answer_s)
