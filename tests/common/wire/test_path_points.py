from __future__ import annotations

import numpy as np
import pytest

from farhand.common.errors import InvalidMessage
from farhand.common.wire.messages import PlannedPath, Stamp
from farhand.common.wire.motion_encoding import duration_s, packed, points_of, thinned


def a_path(points: np.ndarray, content: bytes | None = None) -> PlannedPath:
    return PlannedPath(
        path_id=1, stamp=Stamp("boot", 1), model_sha256="", n_coordinates=points.shape[1], step_s=0.1,
        points=packed(points) if content is None else content, reaches_end=True,
    )  # fmt: skip


def test_positions_come_back_in_single_precision():
    points = np.random.default_rng(1).uniform(-2.0, 2.0, (30, 3))
    np.testing.assert_array_equal(points_of(a_path(points)), points.astype("<f4"))


def test_poses_come_back_within_a_millimetre_and_a_tenth_of_a_degree():
    from scipy.spatial.transform import Rotation

    random = np.random.default_rng(2)
    turns = Rotation.from_quat(random.normal(size=(50, 4)))
    points = np.hstack([random.uniform(-2.0, 2.0, (50, 3)), turns.as_quat(scalar_first=True)])
    back = points_of(a_path(points))
    assert np.abs(back[:, :3] - points[:, :3]).max() < 1e-3
    apart = (Rotation.from_quat(back[:, 3:], scalar_first=True) * turns.inv()).magnitude()
    assert np.degrees(apart).max() < 0.1
    np.testing.assert_allclose(np.linalg.norm(back[:, 3:], axis=1), 1.0, atol=1e-12)


def test_a_path_lasts_from_its_first_point_to_its_last():
    assert duration_s(a_path(np.zeros((11, 2)))) == pytest.approx(1.0)
    assert duration_s(a_path(np.zeros((0, 7)))) == 0.0


def test_a_broken_path_is_refused():
    with pytest.raises(InvalidMessage, match="points"):
        points_of(a_path(np.zeros((2, 7)), bytes(15)))


@pytest.mark.parametrize("n", [34, 35, 36, 67, 68, 100, 200])
def test_a_path_for_a_narrow_link_keeps_its_ends_and_its_times(n: int):
    points = np.zeros((n, 7))
    points[:, 0], points[:, 3] = np.arange(n) / 256, 1.0  # exact in half precision
    whole = a_path(points)
    thin = thinned(whole, 480)
    kept = points_of(thin)
    every = round(thin.step_s / whole.step_s)
    assert len(thin.points) <= 480
    assert thin.step_s == pytest.approx(every * whole.step_s)
    np.testing.assert_array_equal(kept[:-1], points_of(whole)[:-1:every])
    np.testing.assert_array_equal(kept[-1], points_of(whole)[-1])
    assert duration_s(whole) <= duration_s(thin) + 1e-9 and duration_s(thin) < duration_s(whole) + thin.step_s


def test_a_path_that_fits_is_sent_as_it_is():
    path = a_path(np.zeros((34, 7)))
    assert thinned(path, 480) is path
