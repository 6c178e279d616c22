"""The ellipsoids of a model against its covariances."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from farhand.local_site.view.scene.arm.task_drawing import axes_of
from farhand.local_site.view.scene.shapes import sphere


def test_the_axes_are_two_standard_deviations_of_the_covariances() -> None:
    random = np.random.default_rng(0)
    factors = random.normal(size=(7, 3, 3))
    covariances = factors @ np.swapaxes(factors, 1, 2) + 0.01 * np.eye(3)
    half_axes, turns = axes_of(covariances)
    R = Rotation.from_quat(turns, scalar_first=True).as_matrix()
    again = R @ (0.25 * half_axes[:, :, None] ** 2 * np.swapaxes(R, 1, 2))
    np.testing.assert_allclose(again, covariances, rtol=1e-4, atol=1e-5)


def test_the_sphere_is_closed_and_looks_outwards() -> None:
    vertices, faces = sphere()
    a, b, c = np.moveaxis(vertices[faces].astype(float), 1, 0)
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0
    assert 0.95 * 4.0 / 3.0 * np.pi < volume < 4.0 / 3.0 * np.pi
