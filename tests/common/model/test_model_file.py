from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.errors import InvalidModel
from farhand.common.model.manifold import POSE, Manifold
from farhand.common.model.model_file import content_hash, decode, encode, load, part_sizes, save
from farhand.common.model.model_parts import PARTS
from farhand.common.model.task_frame import TaskFrame
from farhand.common.model.tphsmm import ARRAY_FIELDS, TPHSMM
from farhand.evaluation.metrics.motion_metrics import resampled_by_length
from farhand.local_site.learning.online_learner import LearnerSettings, OnlineLearner
from farhand.remote_site.reproduction.point_rollout import roll_out
from tests.strategies import learned, pose_stroke

HALF = {"start_covariances"}


def test_a_model_survives_its_file(tmp_path: Path):
    model = learned(3, n_frames=2)
    digest = save(model, tmp_path / "task.model")
    kept = load(tmp_path / "task.model")
    for name in ARRAY_FIELDS:
        mine, theirs = getattr(model, name), getattr(kept, name)
        bound = (1e-3 if name in HALF else 1e-7) * np.abs(mine).max()
        np.testing.assert_allclose(theirs, mine, rtol=0.0, atol=bound, err_msg=name)
    assert (kept.frame_names, kept.max_distance_m) == (model.frame_names, model.max_distance_m)
    assert digest == hashlib.sha256((tmp_path / "task.model").read_bytes()).hexdigest()
    assert [path.name for path in tmp_path.iterdir()] == ["task.model"]


def test_equal_models_have_equal_bytes():
    assert encode(learned(seed=4)) == encode(learned(seed=4))
    assert content_hash(encode(learned(seed=4))) != content_hash(encode(learned(seed=5)))


@pytest.mark.parametrize("space", [Manifold(2), Manifold(3), POSE])
@pytest.mark.parametrize("seed", range(5))
def test_what_was_read_is_written_again_bit_for_bit(space: Manifold, seed: int):
    data = encode(learned(space, seed=seed))
    once = decode(data)
    assert encode(once) == data
    assert decode(encode(once)) == once


def test_a_pose_model_of_fifteen_components_fits_into_6_kB():
    model = fifteen_poses()
    assert (model.n_components, model.manifold) == (15, POSE)
    data = encode(model)
    sizes = part_sizes(data)
    assert len(data) == sum(sizes.values()) <= 6000
    assert set(sizes) == {"header", *PARTS}
    written = (Path(__file__).parents[3] / "docs" / "method.md").read_text(encoding="utf-8")
    for name, size in {**sizes, "whole": len(data)}.items():
        assert f"| {name} | {size} |" in written


def test_what_is_rounded_on_the_wire_hardly_moves_an_execution():
    model = fifteen_poses()
    rounded, frames = decode(encode(model)), [TaskFrame.identity(3)]
    for i in np.flatnonzero(model.initial):
        start = POSE.exp(model.start_means[0, i], np.array([0.05, 0.0, -0.05, 0.1, 0.0, 0.0]))
        one, other = (roll_out(m, start, lambda t: frames) for m in (model, rounded))
        assert one.arrived
        assert other.arrived
        apart = resampled_by_length(one.position_m) - resampled_by_length(other.position_m)
        assert np.linalg.norm(apart, axis=1).max() < 2e-3
        assert POSE.distance(one.points[-1], other.points[-1], metres_per_radian=1.0) < 1e-4


def fifteen_poses() -> TPHSMM:
    """A model of poses with fifteen components, from two demonstrations."""
    rng, learner = np.random.default_rng(0), OnlineLearner(LearnerSettings(0.08), POSE)
    for _ in range(2):
        learner.start()
        learner.observe_many(pose_stroke(rng, 150), [TaskFrame.identity(3)], 0.02 * np.arange(150.0))
        learner.end()
    return learner.model()


@settings(deadline=None, derandomize=True, max_examples=60)
@given(cut=st.floats(0.0, 1.0, exclude_max=True))
def test_a_truncated_model_is_refused(cut: float):
    data = encode(learned())
    with pytest.raises(InvalidModel, match=r"truncated|not a model"):
        decode(data[: int(cut * len(data))])


@settings(deadline=None, derandomize=True, max_examples=60)
@given(data=st.binary(max_size=200))
def test_foreign_bytes_are_refused(data: bytes):
    with pytest.raises(InvalidModel):
        decode(data)


