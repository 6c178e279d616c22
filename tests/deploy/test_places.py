from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from farhand.common.errors import InvalidConfiguration
from farhand.deploy.cli import main
from farhand.deploy.places import check_writable, data_folder, find_task, sample_files

PLANAR = Path(__file__).parents[2] / "deploy" / "tasks" / "planar.toml"


def test_a_task_is_found_by_its_name_and_by_its_file(tmp_path: Path):
    assert find_task("planar").name == "planar"
    file = tmp_path / "mine.toml"
    file.write_text(PLANAR.read_text().replace('name = "planar"', 'name = "mine"'))
    assert find_task(str(file)).name == "mine"


def test_a_task_is_found_by_its_former_name():
    assert find_task("hot-unstab").name == "hot-stab-removal"


@pytest.mark.parametrize("name", ["hot-stab", "hot-stab-removal"])
def test_a_task_whose_name_begins_like_another_one_has_its_own_samples(name: str):
    assert [file.name for file in sample_files(name)] == [f"{name}-{n}.npz" for n in range(5)]


def test_an_unknown_task_is_refused_with_those_there_are():
    with pytest.raises(InvalidConfiguration, match=r"planar.*'plannar'"):
        find_task("plannar")


@pytest.mark.parametrize("name", ["", "planar.toml", "elsewhere/task.toml"])
def test_what_is_neither_a_name_nor_a_file_is_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidConfiguration):
        find_task(name)


def test_data_lives_in_the_chosen_folder_or_the_users(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "xdg"))
    assert data_folder("~/here") == tmp_path / "here"
    assert data_folder("") == data_folder(None) == tmp_path / "xdg" / "farhand"
    monkeypatch.setenv("XDG_DATA_HOME", "")
    assert data_folder(None) == tmp_path / ".local" / "share" / "farhand"


def test_a_file_that_could_not_be_written_later_is_refused_now(tmp_path: Path):
    check_writable("json", tmp_path / "new.json")
    (tmp_path / "old.json").write_text("{}")
    check_writable("json", tmp_path / "old.json")
    for bad in (tmp_path, tmp_path / "no folder" / "new.json"):
        with pytest.raises(InvalidConfiguration, match="json"):
            check_writable("json", bad)
    assert (tmp_path / "old.json").read_text() == "{}"


def test_a_robot_is_checked_against_its_workplace_and_placed(capfd: pytest.CaptureFixture[str]):
    assert main(["robot", "check", "panda"]) == 0
    said = capfd.readouterr().out
    assert "7 joints, air" in said and "admits 9 of 9 receptacles" in said and "kB" in said
    assert main(["robot", "place", "panda", "--candidates", "0"]) == 0
    assert "home_rad = [-0.054, -1.493" in capfd.readouterr().out
    assert main(["robot", "check", "no-such-robot"]) == 2
    words = capfd.readouterr().err
    assert all(name in words for name in ("baxter-left", "jaco", "panda", "ur5e"))


@pytest.mark.rendering
def test_a_robot_is_drawn_at_rest_before_its_receptacle(tmp_path: Path, capfd: pytest.CaptureFixture[str]):
    picture = tmp_path / "gen3.png"
    assert main(["robot", "show", "gen3", "--out", str(picture)]) == 0
    drawn = np.asarray(Image.open(picture))
    assert drawn.shape == (720, 1280, 3) and drawn.std() > 20.0
    assert "drawn at rest" in capfd.readouterr().out
    assert main(["robot", "show", "gen3", "--out", str(tmp_path / "no" / "folder.png")]) == 2
    assert "a file that can be written" in capfd.readouterr().err
