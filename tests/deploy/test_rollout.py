"""A rollout says when it gave up, and nothing is written that could not be read again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from farhand.common.errors import InvalidConfiguration, InvalidDemonstration, InvalidModel
from farhand.common.model.model_file import encode, save
from farhand.deploy.offline import learn, rollout
from farhand.deploy.rollout import reproduce
from farhand.evaluation.faults.sound_files import sound_files
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.offline_learning import learn_files
from farhand.remote_site.reproduction import point_rollout as reproduction


@pytest.fixture
def like(tmp_path: Path) -> Path:
    (tmp_path / "d.npz").write_bytes(sound_files()["d.npz"])
    return tmp_path / "d.npz"


def test_a_motion_that_arrives_succeeds_and_one_that_is_given_up_fails_and_says_so(
    tmp_path: Path, like: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    save(learn_files([like]), tmp_path / "model")
    assert rollout(tmp_path / "model", like, None) == 0
    assert "gave up" not in capsys.readouterr().out
    monkeypatch.setattr(reproduction, "_PATIENCE", 0.1)
    monkeypatch.setattr(reproduction, "_PATIENCE_S", 0.0)
    assert rollout(tmp_path / "model", like, tmp_path / "out.npz") == 1
    assert "gave up before the model's end" in capsys.readouterr().out
    assert "gave up" in Demonstration.load(tmp_path / "out.npz").source


@pytest.mark.parametrize("lambda_m", [1e9, 1e3, 10.0])
def test_a_lambda_that_no_motion_reaches_is_refused_and_nothing_is_written(
    tmp_path: Path, like: Path, lambda_m: float
):
    with pytest.raises(InvalidDemonstration, match=r"d\.npz: position_m: .*smaller lambda"):
        learn([like], tmp_path / "model", lambda_m)
    assert not (tmp_path / "model").exists()


@pytest.mark.parametrize("lambda_m", [1e-320, 1e-300, 1e-9, 1.9e-6])
def test_a_lambda_below_what_any_sensor_tells_apart_is_refused(tmp_path: Path, like: Path, lambda_m: float):
    with pytest.raises(InvalidConfiguration, match="1e-07 m or more"):
        learn([like], tmp_path / "model", lambda_m)


@pytest.mark.parametrize("field", ["elapsed_mean_s", "slopes", "duration_mean_s"])
def test_a_model_that_could_not_be_read_again_is_not_written(tmp_path: Path, like: Path, field: str):
    model = learn_files([like])
    object.__setattr__(model, field, np.full_like(getattr(model, field), 1e39))
    with pytest.raises(InvalidModel):
        save(model, tmp_path / "model")
    assert not (tmp_path / "model").exists()
    encode(learn_files([like]))


@pytest.mark.parametrize("duration_s", [1e3, 1e6, 3e4])
def test_a_rollout_that_would_take_longer_than_anybody_demonstrates_is_refused_at_once(
    tmp_path: Path, like: Path, duration_s: float
):
    """Also where each component is plausible: the sum of what is expected is held against the bound."""
    model = learn_files([like])
    slow = {"ways": (), "duration_mean_s": np.where(model.terminal, 0.0, duration_s)}
    for field, value in slow.items():  # past the checks of a file
        object.__setattr__(model, field, value)
    with pytest.raises(InvalidModel, match=r"duration_mean_s: .*300"):
        reproduce(model, Demonstration.load(like))


def test_a_rollout_within_the_bound_ends_within_it(like: Path):
    motion, _ = reproduce(learn_files([like]), Demonstration.load(like))
    assert motion.time_s[-1] <= reproduction.LONGEST_S
