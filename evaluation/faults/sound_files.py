"""Sound contents of every file that Farhand reads: what its mutants are made of."""

from __future__ import annotations

import json
import tempfile
from functools import cache
from io import BytesIO
from pathlib import Path

import msgspec
import numpy as np

from farhand.common.link.certificates import RIGHTS_FILE
from farhand.common.model.model_file import encode
from farhand.common.task import PointTask
from farhand.common.temporary_folder import temporary_folder
from farhand.deploy.pki.registry import Registry
from farhand.deploy.places import find_point_task
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import learn
from farhand.local_site.teaching.samples import sample_strokes
from farhand.local_site.teaching.task_library import TaskLibrary
from farhand.remote_site.interface.embodiment import ArmMemory
from farhand.remote_site.robots.plant_memory import PlantState

_DEPLOY = Path(__file__).resolve().parents[2] / "deploy"
_ROBOTS = _DEPLOY / "robots"


def _stroke(n_dims: int, moving: bool = False, n: int = 40) -> Demonstration:
    part = np.linspace(0.0, 1.0, n)[:, None]
    points = np.hstack([0.5 - 0.5 * part, 0.2 * np.sin(3.0 * part), 0.1 * part])[:, :n_dims]
    origin, rotation = np.zeros((1, n_dims)), np.eye(n_dims)[None]
    angle = 0.5 * part[:, 0]
    return Demonstration(
        time_s=0.05 * np.arange(float(n)),
        position_m=points,
        quat_wxyz=np.stack([np.cos(angle), *[np.sin(angle) / np.sqrt(3.0)] * 3], axis=1)
        if n_dims == 3
        else None,
        frame_origin_m=np.broadcast_to(origin, (n, 1, n_dims)) + 0.1 * part[:, None] if moving else origin,
        frame_rotation=np.broadcast_to(rotation, (n, 1, n_dims, n_dims)) if moving else rotation,
        frame_names=("goal",),
        source="a study",
    )


@cache
def strokes() -> tuple[Demonstration, ...]:
    """Return demonstrations of a point and of poses, in a frame that stands and in one that moves."""
    return _stroke(2), _stroke(3), _stroke(2, moving=True), _stroke(3, moving=True)


@cache
def demonstrations() -> tuple[bytes, ...]:
    """Return their files."""
    return tuple(stroke.encode() for stroke in strokes())


@cache
def task() -> PointTask:
    """Return the task of the library."""
    return find_point_task("planar")


@cache
def models() -> tuple[bytes, ...]:
    """Return models of a point and of poses."""
    return tuple(encode(learn([stroke])) for stroke in strokes()[:2])


@cache
def texts(*names: str) -> tuple[bytes, ...]:
    """Return the files of these names as they come with Farhand."""
    return tuple((_DEPLOY / name).read_bytes() for name in names)


@cache
def robots() -> tuple[bytes, ...]:
    """Return a robot file that names its model from everywhere."""
    text = (_ROBOTS / "panda-urdf.toml").read_text(encoding="utf-8")
    for name in ("panda.urdf", "meshes"):
        text = text.replace(f'"{name}"', json.dumps(str(_ROBOTS / name)))
    return (text.encode(),)


@cache
def recordings() -> tuple[bytes, ...]:
    """Return another laboratory's archive, in millimetres."""
    out = BytesIO()
    np.savez(out, pos=np.stack([1e3 * strokes()[0].position_m] * 2), t=strokes()[0].time_s)
    return (out.getvalue(),)


@cache
def columns() -> tuple[bytes, ...]:
    """Return tables of a motion, in English and in German notation."""
    rows = [(0.05 * k, 10.0 * k, 200.0 - k, 3.0, 0.6, 0.0, 0.8, 0.0) for k in range(40)]
    named = [
        "time_s,plug_x_mm,plug_y_mm,plug_z_mm,plug_qw,plug_qx,plug_qy,plug_qz",
        *(",".join(map(str, row)) for row in rows),
    ]
    text = "\n".join(named)
    return text.encode(), text.replace(",", ";").replace(".", ",").encode("utf-16")


@cache
def states() -> tuple[bytes, ...]:
    """Return states of robots before and after a model was taken."""
    arm = ArmMemory((0.1,) * 6, (0.5, 0.0, 0.4, 1.0, 0.0, 0.0, 0.0), 12.5, (0.0,) * 6)
    states = PlantState((0.1, 0.2)), PlantState((0.3, 0.4), "ab" * 32), PlantState((0.1, 0.2), "", arm)
    return tuple(msgspec.json.encode(state) for state in states)


@cache
def library_files(n: int) -> dict[str, bytes]:
    """Return a task's folder after n demonstrations, with another one in progress."""
    with tempfile.TemporaryDirectory() as data_dir:
        library = TaskLibrary(task(), Path(data_dir))
        first = sample_strokes(task())[0].samples(slice(0, 60))
        for _ in range(n):
            library.learn([first])
        library.record(first.frames_at(0))
        for point, time_s in zip(first.points, first.time_s, strict=True):
            library.hand(point, float(time_s))
        library.set_aside()
        return {file.name: file.read_bytes() for file in (Path(data_dir) / task().name).iterdir()}


def events() -> tuple[bytes, ...]:
    """Return a log with three events, and an empty one."""
    line = json.dumps(
        {"time": "2026-01-01T00:00:00.000+00:00", "what": "mode", "text": "HOLD", "measured": None}
    )
    return ((line + "\n").encode() * 3, b"")


@cache
def authority_files() -> dict[str, bytes]:
    """Return the files of an authority that has issued the certificates that the sites' files name, by their paths."""
    with tempfile.TemporaryDirectory(dir=temporary_folder()) as name:
        folder = Path(name) / "authority"
        registry = Registry.create(folder, "sound")
        registry.issue("rov1", "robot", ("127.0.0.1",), 365)
        registry.issue("shore-1", "operator", (), 90)
        files = (file for file in folder.rglob("*") if file.is_file())
        return {str(file.relative_to(folder)): file.read_bytes() for file in files}


def rights() -> tuple[bytes, ...]:
    """Return an authority's list of who may command."""
    return (authority_files()[RIGHTS_FILE],)


def write_identities(folder: Path) -> None:
    """Write certificates and the list of sites into a folder, unless they are there."""
    for name, content in authority_files().items():
        place = folder / name.removeprefix("sites/")
        if name.startswith("sites") and not place.exists():
            place.parent.mkdir(exist_ok=True)
            place.write_bytes(content)


def sound_files() -> dict[str, bytes]:
    """Return a sound file of every kind that a command takes, by its name."""
    names = ("local.toml", "remote.toml")
    configurations = dict(zip(names, texts(*names), strict=True))
    return {
        **configurations,
        "d.npz": demonstrations()[0],
        "m.farhand": models()[0],
        "r.npz": recordings()[0],
        "r.csv": columns()[0],
    }
