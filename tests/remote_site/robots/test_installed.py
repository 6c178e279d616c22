"""Drivers of a user's own: found, made, started, closed, or refused in one line that names them and the remedy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from farhand.common.clock import BootClock
from farhand.common.errors import DriverFailed, FarhandError, InvalidConfiguration
from farhand.common.task import TaskSet
from farhand.deploy.places import find_task
from farhand.deploy.site_processes import configured
from farhand.remote_site.config import DriverChoice, RemoteConfig
from farhand.remote_site.interface.plant import PointPlant
from farhand.remote_site.perception.simulated_sight import SimulatedPerception
from farhand.remote_site.robots.embodiments import embodiment_of
from farhand.remote_site.robots.installed import PLANT, check_drivers, in_operation, installed
from farhand.remote_site.site import RemoteSite
from tests.remote_site.planar import TASK
from tests.remote_site.robots.own_drivers import put_drivers


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


def a_config(plant: str = "", sight: str = "", **options: Any) -> RemoteConfig:
    return RemoteConfig(plant=DriverChoice(plant, options), perception=DriverChoice(sight, options))


def operate(config: RemoteConfig) -> None:
    """Make and start the robot's drivers as its process does, and end them."""
    with in_operation(config, TASK, None, 0.0):
        pass


def test_what_is_configured_is_used_and_all_else_is_simulated(folder: Path):
    put_drivers(folder, "drivers_a")

    def kinds(config: RemoteConfig) -> tuple[str, str]:
        with in_operation(config, TASK, None, 0.0) as drivers:
            hardware = embodiment_of(TASK, config, BootClock(), None, None, drivers).hardware
        return type(hardware.plant).__name__, type(hardware.perception).__name__

    assert kinds(a_config()) == (PointPlant.__name__, SimulatedPerception.__name__)
    assert kinds(a_config(plant="drivers_a")) == ("Plant", SimulatedPerception.__name__)
    assert kinds(a_config(sight="drivers_a")) == (PointPlant.__name__, "Sight")
    assert kinds(a_config("drivers_a", "drivers_a")) == ("Plant", "Sight")


def test_they_are_started_before_the_first_look_and_closed_whatever_happens(folder: Path):
    put_drivers(folder, "drivers_b")
    log = folder / "log"
    operate(a_config("drivers_b", log=str(log)))
    assert log.read_text().split() == ["start", "close"]
    log.unlink()
    with pytest.raises(DriverFailed):
        operate(a_config("drivers_b", log=str(log), fails="first reading"))
    assert log.read_text().split() == ["start", "close"]
    operate(a_config("drivers_b", fails="close"))  # is logged, and nobody's end


@pytest.mark.parametrize(
    ("plant", "fails", "words"),
    [
        ("drivers_c", "made", "does not take its options {'fails': 'made'}: ValueError: an unknown port"),
        ("drivers_c", "start", "cannot be started: OSError: no such bus"),
        ("drivers_c", "first reading", "does not measure: InvalidInput: plant: read: point: an array of shape (2,), got shape (3,)"),
        ("drivers_c-nothing", "", "Nothing has no read, accelerate, follow, brake"),
    ],
)  # fmt: skip
def test_what_fails_before_the_robot_runs_is_one_line_with_its_entry_point(
    folder: Path, plant: str, fails: str, words: str
):
    put_drivers(folder, "drivers_c")
    with pytest.raises(DriverFailed) as told:
        operate(a_config(plant, fails=fails))
    said = str(told.value)
    assert words in said and "\n" not in said
    assert f"plant '{plant}' (drivers_c:" in said and ("--plant" in said or "docs/extending.md" in said)


def test_a_sight_with_another_number_of_frames_is_refused_at_the_start(folder: Path):
    put_drivers(folder, "drivers_d")
    with pytest.raises(DriverFailed, match=r"perception 'drivers_d'.*1 task frames, .*got 2"):
        operate(a_config(sight="drivers_d", n=2))


