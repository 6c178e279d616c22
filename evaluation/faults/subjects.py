"""The files of Farhand that are mutated: sound ones to begin with, and what the product does with a file.

`use` returns whether the file was accepted; what it raises but `FarhandError`, and what it accepts wrongly, is a
finding.
"""

from __future__ import annotations

import contextlib
import json
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import msgpack
import msgspec
import numpy as np

from farhand.common.configuration import load_toml
from farhand.common.impairment.link_profile import load_profiles
from farhand.common.json_lines import JsonLinesFile
from farhand.common.link.certificates import RIGHTS_FILE
from farhand.common.link.endpoint import zenoh_configuration
from farhand.common.model.model_file import decode, encode, load
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import TPHSMM
from farhand.common.task import PointTask
from farhand.common.temporary_folder import temporary_folder
from farhand.deploy.pki.registry import Registry
from farhand.deploy.places import find_point_task, find_tasks
from farhand.deploy.rollout import roll_out
from farhand.evaluation.faults.bounds import WrongResult
from farhand.evaluation.faults.mutants import (
    Mutate,
    Random,
    archive_mutant,
    bytes_mutant,
    text_mutant,
    tree_mutant,
)
from farhand.local_site.config import LocalConfig
from farhand.local_site.recordings.importing import read_demonstrations, understand
from farhand.local_site.recordings.options import ImportOptions
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import learn_files
from farhand.local_site.teaching.samples import sample_strokes
from farhand.local_site.teaching.task_library import TaskLibrary
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.interface.embodiment import ArmMemory
from farhand.remote_site.robots.plant_memory import PlantMemory, PlantState

_DEPLOY = Path(__file__).resolve().parents[2] / "deploy"


@dataclass(frozen=True)
class Subject:
    """A kind of file.

    Args:
        file: Its name.
        seeds: Sound contents.
        mutate: Makes mutants of them.
        use: What the product does with the file in a folder; returns whether it is accepted.
    """

    file: str
    seeds: Callable[[], tuple[bytes, ...]]
    mutate: Mutate
    use: Callable[[Path], bool]


# Sound contents ---------------------------------------------------------------------------------


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
def _strokes() -> tuple[Demonstration, ...]:
    return _stroke(2), _stroke(3), _stroke(2, moving=True), _stroke(3, moving=True)


@cache
def _demonstrations() -> tuple[bytes, ...]:
    return tuple(stroke.encode() for stroke in _strokes())


@cache
def _task() -> PointTask:
    return find_point_task("planar")


@cache
def _model_of(number: int) -> TPHSMM:
    from farhand.local_site.teaching.offline_learning import learn

    return learn([_strokes()[number]])


@cache
def _models() -> tuple[bytes, ...]:
    return encode(_model_of(0)), encode(_model_of(1))


@cache
def _texts(*names: str) -> tuple[bytes, ...]:
    return tuple((_DEPLOY / name).read_bytes() for name in names)


@cache
def _recordings() -> tuple[bytes, ...]:
    from io import BytesIO

    out = BytesIO()
    np.savez(out, pos=np.stack([1e3 * _strokes()[0].position_m] * 2), t=_strokes()[0].time_s)
    return (out.getvalue(),)


@cache
def _columns() -> tuple[bytes, ...]:
    rows = [(0.05 * k, 10.0 * k, 200.0 - k, 3.0, 0.6, 0.0, 0.8, 0.0) for k in range(40)]
    named = [
        "time_s,plug_x_mm,plug_y_mm,plug_z_mm,plug_qw,plug_qx,plug_qy,plug_qz",
        *(",".join(map(str, row)) for row in rows),
    ]
    text = "\n".join(named)
    return text.encode(), text.replace(",", ";").replace(".", ",").encode("utf-16")


@cache
def _states() -> tuple[bytes, ...]:
    arm = ArmMemory((0.1,) * 6, (0.5, 0.0, 0.4, 1.0, 0.0, 0.0, 0.0), 12.5, (0.0,) * 6)
    states = PlantState((0.1, 0.2)), PlantState((0.3, 0.4), "ab" * 32), PlantState((0.1, 0.2), "", arm)
    return tuple(msgspec.json.encode(state) for state in states)


