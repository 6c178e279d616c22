from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from farhand.common.errors import InvalidDemonstration
from farhand.local_site.recordings.importing import understand, write_all
from farhand.local_site.recordings.options import ImportOptions, Kind
from farhand.local_site.teaching.demonstration import Demonstration

RNG = np.random.default_rng(0)
CURVES_MM = 50.0 * RNG.normal(size=(3, 40, 2)).cumsum(axis=1)
TIMES = np.cumsum(RNG.uniform(0.01, 0.02, size=(3, 40)), axis=1)


def import_recordings(kind: Kind, file: Path, out: Path) -> list[Path]:
    return write_all([file], [understand(file, ImportOptions(kind=kind))], out)


def loaded(paths: list[Path]) -> list[Demonstration]:
    return [Demonstration.load(path) for path in paths]


@pytest.mark.parametrize("suffix", [".mat", ".npz"])
def test_lasa_millimetres_become_metres_with_the_goal_at_the_end(tmp_path: Path, suffix: str):
    file = tmp_path / f"Curve{suffix}"
    if suffix == ".mat":
        demos = np.empty((1, 3), dtype=object)
        for n in range(3):
            demos[0, n] = {"pos": CURVES_MM[n].T, "t": TIMES[n][None]}
        savemat(file, {"demos": demos})
    else:
        np.savez(file, pos=CURVES_MM, t=TIMES)
    paths = import_recordings("lasa", file, tmp_path / "out")
    assert [path.name for path in paths] == ["Curve_01.npz", "Curve_02.npz", "Curve_03.npz"]
    for n, made in enumerate(loaded(paths)):
        np.testing.assert_allclose(made.position_m, CURVES_MM[n] / 1000.0)
        np.testing.assert_allclose(made.time_s, TIMES[n] - TIMES[n, 0])
        np.testing.assert_allclose(made.in_frame()[-1], 0.0)
        assert made.frame_names == ("goal",)
        assert made.source == f"Curve{suffix} {n + 1}"


def test_robotasks_carry_their_orientation(tmp_path: Path):
    quats = Rotation.random(80, rng=RNG).as_quat(scalar_first=True).reshape(2, 40, 4)
    poses = np.concatenate([RNG.normal(size=(2, 40, 3)), quats], axis=2)
    np.save(tmp_path / "pour.npy", poses)
    made = loaded(import_recordings("robotasks", tmp_path / "pour.npy", tmp_path))[1]
    np.testing.assert_allclose(made.position_m, poses[1, :, :3] / 100.0)
    assert made.quat_wxyz is not None
    same = np.abs(np.sum(made.quat_wxyz * quats[1], axis=1))  # q and -q are one orientation
    np.testing.assert_allclose(same, 1.0)
    np.testing.assert_allclose(np.diff(made.time_s), 1 / 60.0)


def test_letters_are_planar_centimetres(tmp_path: Path):
    np.save(tmp_path / "e.npy", CURVES_MM)
    made = loaded(import_recordings("letters", tmp_path / "e.npy", tmp_path))[0]
    np.testing.assert_allclose(made.position_m, CURVES_MM[0] / 100.0)


def test_a_research_set_is_named_by_the_user_and_the_refusal_says_how(tmp_path: Path):
    np.save(tmp_path / "e.npy", CURVES_MM)
    np.savez(tmp_path / "Curve.npz", pos=CURVES_MM, t=TIMES)
    for name, remedy in (("e.npy", "--kind letters"), ("Curve.npz", "--kind lasa")):
        with pytest.raises(InvalidDemonstration, match=f"{name}: kind: .*{remedy}"):
            understand(tmp_path / name, ImportOptions())


def test_what_is_no_such_recording_is_refused_and_nothing_is_written(tmp_path: Path):
    (tmp_path / "text.mat").write_text("hello")
    np.savez(tmp_path / "other.npz", x=np.zeros(3))
    np.save(tmp_path / "flat.npy", np.zeros((40, 2)))
    np.save(tmp_path / "pickled.npy", np.array([{}], dtype=object))
    broken = np.array(CURVES_MM)
    broken[2, 7, 0] = np.inf
    np.save(tmp_path / "infinite.npy", broken)
    cases: list[tuple[Kind, str]] = [
        ("lasa", "text.mat"),
        ("lasa", "other.npz"),
        ("letters", "flat.npy"),
        ("robotasks", "flat.npy"),
        ("letters", "pickled.npy"),
        ("letters", "infinite.npy"),
        ("letters", "none.npy"),
    ]
    for kind, name in cases:
        with pytest.raises(InvalidDemonstration, match=name):
            import_recordings(kind, tmp_path / name, tmp_path / "out")
    assert not (tmp_path / "out").exists()