_N = 1_900_000
HUGE: dict[str, Any] = {
    "lists": [[]] * _N, "maps": [{}] * _N, "nested": [[[[]] * 100] * 100] * 190, "texts": ["ab"] * (_N // 3),
    "names": {f"k{number}": 0 for number in range(_N // 8)},
}  # fmt: skip


@pytest.mark.parametrize("what", HUGE)
@pytest.mark.parametrize("where", ["", "kind", "frame_names", "shape", "parts", "parts.means", "colour"])
def test_millions_of_values_in_one_another_do_not_hold_up_the_threads_of_a_robot(where: str, what: str):
    """The reader gives way to no other thread: what it needs in all must be less than a late control period."""

    def put(content: dict[str, Any]) -> None:
        owner = content["parts"] if where == "parts.means" else content
        owner[where.rpartition(".")[2]] = HUGE[what]

    data = _changed(put) if where else msgpack.packb(HUGE[what]) or b""
    assert len(data) > 1_500_000
    took_s = []
    for _ in range(3):
        began_s = time.thread_time()
        with pytest.raises(InvalidModel):
            decode(data)
        took_s.append(time.thread_time() - began_s)
    assert min(took_s) < 0.02


def _changed(change: Any) -> bytes:
    content = msgpack.unpackb(encode(learned()))
    change(content)
    return msgpack.Packer().pack(content)


def _part(name: str, change: Callable[[bytes], bytes]) -> Any:
    return lambda content: content["parts"].update({name: change(content["parts"][name])})


K = learned().n_components
BROKEN = {
    "schema: version 3, got 1": lambda c: c.update(schema=1),
    "kind": lambda c: c.update(kind="farhand/other"),
    "colour: no such field": lambda c: c.update(colour="red"),
    "parts.colour: no such field": lambda c: c["parts"].update(colour=b""),
    "parts.means: a field that is missing": lambda c: c["parts"].pop("means"),
    "parts.means: bytes, got list": lambda c: c["parts"].update(means=[1.0]),
    "max_distance_m: a field that is missing": lambda c: c.pop("max_distance_m"),
    "max_distance_m: type float": lambda c: c.update(max_distance_m="far"),
    "max_distance_m: a positive": lambda c: c.update(max_distance_m=float("nan")),
    "n_demonstrations: type int": lambda c: c.update(n_demonstrations=True),
    "frame_names": lambda c: c.update(frame_names=[3]),
    "shape: K, C, T": lambda c: c.update(shape=[K, -2, -2]),
    "shape: K, C, T from": lambda c: c.update(shape=[10**9, 2, 2]),
    "shape: D and D numbers": lambda c: c.update(shape=[K, 4, 3]),
    "means: .* bytes or more": _part("means", lambda part: part[:-1]),
    "means: .* bytes for such": _part("means", lambda part: part + b"1234"),
    "means: finite": _part("means", lambda part: np.float32(np.nan).tobytes() + part[4:]),
    "priors: at least one entry": _part("priors", lambda part: b"\0\0" + part[2:]),
    "priors: truth values": _part("priors", lambda part: part[: -5 * K] + b"\2" * K + part[-4 * K :]),
    "transitions: at least one entry": _part("transitions", lambda part: b"\0\0" + part[2:]),
    "transitions: .* bytes or more": _part("transitions", lambda part: b"\xff\xff" + part[2:]),
}


@pytest.mark.parametrize("message", BROKEN)
def test_every_malformed_field_is_named(message: str):
    with pytest.raises(InvalidModel, match=message) as caught:
        decode(_changed(BROKEN[message]), source="uplink")
    assert caught.value.source == "uplink"


def test_a_file_that_is_not_there_is_named(tmp_path: Path):
    with pytest.raises(InvalidModel, match=r"none\.model"):
        load(tmp_path / "none.model")


def test_a_save_that_fails_leaves_the_old_file(tmp_path: Path):
    save(learned(), tmp_path / "task.model")
    before = (tmp_path / "task.model").read_bytes()
    with pytest.raises(OSError, match="missing"):
        save(learned(seed=9), tmp_path / "missing" / "task.model")
    assert (tmp_path / "task.model").read_bytes() == before
