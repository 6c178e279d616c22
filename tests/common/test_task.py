from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from farhand.common.configuration import load_toml
from farhand.common.errors import InvalidConfiguration
from farhand.common.impairment.link_profile import load_profiles
from farhand.common.task import PointTask, load_task
from farhand.local_site.config import LocalConfig
from farhand.remote_site.config import RemoteConfig

DEPLOY = Path(__file__).parents[2] / "deploy"
PLANAR = DEPLOY / "tasks" / "planar.toml"

MINIMAL = """
robot = "point"
name = "reach"
n_dims = 2
frame_names = ["goal"]
workspace_m = [1.0, 1.0]
start_m = [0.1, 0.1]
[target]
origin_m = [0.5, 0.5]
amplitude_m = [0.0, 0.0]
"""


def write(folder: Path, content: str | bytes) -> Path:
    file = folder / "task.toml"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


@pytest.mark.parametrize("file", sorted(PLANAR.parent.glob("*.toml")), ids=lambda file: file.stem)
def test_a_task_that_comes_with_farhand_is_valid_and_named_as_its_file(file: Path):
    task = load_task(file)
    assert task.name == file.stem
    if not isinstance(task, PointTask):
        return
    assert task.samples, "a newcomer needs something to learn from"
    for place in (task.start_m, *(point for sample in task.samples for point in sample.waypoints_m)):
        assert all(0.0 <= x <= edge for x, edge in zip(place, task.workspace_m, strict=True))


def test_the_target_of_the_planar_task_never_leaves_the_board():
    task = load_toml(PLANAR, PointTask)
    assert task.target.amplitude_m is not None
    for origin, amplitude, edge in zip(
        task.target.origin_m, task.target.amplitude_m, task.workspace_m, strict=True
    ):
        assert origin - amplitude > 0.0 and origin + amplitude < edge


def test_what_a_task_does_not_say_has_a_default(tmp_path: Path):
    task = load_toml(write(tmp_path, MINIMAL), PointTask)
    assert task.learning.max_distance_m is None and not task.require_preview and task.samples == ()


WRONG = {
    "an unknown field": (MINIMAL.replace("n_dims", "dims = 2\nn_dims"), "dims"),
    "a missing field": (MINIMAL.replace('frame_names = ["goal"]', ""), "frame_names"),
    "a wrong type": (MINIMAL.replace("n_dims = 2", 'n_dims = "two"'), "n_dims"),
    "four dimensions": (MINIMAL.replace("n_dims = 2", "n_dims = 4"), "n_dims"),
    "no frame": (MINIMAL.replace('["goal"]', "[]"), "frame_names"),
    "a name for a folder outside": (MINIMAL.replace('"reach"', '"../reach"'), "name"),
    "a start of another dimension": (MINIMAL.replace("[0.1, 0.1]", "[0.1, 0.1, 0.1]"), "start_m"),
    "a target of another dimension": (MINIMAL.replace("[0.5, 0.5]", "[0.5, 0.5, 0.5]"), "target.origin_m"),
    "a period of zero": (MINIMAL + "period_s = 0.0", "target.period_s"),
    "a number that is none": (MINIMAL + "noise_std_m = nan", "target.noise_std_m"),
    "an endless number": (MINIMAL.replace("[0.1, 0.1]", "[0.1, inf]"), "start_m"),
    "a sample of another dimension": (
        MINIMAL + "[[samples]]\nwaypoints_m = [[0.1, 0.1], [0.1, 0.1, 0.1]]",
        "samples",
    ),
    "a sample of one point": (MINIMAL + "[[samples]]\nwaypoints_m = [[0.1, 0.1]]", "samples"),
    "equal neighbouring points": (
        MINIMAL + "[[samples]]\nwaypoints_m = [[0.1, 0.1], [0.3, 0.2], [0.3, 0.2], [0.5, 0.5]]",
        "waypoints_m[1] and [2] are the same point: remove one",
    ),
    "equal points at the start": (
        MINIMAL + "[[samples]]\nwaypoints_m = [[0.1, 0.1], [0.1, 0.1]]",
        "waypoints_m[0] and [1] are the same point",
    ),
    "a frame whose place is not said": (
        MINIMAL.replace('["goal"]', '["gate", "goal"]'),
        "landmarks must be those of frame_names but the last (gate), got none",
    ),
    "the place of a frame that is none": (
        MINIMAL + "[landmarks.gate]\norigin_m = [0.1, 0.1]",
        "landmarks must be those of frame_names but the last (none), got gate",
    ),
    "a landmark of another dimension": (
        MINIMAL.replace('["goal"]', '["gate", "goal"]') + "[landmarks.gate]\norigin_m = [0.1, 0.1, 0.1]",
        "gate.origin_m",
    ),
    "two frames of one name": (MINIMAL.replace('["goal"]', '["goal", "goal"]'), "frame_names must differ"),
    "words that are markup": (MINIMAL + '[words]\nteach = "<b>Draw</b>"', "words.teach"),
    "another policy": (MINIMAL.replace("[target]", 'lost_link = "fly"\n[target]'), "lost_link"),
    "no TOML": ("name = = 3", "TOML"),
    "no text": (b"\xff\xfe\x00", "TOML"),
    "another robot": (MINIMAL.replace('"point"', '"boat"'), "robot"),
    "nothing": ("", "robot"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_named_with_its_file(tmp_path: Path, case: str):
    content, words = WRONG[case]
    file = write(tmp_path, content)
    with pytest.raises(InvalidConfiguration) as caught:
        load_task(file)
    assert str(file) in str(caught.value) and words in str(caught.value)


@pytest.mark.parametrize("missing", ["nowhere.toml", "."])
def test_a_file_that_cannot_be_read_is_named(tmp_path: Path, missing: str):
    with pytest.raises(InvalidConfiguration, match="readable"):
        load_toml(tmp_path / missing, PointTask)


@pytest.mark.parametrize("kind", ["task", "local", "remote", "profiles"])
def test_a_file_that_begins_with_a_byte_order_mark_is_read_like_any_other(tmp_path: Path, kind: str):
    """As some editors write it."""
    names = {
        "task": "tasks/planar.toml",
        "local": "local.toml",
        "remote": "remote.toml",
        "profiles": "link_profiles.toml",
    }
    readers: dict[str, Callable[[Path], object]] = {
        "task": load_task, "local": lambda file: load_toml(file, LocalConfig),
        "remote": lambda file: load_toml(file, RemoteConfig), "profiles": load_profiles,
    }  # fmt: skip
    shipped = DEPLOY / names[kind]
    file = tmp_path / "marked.toml"
    file.write_bytes(b"\xef\xbb\xbf" + shipped.read_bytes())
    assert readers[kind](file) == readers[kind](shipped)
    file.write_bytes(b"\xef\xbb\xbf" + b"\xef\xbb\xbf" + shipped.read_bytes())
    with pytest.raises(InvalidConfiguration, match="TOML"):
        readers[kind](file)


def test_points_that_come_back_later_are_no_equal_neighbours(tmp_path: Path):
    file = write(tmp_path, MINIMAL + "[[samples]]\nwaypoints_m = [[0.1, 0.1], [0.3, 0.2], [0.1, 0.1]]")
    (sample,) = load_toml(file, PointTask).samples
    assert len(sample.waypoints_m) == 3