@pytest.mark.parametrize(
    ("before", "words"),
    [
        ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("raise SystemExit('bye')", "SystemExit: bye"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("def", "SyntaxError: "),
    ],
)
def test_what_cannot_be_imported_is_told_before_anything_starts(folder: Path, before: str, words: str):
    module = f"drivers_e{abs(hash(before))}"
    put_drivers(folder, module, before)
    with pytest.raises(DriverFailed) as told:
        check_drivers(a_config(module), TASK)
    said = str(told.value)
    assert f"plant '{module}' ({module}:Plant) cannot be imported: {words}" in said and "--plant" in said


def test_an_unknown_name_lists_those_that_are_installed(folder: Path):
    with pytest.raises(InvalidConfiguration, match=r"plant.use.*farhand.plants.*got 'my-tabel'"):
        check_drivers(a_config("my-tabel"), TASK)
    put_drivers(folder, "drivers_f")
    assert "drivers_f" in installed(PLANT)
    with pytest.raises(InvalidConfiguration, match=r"drivers_f, drivers_f-nothing.*; got 'my-tabel'"):
        check_drivers(a_config("my-tabel"), TASK)
    with pytest.raises(InvalidConfiguration, match=r"perception\.use"):
        check_drivers(a_config(sight="drivers_f-nothing"), TASK)


def test_a_name_that_two_packages_have_is_refused_naming_both(folder: Path):
    put_drivers(folder, "drivers_h")
    put_drivers(folder, "drivers_i")
    points = folder / "drivers_i-1.0.dist-info" / "entry_points.txt"
    for kind, name in (("plants", "Plant"), ("perceptions", "Sight")):
        put = f"[farhand.{kind}]\ndrivers_h = drivers_i:{name}\n"
        points.write_text(points.read_text().replace(f"[farhand.{kind}]\n", put))
        field = kind.removesuffix("s")
        config = a_config("drivers_h") if field == "plant" else a_config(sight="drivers_h")
        both = f"{field}\\.use: .*drivers_h:{name} and drivers_i:{name}: uninstall one"
        with pytest.raises(InvalidConfiguration, match=both):
            check_drivers(config, TASK)
        with pytest.raises(InvalidConfiguration, match=both):
            operate(config)
    check_drivers(a_config("drivers_i"), TASK)


def test_a_task_of_the_arm_has_no_driver_of_a_point():
    with pytest.raises(InvalidConfiguration, match=r"plant\.use"):
        check_drivers(a_config("my-table"), find_task("hot-stab"))


def test_an_arm_and_its_sight_are_both_the_users_own_or_neither(folder: Path):
    for config, field in (
        (RemoteConfig(arm_driver=DriverChoice("x")), r"perception\.use"),
        (RemoteConfig(perception=DriverChoice("x")), r"arm_driver\.use"),
    ):
        with pytest.raises(InvalidConfiguration, match=field):
            check_drivers(config, find_task("hot-stab"))
    with pytest.raises(InvalidConfiguration, match=r"arm_driver\.use: none, as planar"):
        check_drivers(RemoteConfig(arm_driver=DriverChoice("x")), TASK)


def test_they_are_chosen_in_the_file_and_on_the_command_line(tmp_path: Path):
    file = tmp_path / "remote.toml"
    file.write_text('[plant]\nuse = "my-table"\noptions = { port = "/dev/ttyUSB0", axes = [1, 2] }\n')
    config = configured(RemoteConfig, file, plant_use=None, perception_use="my-camera")
    assert config.plant == DriverChoice("my-table", {"port": "/dev/ttyUSB0", "axes": [1, 2]})
    assert config.perception.use == "my-camera"
    assert configured(RemoteConfig, None, arm_driver_use="my-arm").arm_driver.use == "my-arm"
    assert configured(RemoteConfig, file, plant_use="other").plant.use == "other"
    file.write_text('[plant]\nname = "my-table"\n')
    with pytest.raises(InvalidConfiguration, match="plant"):
        configured(RemoteConfig, file)


def test_a_robot_whose_driver_does_not_start_never_opens_its_endpoint(folder: Path):
    put_drivers(folder, "drivers_g")
    config = structs.replace(a_config("drivers_g", fails="start"), link=RemoteConfig().link)
    ready = []
    with pytest.raises(FarhandError, match="drivers_g"):
        RemoteSite(config, TaskSet([TASK]), folder / "data").run(lambda: ready.append(True))
    assert not ready
