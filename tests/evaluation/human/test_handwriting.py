from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from farhand.evaluation.human import handwriting
from farhand.evaluation.metrics.motion_metrics import dtw_rms
from farhand.local_site.recordings.importing import read_demonstrations
from farhand.local_site.recordings.options import ImportOptions


@pytest.fixture
def shared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two shapes, in place of the optional one."""
    monkeypatch.setenv("FARHAND_LASA_DIR", str(tmp_path))
    angle = np.linspace(0.0, 2.0, 60)
    for name, phase in (("arc", 0.0), ("bow", 0.5)):
        arc = np.stack([np.cos(angle + phase), np.sin(angle)], axis=1)
        pos = 50.0 * arc + np.random.default_rng(0).normal(0.0, 1.0, (3, 1, 2))  # mm
        np.savez(tmp_path / f"{name}.npz", pos=pos, t=np.linspace(0.0, 2.0, 60))
    return tmp_path


def result(shape: str, error: float, spread: float, origin: str = "lasa") -> dict:
    return {
        "part": "shape", "set": origin, "shape": shape, "error": error, "spread": spread, "nearest": 1.25,
        "end_error": 0.1, "success": error < spread, "n_components": 7, "n_paths": 1, "duration_ratio": 1.0,
    }  # fmt: skip


def test_all_thirty_shapes_and_those_of_the_folder_are_studied_and_the_fragile_one_sampled(shared):
    cases = handwriting.cases(None, 0)
    shapes = [case for case in cases if case["part"] == "shape"]
    assert [case["set"] for case in shapes].count("lasa") == 30
    assert [Path(case["file"]) for case in shapes[30:]] == [shared / "arc.npz", shared / "bow.npz"]
    sampled = [case for case in cases if case["part"] == "sampling"]
    assert sampled and {Path(case["file"]).stem for case in sampled} == {"CShape"}


def test_a_number_of_trials_takes_the_first_shapes_only():
    assert handwriting.cases(3, 0) == handwriting.cases(None, 0)[:3]


def test_a_trial_learns_all_but_the_last_and_measures_against_that_one(shared):
    case = {"part": "shape", "set": "shared", "file": str(shared / "arc.npz")}
    measured = handwriting.trial(case)
    assert measured["shape"] == "arc"
    *taught, last = [
        d.in_frame() for d in read_demonstrations(shared / "arc.npz", ImportOptions(kind="lasa"))
    ]
    extent = np.ptp(last, axis=0).max()
    assert measured["nearest"] == pytest.approx(
        100.0 * min(dtw_rms(last, other) for other in taught) / extent
    )
    pairs = [dtw_rms(taught[0], taught[1]), dtw_rms(taught[0], last), dtw_rms(taught[1], last)]
    assert measured["spread"] == pytest.approx(100.0 * np.mean(pairs) / extent)
    assert measured["success"] == (measured["error"] < measured["spread"])
    assert measured["error"] < 5.0
    assert measured["end_error"] < 2.0


def test_what_the_last_person_wrote_is_not_learned(shared):
    """Another last demonstration from the same start in the same frame is reproduced as the same motion."""
    *taught, last = read_demonstrations(shared / "arc.npz", ImportOptions(kind="lasa"))
    bent = last.position_m.copy()
    bent[1:-1] += 0.02 * np.sin(np.linspace(0.0, np.pi, len(bent)))[1:-1, None]
    one = handwriting.leave_last_out([*taught, last])
    other = handwriting.leave_last_out([*taught, replace(last, position_m=bent)])
    for name in ("n_components", "n_paths", "duration_ratio"):
        assert one[name] == other[name]
    assert one["error"] != other["error"]


def test_the_summary_counts_and_lists_every_miss_with_its_numbers():
    results = [result("Line", 1.0, 9.0), result("JShape_2", 6.49, 5.62), result("Sine", 2.0, 3.0)]
    summary, text = handwriting.summarise(results)
    assert summary["lasa"]["n"] == 3
    assert summary["lasa"]["below_spread"] == 2
    assert summary["lasa"]["median_error"] == 2.0
    assert summary["lasa"]["worst_error"] == 6.49
    assert summary["lasa"]["misses"] == ["JShape_2"]
    assert summary["success_rate"] == pytest.approx(2 / 3)
    assert "JShape_2: error 6.49 %, spread 5.62 %, nearest person 1.25 %" in text
    assert "| JShape_2 (miss) | 6.49 | 5.62 |" in text


def test_a_set_that_is_not_here_is_said_and_not_counted():
    summary, text = handwriting.summarise([result("Line", 1.0, 9.0)])
    assert summary["shared"] == {"n": 0}
    assert "| not here |" in text
    assert "No miss." in text