# What the product does with them ----------------------------------------------------------------


def _learn(file: Path) -> bool:
    model = learn_files([file])
    if decode(encode(model)).n_demonstrations != 1:
        raise WrongResult("the model is not of the demonstration")
    return True


def _show_and_roll_out(file: Path) -> bool:
    model = load(file)
    content = encode(model)
    once, twice = decode(content), decode(encode(decode(content)))
    # The last bit may differ: what is kept in half precision is rounded again.
    for name in ("means", "covariances", "slopes", "duration_mean_s", "transition"):
        if not np.allclose(getattr(once, name), getattr(twice, name), rtol=1e-2, atol=1e-6):
            raise WrongResult(f"a model that was read and written has other {name}")
    if sum(content) % 8 == 0 or content in _models():  # a rollout takes longer than all the rest
        like = _strokes()[model.manifold.oriented]
        if model.n_dims == like.n_dims and model.n_frames == 1:
            moved = roll_out(model, replace(like, frame_names=model.frame_names))
            if not np.isfinite(moved.position_m).all():
                raise WrongResult("a rollout that ends nowhere")
    return True


def _take_task(file: Path) -> bool:
    for task in find_tasks(str(file)):
        _ = task.space, task.learning
        if isinstance(task, PointTask):
            for stroke in sample_strokes(task):
                TaskFrame.at(stroke.position_m[-1])
    return True


def _configure(kind: Any, file: Path) -> bool:
    write_identities(file.parent)
    with contextlib.chdir(file.parent):
        zenoh_configuration(load_toml(file, kind).link)
    return True


def _import(file: Path) -> bool:
    return bool(read_demonstrations(file, ImportOptions(kind="lasa")))


def _understand(file: Path) -> bool:
    return bool(understand(file, ImportOptions()))


