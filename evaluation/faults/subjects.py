"""The files of Farhand that are mutated: sound ones to begin with, and what the product does with a file.

`use` returns whether the file was accepted; what it raises but `FarhandError`, and what it accepts wrongly, is a
finding.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from farhand.common.arm.robot_file import load_robot
from farhand.common.arm.robot_model import arm_spec
from farhand.common.configuration import load_toml
from farhand.common.impairment.link_profile import load_profiles
from farhand.common.json_lines import JsonLinesFile
from farhand.common.link.certificates import RIGHTS_FILE
from farhand.common.link.endpoint import zenoh_configuration
from farhand.common.model.model_file import decode, encode, load
from farhand.common.model.task_frame import TaskFrame
from farhand.common.task import PointTask
from farhand.deploy.places import find_tasks
from farhand.deploy.rollout import roll_out
from farhand.evaluation.faults import sound_files
from farhand.evaluation.faults.bounds import WrongResult
from farhand.evaluation.faults.mutants import (
    Mutate,
    archive_mutant,
    json_mutant,
    lines_mutant,
    packed_mutant,
    text_mutant,
)
from farhand.local_site.config import LocalConfig
from farhand.local_site.recordings.importing import read_demonstrations, understand
from farhand.local_site.recordings.options import ImportOptions
from farhand.local_site.teaching.offline_learning import learn_files
from farhand.local_site.teaching.samples import sample_strokes
from farhand.local_site.teaching.task_library import TaskLibrary
from farhand.remote_site.config import RemoteConfig
from farhand.remote_site.robots.plant_memory import PlantMemory

WHOLE = 8
"""Of as many mutants, one is given all that takes longer than all the rest: a rollout, a library with more in it."""


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
    if sum(content) % WHOLE == 0 or content in sound_files.models():
        like = sound_files.strokes()[model.manifold.oriented]
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


def _take_robot(file: Path) -> bool:
    arm_spec(load_robot(file))
    return True


def _configure(kind: Any, file: Path) -> bool:
    sound_files.write_identities(file.parent)
    with contextlib.chdir(file.parent):
        zenoh_configuration(load_toml(file, kind).link)
    return True


def _configure_with_rights(file: Path) -> bool:
    """Configure a robot that is sound but for its list of sites."""
    robot = file.with_name("remote.toml")
    robot.write_bytes(sound_files.texts(robot.name)[0])
    return _configure(RemoteConfig, robot)


def _import(file: Path) -> bool:
    return bool(read_demonstrations(file, ImportOptions(kind="lasa")))


def _understand(file: Path) -> bool:
    return bool(understand(file, ImportOptions()))


def _begin_library(files: dict[str, bytes], name: str, file: Path) -> bool:
    """Start with a library of which one file is a mutant; the others are there and sound."""
    folder, content = file.parent / sound_files.task().name, file.read_bytes()
    folder.mkdir(exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    for each, sound in files.items():
        (folder / each).write_bytes(content if each == name else sound)
    library = TaskLibrary(sound_files.task(), file.parent)
    if any("\n" in fault for fault in library.faults):
        raise WrongResult("a fault is told in more than a line")
    n_sound = sum(each.endswith(".npz") and each != name for each in files)
    if name != "library.json" and not n_sound <= len(library.demonstrations) <= n_sound + 1:
        raise WrongResult("the sound demonstrations do not count any more")
    _ = library.left_over, library.strokes, library.revisions
    return not library.faults


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


def _library(suffix: str, mutate: Mutate, n: int) -> Subject:
    """Return the first file with this end of its name, in a library of n demonstrations, as a subject.

    One in some mutants is among one sound demonstration more, as each is learned again at every start.
    """

    def files(n: int) -> tuple[dict[str, bytes], str]:
        found = sound_files.library_files(n)
        return found, min(name for name in found if name.endswith(suffix))

    def contents() -> tuple[bytes, ...]:
        found, name = files(n)
        return (found[name],)

    def use(file: Path) -> bool:
        return _begin_library(*files(n + (sum(file.read_bytes()) % WHOLE == 0)), file)

    return Subject("l", contents, mutate, use)


def _texts(*names: str) -> Callable[[], tuple[bytes, ...]]:
    return partial(sound_files.texts, *names)


SUBJECTS = {
    "demonstration": Subject("d.npz", sound_files.demonstrations, archive_mutant, _learn),
    "foreign recording": Subject("r.npz", sound_files.recordings, archive_mutant, _import),
    "foreign recording, text": Subject("r.csv", sound_files.columns, text_mutant, _understand),
    "model": Subject("m.farhand", sound_files.models, packed_mutant, _show_and_roll_out),
    "task": Subject("t.toml", _texts(*(f"tasks/{n}.toml" for n in ("planar", "hot-stab"))), text_mutant, _take_task),
    "robot": Subject("panda-urdf.toml", sound_files.robots, text_mutant, _take_robot),
    "configuration, local": Subject("c.toml", _texts("local.toml"), text_mutant, partial(_configure, LocalConfig)),
    "configuration, remote": Subject("c.toml", _texts("remote.toml"), text_mutant, partial(_configure, RemoteConfig)),
    "list of sites": Subject(RIGHTS_FILE, sound_files.rights, json_mutant, _configure_with_rights),
    "link profiles": Subject("p.toml", _texts("link_profiles.toml"), text_mutant, _profiles),
    "library, list": _library("library.json", json_mutant, 2),
    "library, demonstration": _library(".npz", archive_mutant, 1),
    "library, under way": _library("under-way.jsonl", lines_mutant, 0),
    "state": Subject("state.json", sound_files.states, json_mutant, _boot),
    "events": Subject("events.jsonl", sound_files.events, lines_mutant, _append_event),
}  # fmt: skip
