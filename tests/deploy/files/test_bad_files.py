"""Malformed demonstrations, models and recordings: refused by name, and nothing is changed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import msgpack
import numpy as np
import pytest

from farhand.common.model.model_file import SCHEMA_VERSION
from farhand.local_site.teaching.demonstration import Demonstration
from tests.deploy.files.recordings import demonstrations, unchanged
from tests.farhand_process import farhand, refusal


def changed(name: str, change: Callable[[np.ndarray], object]) -> Callable[[Path, Path], None]:
    """A demonstration file with one array changed, whatever a demonstration would say to that."""

    def make(good: Path, bad: Path) -> None:
        with np.load(good) as archive:
            arrays = dict(archive)
        np.savez(bad, **{**arrays, name: change(arrays[name].copy())})

    return make


def with_a_nan(position: np.ndarray) -> np.ndarray:
    position[7, 1] = np.nan
    return position


def truncated(good: Path, bad: Path) -> None:
    content = good.read_bytes()
    bad.write_bytes(content[: len(content) // 2])


def foreign(_good: Path, bad: Path) -> None:
    bad.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(200))


def pickled(good: Path, bad: Path) -> None:
    with np.load(good) as archive:
        np.savez(bad, **{**archive, "source": np.array([{"a": 1}], dtype=object)})


def with_an_unknown_field(good: Path, bad: Path) -> None:
    with np.load(good) as archive:
        np.savez(bad, **archive, colour=np.array("red"))


BAD_DEMONSTRATIONS = {
    "nan": (changed("position_m", with_a_nan), "position_m: finite numbers only, got nan at [7, 1]"),
    "shape": (changed("position_m", lambda p: p[:-1]), "position_m: shape (200, 2)"),
    "dimensions": (changed("position_m", lambda p: p[:, :1]), "position_m: shape (200, 2)"),
    "frames": (changed("frame_rotation", lambda r: 2.0 * r), "frame_rotation: orthonormal"),
    "schema": (changed("schema", lambda s: s + 1), "schema: version 1, got"),
    "unknown": (with_an_unknown_field, "colour: no such field"),
    "truncated": (truncated, "a whole .npz file"),
    "foreign": (foreign, "a whole .npz file"),
    "pickled": (pickled, "a whole .npz file"),
    "missing": (lambda good, bad: None, "a readable file"),
}


@pytest.mark.parametrize("kind", BAD_DEMONSTRATIONS)
def test_a_bad_demonstration_is_refused_by_name_and_nothing_is_learned(kind, folder, tmp_path):
    make, expected = BAD_DEMONSTRATIONS[kind]
    good, bad, out = demonstrations(folder)[0], tmp_path / "bad.npz", tmp_path / "out.model"
    make(good, bad)
    with unchanged(folder, tmp_path):
        line = refusal("learn", good, bad, "--out", out)
    assert f"{bad}: {expected}" in line


def rewritten(change: Callable[[dict], None]) -> Callable[[Path, Path], None]:
    def make(good: Path, bad: Path) -> None:
        content = msgpack.unpackb(good.read_bytes())
        change(content)
        bad.write_bytes(msgpack.packb(content) or b"")

    return make


def put_a_nan(content: dict) -> None:
    content["parts"]["means"] = np.float32(np.nan).tobytes() + content["parts"]["means"][4:]


def drop_a_component(content: dict) -> None:
    content["shape"][0] -= 1


BAD_MODELS = {
    "nan": (rewritten(put_a_nan), "means: finite numbers only"),
    "shape": (rewritten(drop_a_component), ""),
    "schema": (
        rewritten(lambda content: content.update(schema=1)),
        f"schema: version {SCHEMA_VERSION}, got 1",
    ),
    "unknown": (rewritten(lambda content: content.update(colour="red")), "colour: no such field"),
    "truncated": (truncated, "a whole model file; this one is truncated"),
    "foreign": (foreign, ""),
    "missing": (lambda good, bad: None, "a readable file"),
}


@pytest.mark.parametrize("kind", BAD_MODELS)
def test_a_bad_model_is_refused_by_name(kind, folder, tmp_path):
    make, expected = BAD_MODELS[kind]
    bad = tmp_path / "bad.model"
    make(folder / "hook.model", bad)
    with unchanged(folder, tmp_path):
        line = refusal("rollout", bad, "--like", demonstrations(folder)[0], "--out", tmp_path / "out.npz")
    assert f"{bad}: {expected}" in line


def test_a_demonstration_of_another_task_is_refused(folder, tmp_path):
    good = Demonstration.load(demonstrations(folder)[0])
    spatial = Demonstration(
        time_s=good.time_s,
        position_m=np.pad(good.position_m, ((0, 0), (0, 1))),
        frame_origin_m=np.zeros((1, 3)),
        frame_rotation=np.eye(3)[None],
        frame_names=("goal",),
    )
    spatial.save(tmp_path / "spatial.npz")
    assert "dimension" in refusal("rollout", folder / "hook.model", "--like", tmp_path / "spatial.npz")


def test_a_bad_recording_is_refused_and_nothing_is_written_and_a_sample_left_out_is_told(folder, tmp_path):
    broken = tmp_path / "broken.npz"
    truncated(folder / "hook.npz", broken)
    with_nan = tmp_path / "nan.npz"
    recorded = dict(np.load(folder / "hook.npz"))
    recorded["pos"][1, 5, 0] = np.nan
    np.savez(with_nan, **recorded)
    for file in (broken, tmp_path / "none.npz"):
        with unchanged(tmp_path):
            assert str(file) in refusal("import", file, "--kind=lasa", "--out", tmp_path / "out")
    imported = farhand("import", with_nan, "--kind=lasa", "--out", tmp_path / "out")
    assert imported.returncode == 0 and "from sample 6" in imported.stdout
    assert imported.stdout.count("mended") == 1


def test_what_cannot_be_written_or_drawn_is_said_in_one_line(folder, tmp_path):
    demonstration, model = demonstrations(folder)[0], folder / "hook.model"
    nowhere = tmp_path / "nowhere"
    with unchanged(folder, tmp_path):
        assert "nowhere" in refusal("learn", demonstration, "--out", nowhere / "a.model")
        assert "nowhere" in refusal("rollout", model, "--like", demonstration, "--out", nowhere / "a.npz")
        assert "figure" in refusal("model", "show", model, "--figure", tmp_path / "figure.txt")
        assert "max_distance_m" in refusal(
            "learn", demonstration, "--out", tmp_path / "a", "--max-distance-m=nan"
        )