def _begin_library(name: str, file: Path) -> bool:
    """Start with a library of which one file is a mutant; the others are there and sound."""
    folder, content = file.parent / _task().name, file.read_bytes()
    folder.mkdir(exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    for each, sound in _library_files().items():
        (folder / each).write_bytes(content if each == name else sound)
    library = TaskLibrary(_task(), file.parent)
    if any("\n" in fault for fault in library.faults):
        raise WrongResult("a fault is told in more than a line")
    if name != "library.json" and not 1 <= len(library.demonstrations) <= 2:
        raise WrongResult("the sound demonstration does not count any more")
    _ = library.left_over, library.strokes, library.revisions
    return not library.faults


@cache
def _library_files() -> dict[str, bytes]:
    """Return a task's folder after two demonstrations, with one in progress."""
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as data_dir:
        library = TaskLibrary(_task(), Path(data_dir))
        first = sample_strokes(_task())[0].samples(slice(0, 60))
        library.learn([first])
        library.learn([first])
        library.record(first.frames_at(0))
        for point, time_s in zip(first.points, first.time_s, strict=True):
            library.hand(point, float(time_s))
        library.set_aside()
        return {file.name: file.read_bytes() for file in (Path(data_dir) / _task().name).iterdir()}


def _one_of_library(suffix: str) -> str:
    return sorted(name for name in _library_files() if name.endswith(suffix))[0]


def _boot(file: Path) -> bool:
    memory = PlantMemory(file)
    try:
        state = memory.load(2)
    finally:
        memory.close()
    if state is not None and not np.isfinite(state._numbers()).all():
        raise WrongResult("a robot nowhere")
    return state is not None


def _append_event(file: Path) -> bool:
    log = JsonLinesFile(file, max_bytes=10_000)
    log.append(what="a study", text="an event")
    log.close()
    if json.loads(file.read_bytes().splitlines()[-1])["what"] != "a study":
        raise WrongResult("the event is not the last line")
    return True


def _profiles(file: Path) -> bool:
    for profile in load_profiles(file).values():
        profile.over_time().at(3.0)
    return True


def _tree_of_model(random: Random, data: bytes) -> bytes:
    if random.random() < 0.4:
        return bytes_mutant(random, data)
    try:
        return msgpack.packb(tree_mutant(random, msgpack.unpackb(data))) or b""
    except (ValueError, OverflowError):  # what MessagePack does not have
        return bytes_mutant(random, data)


def _tree_of_json(random: Random, data: bytes) -> bytes:
    if random.random() < 0.4:
        return bytes_mutant(random, data)
    try:
        return json.dumps(tree_mutant(random, json.loads(data))).encode()
    except TypeError:  # what JSON does not have
        return bytes_mutant(random, data)


def _tree_of_lines(random: Random, data: bytes) -> bytes:
    lines = data.splitlines() or [b"{}"]
    at = int(random.integers(0, len(lines)))
    lines[at] = _tree_of_json(random, lines[at])
    return b"\n".join(lines)


def _events() -> tuple[bytes, ...]:
    line = json.dumps(
        {"time": "2026-01-01T00:00:00.000+00:00", "what": "mode", "text": "HOLD", "measured": None}
    )
    return ((line + "\n").encode() * 3, b"")


@cache
def _identities() -> dict[str, bytes]:
    """Make the certificates and the list of sites that the sites' files name."""
    with tempfile.TemporaryDirectory(dir=temporary_folder()) as name:
        registry = Registry.create(Path(name), "sound")
        folders = (
            registry.issue("rov1", "robot", ("127.0.0.1",), 365),
            registry.issue("shore-1", "operator", (), 90),
        )
        made = {RIGHTS_FILE: (Path(name) / RIGHTS_FILE).read_bytes()}
        for folder in folders:
            made |= {f"{folder.name}/{file.name}": file.read_bytes() for file in folder.iterdir()}
        return made


def write_identities(folder: Path) -> None:
    """Write certificates and the list of sites into a folder, unless they are there."""
    for name, content in _identities().items():
        if not (folder / name).exists():
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(content)


def sound_files() -> dict[str, bytes]:
    """Return a sound file of every kind that a command takes, by its name."""
    names = ("local.toml", "remote.toml")
    texts = dict(zip(names, _texts(*names), strict=True))
    return {**texts, "d.npz": _demonstrations()[0], "m.farhand": _models()[0], "r.npz": _recordings()[0]}


SUBJECTS = {
    "demonstration": Subject("d.npz", _demonstrations, archive_mutant, _learn),
    "foreign recording": Subject("r.npz", _recordings, archive_mutant, _import),
    "foreign recording, text": Subject("r.csv", _columns, text_mutant, _understand),
    "model": Subject("m.farhand", _models, _tree_of_model, _show_and_roll_out),
    "task": Subject(
        "t.toml", partial(_texts, "tasks/planar.toml", "tasks/hot-stab.toml"), text_mutant, _take_task
    ),
    "configuration, local": Subject("c.toml", partial(_texts, "local.toml"), text_mutant, partial(_configure, LocalConfig)),
    "configuration, remote": Subject(
        "c.toml", partial(_texts, "remote.toml"), text_mutant, partial(_configure, RemoteConfig)
    ),
    "link profiles": Subject("p.toml", partial(_texts, "link_profiles.toml"), text_mutant, _profiles),
    "library, list": Subject(
        "l", lambda: (_library_files()["library.json"],), _tree_of_json, partial(_begin_library, "library.json")
    ),
    "library, demonstration": Subject(
        "l",
        lambda: (_library_files()[_one_of_library(".npz")],),
        archive_mutant,
        lambda file: _begin_library(_one_of_library(".npz"), file),
    ),
    "library, under way": Subject(
        "l", lambda: (_library_files()["under-way.jsonl"],), _tree_of_lines, partial(_begin_library, "under-way.jsonl")
    ),
    "state": Subject("state.json", _states, _tree_of_json, _boot),
    "events": Subject("events.jsonl", _events, _tree_of_lines, _append_event),
}  # fmt: skip
