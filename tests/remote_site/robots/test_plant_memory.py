from __future__ import annotations

import errno
import logging
import math
import os
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from farhand.common.wire.reason_words import sentence
from farhand.remote_site.interface.embodiment import ArmMemory
from farhand.remote_site.robots.plant_memory import PlantMemory, PlantState
from tests.remote_site.bench import Bench


@pytest.fixture(autouse=True)
def every_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also those that come soon after each other."""
    monkeypatch.setattr(logging.getLogger("farhand.remote_site.robots.plant_memory"), "filters", [])


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "robot" / "state.json"


def remembered(file: Path, *states: PlantState, n_dims: int = 2) -> PlantState | None:
    """What a later boot finds."""
    memory = PlantMemory(file)
    for state in states:
        memory.remember(state)
    memory.close()
    later = PlantMemory(file)
    try:
        return later.load(n_dims)
    finally:
        later.close()


def test_a_later_boot_finds_the_newest_state_and_its_execution(file: Path):
    state = PlantState((0.3, 0.4), "a" * 64)
    assert remembered(file, PlantState((0.1, 0.2)), state) == state
    assert os.listdir(file.parent) == ["state.json"]


def test_an_arm_is_found_with_all_that_it_needs_to_go_on(file: Path):
    arm = ArmMemory((0.1,) * 6, (0.8, 0.0, 0.4, 0.5, 0.5, -0.5, 0.5), 12.25, (1.0,) * 6)
    state = PlantState((0.6, 0.1, 0.4), arm=arm)
    assert remembered(file, state, n_dims=3) == state


def test_what_a_robot_at_rest_does_is_no_change_and_all_else_is(file: Path):
    arm = ArmMemory((0.1,) * 6, (0.8, 0.0, 0.4, 0.5, 0.5, -0.5, 0.5), 0.0, (1.0,) * 6)
    state = PlantState((0.6, 0.1, 0.4), arm=arm)
    assert structs.replace(state, position_m=(0.6, 0.1, 0.40001)).is_like(state)
    assert structs.replace(state, arm=structs.replace(arm, tare=(1.00001,) * 6)).is_like(state)
    for other in (
        structs.replace(state, executing="a" * 64),
        structs.replace(state, arm=None),
        structs.replace(state, arm=structs.replace(arm, joints_rad=(0.1001,) * 6)),
        structs.replace(state, arm=structs.replace(arm, time_s=0.01)),
        None,
    ):
        assert not state.is_like(other)


def test_the_last_state_before_the_end_is_written_however_soon_it_comes(file: Path):
    for n in range(200):
        memory = PlantMemory(file)
        memory.remember(PlantState((0.0, n)))
        memory.remember(PlantState((1.0, n)))
        memory.close()
        assert memory.load(2) == PlantState((1.0, n))


def test_the_first_boot_finds_nothing(file: Path):
    assert remembered(file) is None


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b'{"position_m": [0.1, null]}',
        b'{"position_m": [1, 2], "x": 1}',
        b'{"position_m": [1, 2], "executing": "\xff"}',
        b'{"position_m": [1, 1e30]}',
        b"[" * 100_000,
    ],
    ids=range(7),
)
def test_a_file_that_is_not_understood_is_said_and_the_robot_starts_anew(file: Path, content: bytes, caplog):
    file.parent.mkdir()
    file.write_bytes(content)
    assert remembered(file) is None
    assert "state.json is not understood" in caplog.text and "\n" not in caplog.messages[0]
    assert file.with_suffix(".unreadable").read_bytes() == content


def test_a_state_of_another_dimension_does_not_fit(file: Path):
    assert remembered(file, PlantState((0.1, 0.2, 0.3))) is None


def test_a_write_that_was_cut_short_leaves_the_state_before_it(file: Path):
    remembered(file, PlantState((0.5, 0.6)))
    file.with_suffix(".new").write_bytes(b'{"posi')
    assert remembered(file) == PlantState((0.5, 0.6))


def test_a_folder_that_cannot_be_written_is_said_and_ends_nothing(tmp_path: Path, caplog):
    (tmp_path / "file").write_text("")
    memory = PlantMemory(tmp_path / "file" / "state.json")
    memory.remember(PlantState((0.1, 0.2)))
    memory.close()
    assert "could not be written" in caplog.text


@pytest.mark.parametrize(
    "code", [errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO], ids=errno.errorcode.get
)
def test_a_place_that_could_not_be_kept_is_set_aside_and_told(file: Path, monkeypatch, code: int):
    assert remembered(file, PlantState((0.1, 0.2))) == PlantState((0.1, 0.2))

    def full(self: Path, data: bytes) -> int:
        raise OSError(code, os.strerror(code))

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_bytes", full)
        memory = PlantMemory(file)
        memory.remember(PlantState((0.8, 0.9)))
        memory.close()
    assert memory.error is not None and memory.error.errno == code
    later = PlantMemory(file)
    assert later.load(2) is None and "could not be saved" in sentence(later.unknown_place)
    later.remember(PlantState((0.3, 0.3)))
    later.close()
    assert remembered(file) == PlantState((0.3, 0.3))


_ARM = ArmMemory((0.1,) * 6, (0.8, 0.0, 0.4, 0.5, 0.5, -0.5, 0.5), 12.25, (1.0,) * 6)
IMPOSSIBLE = {
    "not a number": PlantState((math.nan, 0.2)),
    "infinite": PlantState((0.1, -math.inf)),
    "beyond every workspace": PlantState((0.1, 1e300)),
    "a joint that is not a number": PlantState(
        (0.1, 0.2), "", structs.replace(_ARM, joints_rad=(math.nan,) * 6)
    ),
    "no orientation": PlantState((0.1, 0.2), "", structs.replace(_ARM, receptacle=(0.0,) * 7)),
}


@pytest.mark.parametrize("state", IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_what_could_not_be_read_again_is_not_written_and_the_place_is_said_to_be_unknown(
    file: Path, state: PlantState, caplog: pytest.LogCaptureFixture
):
    memory = PlantMemory(file)
    memory.remember(PlantState((0.1, 0.2)))
    memory.remember(state)
    assert memory.load(2) is None  # a robot that starts again in the same process, as after a suspend
    assert "could not be saved" in sentence(memory.unknown_place)
    memory.close()
    later = PlantMemory(file)
    assert later.load(2) is None and "could not be saved" in sentence(later.unknown_place)
    assert "not understood" not in caplog.text
    later.remember(state)
    later.remember(PlantState((0.3, 0.3)))  # the sensor is back
    assert later.load(2) == PlantState((0.3, 0.3))
    later.close()
    assert remembered(file) == PlantState((0.3, 0.3))


@given(data=st.data())
def test_no_damage_of_the_file_is_more_than_a_robot_that_starts_anew(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
):
    arm = ArmMemory((0.1,) * 6, (0.8, 0.0, 0.4, 0.5, 0.5, -0.5, 0.5), 12.25, (1.0,) * 6)
    content = bytearray(msgspec.json.encode(PlantState((0.6, 0.1, 0.4), "a" * 64, arm)))
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    file = tmp_path_factory.mktemp("state") / "state.json"
    file.write_bytes(content[: data.draw(st.integers(0, len(content)))])
    memory = PlantMemory(file)
    state = memory.load(3)
    memory.close()
    assert state is None or (file.exists() and not memory.unknown_place)
    if state is None and not file.exists():
        assert "is not understood" in sentence(memory.unknown_place)


def test_the_state_names_the_execution_until_it_has_arrived():
    bench = Bench().executing()
    execution = bench.robot.motion.execution
    assert execution is not None
    under_way = PlantState.of(bench.robot.sensing, bench.robot.motion)
    assert under_way.executing == execution.stored.sha256
    bench.run(10.0)
    arrived = PlantState.of(bench.robot.sensing, bench.robot.motion)
    assert arrived.executing == "" and arrived.position_m != under_way.position_m
