from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from farhand.common.errors import InvalidDemonstration
from farhand.local_site.teaching.demonstration import Demonstration
from tests.strategies import dims, recording, seeds


def example(n_dims: int = 2, moving: bool = False, seed: int = 0, n: int = 20) -> Demonstration:
    rng = np.random.default_rng(seed)
    points, times = recording(rng, n_dims, n)
    origin, rotation = rng.normal(size=(2, n_dims)), np.stack([np.eye(n_dims)] * 2)
    if moving:
        origin, rotation = rng.normal(size=(n, 2, n_dims)), np.stack([rotation] * n)
    return Demonstration(
        time_s=times,
        position_m=points,
        frame_origin_m=origin,
        frame_rotation=rotation,
        frame_names=("base", "goal"),
        source="a test",
    )


def same(one: Demonstration, other: Demonstration) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(vars(one).values(), vars(other).values(), strict=True))


@settings(deadline=None, derandomize=True, max_examples=20)
@given(seed=seeds, n_dims=dims, moving=st.booleans(), turning=st.booleans())
def test_a_demonstration_survives_its_file(
    tmp_path_factory: pytest.TempPathFactory, seed: int, n_dims: int, moving: bool, turning: bool
):
    made = example(n_dims, moving, seed)
    if turning:
        made = replace(
            made, quat_wxyz=Rotation.random(20, rng=np.random.default_rng(seed)).as_quat(scalar_first=True)
        )
    path = tmp_path_factory.mktemp("demonstration") / "one.npz"
    made.save(path)
    assert same(Demonstration.load(path), made)


def test_a_file_can_be_read_without_this_program(tmp_path: Path):
    example().save(tmp_path / "one.npz")
    with np.load(tmp_path / "one.npz", allow_pickle=False) as archive:
        expected = {
            "schema",
            "time_s",
            "position_m",
            "frame_origin_m",
            "frame_rotation",
            "frame_names",
            "source",
        }
        assert set(archive.files) == expected
        assert int(archive["schema"]) == 1


def _saved(path: Path, **change: Any) -> Path:
    example().save(path)
    with np.load(path) as archive:
        arrays: dict[str, Any] = {name: archive[name] for name in archive.files}
    arrays |= change
    np.savez(path, **{name: value for name, value in arrays.items() if value is not None})
    return path


def _with(array: NDArray, at: Any, value: float) -> NDArray:
    changed = np.array(array)
    changed[at] = value
    return changed


GOOD = example()
BROKEN: dict[str, dict[str, Any]] = {
    "position_m: finite numbers only, got nan at .3, 1.": {
        "position_m": _with(GOOD.position_m, (3, 1), np.nan)
    },
    "frame_origin_m: finite": {"frame_origin_m": _with(GOOD.frame_origin_m, (0, 0), np.inf)},
    "time_s: times that increase": {"time_s": _with(GOOD.time_s, 5, GOOD.time_s[4])},
    "time_s: shape": {"time_s": GOOD.time_s[:1]},
    "position_m: shape .20, 2. or .20, 3.": {"position_m": GOOD.position_m[:-1]},
    "position_m: shape": {"position_m": np.zeros((20, 4))},
    "position_m: real numbers": {"position_m": GOOD.position_m.astype(complex)},
    "frame_origin_m: shape": {"frame_origin_m": np.zeros((3, 2))},
    "frame_rotation: shape": {"frame_rotation": np.zeros((2, 2))},
    "frame_rotation: orthonormal": {"frame_rotation": np.zeros((2, 2, 2))},
    "frame_names: one name or more, all different": {"frame_names": np.array(["a", "a"])},
    "frame_names: text": {"frame_names": np.array([1, 2])},
    "quat_wxyz: shape": {"quat_wxyz": np.zeros((20, 3))},
    "quat_wxyz: unit": {"quat_wxyz": np.ones((20, 4))},
    "schema: version 1": {"schema": np.int64(2)},
    "schema: version 1, got": {"schema": np.array("1")},
    "position_m: a field that is missing": {"position_m": None},
    "colour: no such field": {"colour": np.zeros(3)},
    "source: one text": {"source": np.zeros(3)},
}


@pytest.mark.parametrize("message", BROKEN)
def test_every_malformed_field_is_named_with_its_file(tmp_path: Path, message: str):
    path = _saved(tmp_path / "broken.npz", **BROKEN[message])
    with pytest.raises(InvalidDemonstration, match=message) as caught:
        Demonstration.load(path)
    assert caught.value.source == str(path)


@settings(deadline=None, derandomize=True, max_examples=40)
@given(cut=st.floats(0.0, 1.0, exclude_max=True))
def test_a_truncated_file_is_refused(tmp_path_factory: pytest.TempPathFactory, cut: float):
    path = tmp_path_factory.mktemp("cut") / "one.npz"
    example().save(path)
    data = path.read_bytes()
    path.write_bytes(data[: int(cut * len(data))])
    with pytest.raises(InvalidDemonstration, match=r"one\.npz"):
        Demonstration.load(path)


def test_foreign_files_are_refused(tmp_path: Path):
    foreign = {"text.npz": b"hello", "empty.npz": b"", "zip.npz": b"PK\x05\x06" + b"\0" * 18}
    for name, data in foreign.items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(InvalidDemonstration, match=name):
            Demonstration.load(tmp_path / name)
    np.save(tmp_path / "array.npy", np.zeros(3))
    with pytest.raises(InvalidDemonstration, match=r"array\.npy"):
        Demonstration.load(tmp_path / "array.npy")
    np.savez(tmp_path / "pickle.npz", time_s=np.array([{}], dtype=object))
    with pytest.raises(InvalidDemonstration, match="plain arrays"):
        Demonstration.load(tmp_path / "pickle.npz")
    with pytest.raises(InvalidDemonstration, match="readable"):
        Demonstration.load(tmp_path / "none.npz")


@pytest.mark.parametrize("every", [1, 2, 7, 19, 100])
def test_thinning_keeps_the_true_last_sample(every: int):
    for moving in (False, True):
        made = example(moving=moving)
        thin = made.thinned(every)
        np.testing.assert_array_equal(thin.position_m[0], made.position_m[0])
        np.testing.assert_array_equal(thin.position_m[-1], made.position_m[-1])
        np.testing.assert_array_equal(thin.frames_at(-1)[0].b, made.frames_at(-1)[0].b)
        assert len(set(np.diff(np.searchsorted(made.time_s, thin.time_s))[:-1])) <= 1


def test_the_goal_is_the_last_frame():
    made = example()
    np.testing.assert_allclose(made.in_frame(), made.position_m - made.frame_origin_m[1])
    moving = example(moving=True)
    np.testing.assert_allclose(moving.in_frame(0), moving.position_m - moving.frame_origin_m[:, 0])
