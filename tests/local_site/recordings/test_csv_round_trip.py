"""Whatever names, order, units and delimiter the columns of a motion have, the same motion comes back."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.model.manifold import POSE
from tests.local_site.recordings.truth import read
from tests.strategies import random_points

TIMES = {
    "t": 1.0,
    "Time_(Seconds)": 1.0,
    "time_ms": 1e3,
    "timestamp[us]": 1e6,
    "header.stamp[ns]": 1e9,
    "elapsed_s": 1.0,
}
LENGTHS = {"": 1.0, "_m": 1.0, "[cm]": 1e2, "_mm": 1e3, "(Millimeters)": 1e3}
POSITIONS = ("{}", "pos_{}", "Position.{}", "Pos{}", "t{}", "pose.position.{}", "translation/{}")
ROTATIONS = ("q{}", "quat_{}", "rot.{}", "Rotation.{}", "pose.orientation.{}", "Q{}")
EXTRAS = ("note", "velocity.x", "force_z", "header.seq", "gripper")


def text_of(number: float, comma: bool) -> str:
    text = repr(float(number))
    return text.replace(".", ",") if comma else text


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_the_same_motion_comes_back(data: st.DataObject):
    rng = np.random.default_rng(data.draw(st.integers(0, 10_000), label="seed"))
    n = data.draw(st.integers(2, 12), label="samples")
    points = random_points(rng, POSE, n)
    times_s = np.cumsum(rng.uniform(0.02, 0.03, size=n)) + data.draw(st.sampled_from([0.0, 100.0]))
    delimiter = data.draw(st.sampled_from([",", ";", "\t", "|", " "]), label="delimiter")
    comma = delimiter != "," and data.draw(st.booleans(), label="decimal comma")
    body = data.draw(st.sampled_from(["", "plug_", "hand/"]), label="body")
    time, unit = data.draw(st.sampled_from(sorted(TIMES))), data.draw(st.sampled_from(sorted(LENGTHS)))
    position, rotation = data.draw(st.sampled_from(POSITIONS)), data.draw(st.sampled_from(ROTATIONS))
    oriented = data.draw(st.booleans(), label="oriented")
    upper = data.draw(st.booleans(), label="upper case")
    columns = {time: times_s * TIMES[time]}
    for k, axis in enumerate("xyz"):
        columns[body + position.format(axis.upper() if upper else axis) + unit] = points[:, k] * LENGTHS[unit]
    for k, axis in enumerate("wxyz" if oriented else ""):
        columns[body + rotation.format(axis.upper() if upper else axis)] = points[:, 3 + k]
    for extra in data.draw(st.sets(st.sampled_from(EXTRAS)), label="extras"):
        columns[extra] = rng.normal(size=n)
    order = data.draw(st.permutations(sorted(columns)), label="order")
    end = data.draw(st.sampled_from(["\n", "\r\n", "\n\n"]), label="line end")
    rows = [order, *([text_of(columns[name][row], comma) for name in order] for row in range(n))]
    with TemporaryDirectory() as folder:
        file = Path(folder) / "motion.csv"
        file.write_bytes((end.join(map(delimiter.join, rows)) + end).encode())
        (understood,) = read(file)
    made = understood.demonstration
    np.testing.assert_allclose(made.time_s, times_s - times_s[0], atol=1e-6)
    np.testing.assert_allclose(made.position_m, points[:, :3], rtol=1e-12, atol=1e-12)
    assert (made.quat_wxyz is not None) == oriented
    if made.quat_wxyz is not None:
        np.testing.assert_allclose(np.abs(np.sum(made.quat_wxyz * points[:, 3:], axis=1)), 1.0, atol=1e-12)
