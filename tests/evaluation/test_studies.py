"""Every study at about one per cent of its size, with the same code."""

from __future__ import annotations

import importlib
import json
from pathlib import Path

import pytest

from farhand.evaluation.human.human_report import files
from farhand.evaluation.study import STUDIES, chosen, tuning_seeds, words
from farhand.evaluation.study_record import plain

# What a study must find even at this size.
FINDS = {
    "assignment": lambda found: (
        found["base, handle: nearest"]["n_components"] < found["base, handle: all"]["n_components"]
    ),
    "algorithm-1": lambda found: (
        found["count"]["worst_mean_error_m"] < 1e-12
        and found["count"]["worst_covariance_error"] < 1e-10
        and 1e-5 < found["published"]["worst_mean_error_m"] < 1e-3 < found["printed"]["worst_mean_error_m"]
    ),
    "few-shot": lambda found: found["3, ours"]["success_rate"] == 1.0,
    "frame-age": lambda found: found["0 s"]["median_error_m"] < 0.003 < found["0.6 s"]["median_error_m"],
    "hot-stab": lambda found: found["clean"]["success_rate"] == 1.0 and found["dtw_rms_m"] < 0.012,
    "hot-stab-removal": lambda found: (
        found["clean"]["success_rate"] == found["typical"]["success_rate"] == 1.0
        and found["typical"]["peak_max_n"] < 100.0
    ),
    "hot-stab-point": lambda found: found["dtw_rms_m"] < 0.008,
    "lambda": lambda found: found["0.02 m, ramp"]["n_components"] > found["0.2 m, ramp"]["n_components"],
    "moving-target": lambda found: found["ours"]["median_end_m"] < 0.003,
    "online-batch": lambda found: found["speed_ratio_median"] > 1.0,
    "planar": lambda found: found["rms_percent_median"] < 1.0,
    "promp": lambda found: found["seen, ours"]["dtw_rms_m"] < 0.008,
}


def run_small(name: str, out_dir: Path) -> tuple[dict, str]:
    study = importlib.import_module(STUDIES[name])
    results = [study.trial(case) for case in study.cases(1, 7)]
    summary, markdown = study.summarise(results)
    for only in words(results):  # what `--only` leaves is summarised as well
        assert study.summarise(chosen(results, only))[1].startswith("# "), only
    json.dumps(plain({"trials": results, "summary": summary}), allow_nan=False)
    figures = study.draw(results, out_dir)
    assert figures
    assert all((out_dir / figure).read_bytes().startswith(b"\x89PNG") for figure in figures)
    assert markdown.startswith("# ")
    assert "| --- |" in markdown
    return summary, markdown


@pytest.mark.parametrize("name", sorted(FINDS))
def test_a_study_measures_tabulates_and_draws(name: str, tmp_path: Path):
    summary, _ = run_small(name, tmp_path)
    assert FINDS[name](summary)


@pytest.mark.skipif(not files("letters"), reason="the optional folder of human data is not here")
def test_people_s_demonstrations_are_reproduced_wherever_the_scene_is(tmp_path: Path):
    summary, markdown = run_small("human", tmp_path)
    assert summary["moved_m"] < 1e-9
    assert "Two ways, human-like" in markdown


@pytest.mark.parametrize("name", sorted(FINDS))
def test_tuning_never_sees_the_seeds_that_report(name: str):
    cases = importlib.import_module(STUDIES[name]).cases(3, 0)
    assert {case["seed"] for case in cases}.isdisjoint(tuning_seeds(0, 10_000))
