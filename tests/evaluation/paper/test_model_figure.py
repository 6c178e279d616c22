from __future__ import annotations

import errno
import os

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


def test_a_figure_that_cannot_be_written_leaves_the_one_before_and_a_link_stays_one(tmp_path, monkeypatch):
    def full(_descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    link, file = tmp_path / "model.svg", tmp_path / "far"
    file.write_bytes(b"before")
    link.symlink_to(file)
    with monkeypatch.context() as patched, pytest.raises(OSError, match="No space left") as caught:
        patched.setattr(os, "fsync", full)
        draw_model(learned(), link)
    assert caught.value.filename == str(link)
    assert file.read_bytes() == b"before" and len(list(tmp_path.iterdir())) == 2
    draw_model(learned(), link)
    assert link.is_symlink() and file.read_bytes().startswith(b"<?xml")
