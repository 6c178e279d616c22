"""`farhand import`, `learn`, `model show`, `rollout`, `evaluate` on files."""

from __future__ import annotations

import json

import numpy as np

from farhand.common.model.model_file import content_hash
from farhand.local_site.teaching.demonstration import Demonstration
from tests.deploy.files.recordings import N_RECORDINGS, demonstrations, unchanged
from tests.farhand_process import farhand, put_foreign_code, refusal


def test_a_foreign_recording_becomes_demonstrations_in_metres_that_end_at_the_goal(folder):
    recorded = np.load(folder / "hook.npz")
    files = demonstrations(folder)
    assert len(files) == N_RECORDINGS
    for file, motion in zip(files, recorded["pos"], strict=True):
        demonstration = Demonstration.load(file)
        assert demonstration.frame_names == ("goal",)
        moved_mm = 1000.0 * (demonstration.position_m[-1] - demonstration.position_m[0])
        np.testing.assert_allclose(moved_mm, motion[-1] - motion[0], atol=1e-6)
        np.testing.assert_allclose(demonstration.in_frame()[-1], 0.0, atol=1e-12)
        assert "hook" in demonstration.source


def test_a_model_is_shown_with_its_size_its_hash_and_the_papers_figure(folder, tmp_path):
    with unchanged(folder):
        done = farhand("model", "show", folder / "hook.model", "--figure", tmp_path / "model.png")
    assert done.returncode == 0, done.stderr
    content = (folder / "hook.model").read_bytes()
    assert content_hash(content) in done.stdout
    assert f"{len(content)} B" in done.stdout
    assert f"{N_RECORDINGS - 1} demonstrations" in done.stdout
    first_column = [line.split()[0] for line in done.stdout.partition("leads to\n")[2].splitlines()]
    assert first_column[:2] == ["1", "2"], "components count from one, as on the page"
    assert (tmp_path / "model.png").read_bytes().startswith(b"\x89PNG")


def test_a_rollout_ends_where_the_left_out_demonstration_ends(folder, tmp_path):
    like, out = demonstrations(folder)[-1], tmp_path / "motion.npz"
    with unchanged(folder):
        done = farhand("rollout", folder / "hook.model", "--like", like, "--out", out)
    assert done.returncode == 0, done.stderr
    motion, taught = Demonstration.load(out), Demonstration.load(like)
    np.testing.assert_array_equal(motion.position_m[0], taught.position_m[0])
    extent_m = np.ptp(taught.position_m, axis=0).max()
    assert np.linalg.norm(motion.position_m[-1] - taught.position_m[-1]) < 0.02 * extent_m


def test_learning_the_same_again_writes_the_same_bytes(folder, tmp_path):
    with unchanged(folder):
        done = farhand("learn", *demonstrations(folder)[:-1], "--out", tmp_path / "again.model")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "again.model").read_bytes() == (folder / "hook.model").read_bytes()


# The study -------------------------------------------------------------------------------------


def test_the_study_of_handwriting_leaves_its_record_from_any_folder(tmp_path):
    put_foreign_code(tmp_path)  # which none of the study's processes may run
    done = farhand("evaluate", "handwriting", "--trials", 2, "--out", tmp_path / "results", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    record = json.loads((tmp_path / "results" / "handwriting.json").read_text())
    assert record["study"] == "handwriting"
    assert "evaluate handwriting --trials 2" in record["command"]
    assert len(record["trials"]) == 2
    low, high = record["summary"]["success_interval"]
    assert 0.0 <= low <= record["summary"]["success_rate"] <= high <= 1.0
    assert (tmp_path / "results" / "handwriting.md").read_text().startswith("# Handwriting")


def test_an_unknown_study_and_impossible_trials_are_refused(tmp_path):
    assert "handwriting" in refusal("evaluate", "knitting", "--out", tmp_path)
    assert "trials" in refusal("evaluate", "handwriting", "--trials", 0, "--out", tmp_path)
    assert "seed" in refusal("evaluate", "handwriting", "--seed", -1, "--out", tmp_path)
