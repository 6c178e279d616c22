from __future__ import annotations

import pytest

from farhand.common.errors import InvalidConfiguration
from farhand.common.model.manifold import POSE
from farhand.evaluation.paper.model_figure import draw_model
from tests.strategies import learned

BEGINNINGS = {"png": b"\x89PNG\r\n\x1a\n", "pdf": b"%PDF-", "svg": b"<?xml"}


@pytest.mark.parametrize("ending", BEGINNINGS)
def test_a_model_is_drawn_to_a_file_of_the_kind_that_its_name_says(ending, tmp_path):
    file = tmp_path / f"model.{ending}"
    draw_model(learned(), file)
    assert file.read_bytes().startswith(BEGINNINGS[ending])


@pytest.mark.parametrize(("space", "n_frames"), [(2, 2), (3, 1), (POSE, 2)])
def test_models_of_any_space_and_number_of_frames_are_drawn(space, n_frames, tmp_path):
    draw_model(learned(space, n_frames), tmp_path / "model.png")
    assert (tmp_path / "model.png").stat().st_size > 10_000


def test_another_kind_of_file_is_refused_and_not_made(tmp_path):
    with pytest.raises(InvalidConfiguration, match=r"figure.*\.png, \.pdf, \.svg"):
        draw_model(learned(), tmp_path / "model.txt")
    assert not list(tmp_path.iterdir())
