"""One motion whose numbers are computed by hand, written in the ways of other programs."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from farhand.local_site.recordings.importing import Understood, understand
from farhand.local_site.recordings.options import ImportOptions

N = 11
TIMES_S = [0.05 * k for k in range(N)]
POSITIONS_M = [(0.1 + 0.01 * k, 0.2, 0.3 - 0.02 * k) for k in range(N)]
DEGREES = [10.0 * k for k in range(N)]
"""Turn about the vertical axis."""
QUATS_WXYZ = [(math.cos(math.radians(d) / 2), 0.0, 0.0, math.sin(math.radians(d) / 2)) for d in DEGREES]
SAMPLES = list(zip(TIMES_S, POSITIONS_M, QUATS_WXYZ, strict=True))


MOTIVE = "\n".join(
    [
        "Format Version,1.23,Take Name,take,Capture Frame Rate,20.0,Rotation Type,Quaternion,Length Units,Millimeters",
        "",
        ",Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body",
        ",Name,Plug,Plug,Plug,Plug,Plug,Plug,Plug,Plug",
        ",ID,7A,7A,7A,7A,7A,7A,7A,7A",
        ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error",
        "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,",
        *(
            f"{k},{t},{q[1]},{q[2]},{q[3]},{q[0]},{1e3 * p[0]},{1e3 * p[1]},{1e3 * p[2]},0.1"
            for k, (t, p, q) in enumerate(SAMPLES)
        ),
    ]
)
VICON = "\n".join(
    [
        "Objects", "20", ",,Plug:Plug,,,,,", "Frame,Sub Frame,RX,RY,RZ,TX,TY,TZ", ",,deg,deg,deg,mm,mm,mm",
        *(f"{k + 1},0,0,0,{DEGREES[k]},{1e3 * p[0]},{1e3 * p[1]},{1e3 * p[2]}" for k, (_, p, _) in enumerate(SAMPLES)),
    ]
)  # fmt: skip


def read(file: Path, **options) -> list[Understood]:
    return understand(file, ImportOptions(**options))


def assert_true(understood: Understood, *, oriented: bool = True, n_dims: int = 3, tolerance: float = 1e-9):
    """The motion is the one of this module."""
    made = understood.demonstration
    np.testing.assert_allclose(made.time_s, TIMES_S, atol=1e-6)
    np.testing.assert_allclose(made.position_m, np.array(POSITIONS_M)[:, :n_dims], atol=tolerance)
    assert (made.quat_wxyz is not None) == oriented
    if made.quat_wxyz is not None:
        same = np.abs(np.sum(made.quat_wxyz * np.array(QUATS_WXYZ), axis=1))
        np.testing.assert_allclose(same, 1.0, atol=tolerance)


def words(understood: Understood, subject: str) -> str:
    """What the preview says about a subject."""
    return "; ".join(text for name, text in understood.told if name == subject)
