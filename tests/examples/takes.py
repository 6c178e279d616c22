"""The takes of `examples/motion_capture`, written as a motion capture writes them: `python -m tests.examples.takes`.

The scripted operator's demonstrations of the hot-stab, as two rigid bodies of markers would show them: the grip of the
plug, whose tip is 150 mm along its -y, and the receptacle. Millimetres, y up, 25 Hz, noise of 0.2 mm and 0.1 degrees,
and some samples in which markers were hidden.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from farhand.deploy.places import sample_files
from farhand.local_site.teaching.demonstration import Demonstration

FOLDER = Path(__file__).parents[2] / "examples" / "motion_capture"
N_TAKES, EVERY = 3, 4
TIP_M, TIP_AXES = np.array([0.0, -0.15, 0.0]), Rotation.from_rotvec([np.pi / 2, 0.0, 0.0])
Y_UP = Rotation.from_matrix([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def take(number: int) -> str:
    """The text of one take."""
    shown = Demonstration.load(sample_files("hot-stab")[number - 1]).thinned(EVERY)
    assert shown.quat_wxyz is not None
    rng = np.random.default_rng(number)
    tip = Y_UP * Rotation.from_quat(shown.quat_wxyz, scalar_first=True)
    grip = tip * TIP_AXES.inv()
    grip_m = Y_UP.apply(shown.position_m.copy()) - grip.apply(TIP_M)
    receptacle = Y_UP * Rotation.from_matrix(np.broadcast_to(shown.frame_rotation[0], (len(grip_m), 3, 3)))
    receptacle_m = np.broadcast_to(Y_UP.apply(shown.frame_origin_m[0].copy()), grip_m.shape)
    hidden = set(rng.choice(np.arange(20, len(grip_m) - 20), size=4, replace=False).tolist())
    bodies = [_measured(rng, grip_m, grip), _measured(rng, receptacle_m, receptacle)]
    lines = list(_header())
    for k, time_s in enumerate(shown.time_s):
        cells = [
            cell
            for body, hides in zip(bodies, (True, False), strict=True)
            for cell in (["" for _ in body[k]] if hides and k in hidden else body[k])
        ]
        lines.append(",".join([str(k), f"{time_s:.3f}", *cells]))
    return "\r\n".join(lines) + "\r\n"


def _measured(rng: np.random.Generator, position_m: np.ndarray, turned: Rotation) -> list[list[str]]:
    """Cells of a body: quaternion x, y, z, w and position in mm, with the noise of the measurement."""
    noisy = turned * Rotation.from_rotvec(np.radians(0.1) * rng.normal(size=(len(position_m), 3)))
    position_mm = 1e3 * position_m + 0.2 * rng.normal(size=position_m.shape)
    return [
        [*(f"{c:.6f}" for c in quat), *(f"{c:.3f}" for c in p)]
        for quat, p in zip(noisy.as_quat(), position_mm, strict=True)
    ]


def _header() -> Iterator[str]:
    yield "Format Version,1.23,Take Name,hot-stab,Capture Frame Rate,25.000,Rotation Type,Quaternion,Length Units,Millimeters"
    yield ""
    yield ",Type" + ",Rigid Body" * 14
    yield ",Name" + ",Plug" * 7 + ",Socket" * 7
    yield ",ID" + ",9A61" * 7 + ",9A62" * 7
    yield "," + (",Rotation" * 4 + ",Position" * 3) * 2
    yield "Frame,Time (Seconds)" + ",X,Y,Z,W,X,Y,Z" * 2


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for n in range(1, N_TAKES + 1):
        (FOLDER / f"take-{n}.csv").write_bytes(take(n).encode())
