from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import InvalidModel
from common.model_file import content_hash, decode, encode, load, save
from tests.strategies import learned


def test_a_model_survives_its_file(tmp_path: Path):
    model = learned(3, n_frames=2)
    digest = save(model, tmp_path / "task.model")
    assert load(tmp_path / "task.model") == model
    assert digest == hashlib.sha256((tmp_path / "task.model").read_bytes()).hexdigest()
    assert [path.name for path in tmp_path.iterdir()] == ["task.model"]


def test_equal_models_have_equal_bytes():
    assert encode(learned(seed=4)) == encode(learned(seed=4))
    assert content_hash(encode(learned(seed=4))) != content_hash(encode(learned(seed=5)))
    assert encode(decode(encode(learned()))) == encode(learned())


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


def _changed(change: Any) -> bytes:
    content = msgpack.unpackb(encode(learned()))
    change(content)
    return msgpack.Packer().pack(content)


def _with_array(name: str, array: np.ndarray) -> Any:
    packed = {"dtype": array.dtype.str, "shape": list(array.shape), "data": array.tobytes()}
    return lambda content: content["arrays"].update({name: packed})


BROKEN = {
    "schema: version 1, got 2": lambda c: c.update(schema=2),
    "kind": lambda c: c.update(kind="farhand/other"),
    "colour: no such field": lambda c: c.update(colour="red"),
    "arrays.colour: no such field": lambda c: c["arrays"].update(colour=1),
    "arrays.means: a field that is missing": lambda c: c["arrays"].pop("means"),
    "max_distance_m: a field that is missing": lambda c: c.pop("max_distance_m"),
    "max_distance_m: type float": lambda c: c.update(max_distance_m="far"),
    "max_distance_m: a positive": lambda c: c.update(max_distance_m=float("nan")),
    "n_demonstrations: type int": lambda c: c.update(n_demonstrations=True),
    "frame_names": lambda c: c.update(frame_names=[3]),
    "means: an array": lambda c: c["arrays"].update(means=[1.0]),
    "means: dtype": _with_array("means", np.zeros((1, 2, 2), np.float32)),
    "means: shape": _with_array("means", np.zeros((4, 2))),
    "means: a shape of whole numbers": lambda c: c["arrays"]["means"].update(shape=[-1, 2]),
    "means: .* bytes for shape": lambda c: c["arrays"]["means"].update(data=b"1234"),
    "initial: finite": lambda c: c["arrays"]["initial"].update(
        data=np.full(c["arrays"]["initial"]["shape"], np.nan).tobytes()
    ),
    "terminal: truth": lambda c: c["arrays"]["terminal"].update(
        data=b"\x02" * len(c["arrays"]["terminal"]["data"])
    ),
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
