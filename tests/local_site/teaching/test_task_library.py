from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from farhand.common.errors import InvalidDemonstration
from farhand.common.model.model_file import content_hash, load
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.plausibility import PERIOD_S as LEARNING_PERIOD_S
from farhand.local_site.teaching.samples import sample_strokes
from farhand.local_site.teaching.task_archive import NotSaved
from farhand.local_site.teaching.task_library import TaskLibrary
from farhand.local_site.teaching.teaching_permission import NotNow
from tests.local_site.robot_end import FRAMES, TASK, stroke


def teach(library: TaskLibrary, n: int = 60) -> None:
    library.record(FRAMES)
    for position, time_s in zip(*stroke(n), strict=True):
        library.hand(position, float(time_s))
    library.end()


def files(folder: Path) -> list[str]:
    return sorted(path.name for path in (folder / TASK.name).iterdir())


def test_a_demonstration_is_learned_and_both_it_and_the_model_are_on_disk(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    teach(library)
    learned = library.learned
    assert learned is not None and learned.sha256 == content_hash(learned.content)
    assert load(tmp_path / TASK.name / "newest.farhand") == learned.model
    (name,) = (name for name in files(tmp_path) if name.endswith(".npz"))
    made = Demonstration.load(tmp_path / TASK.name / name)
    np.testing.assert_array_equal(made.position_m, library.strokes[0])
    assert made.frame_names == TASK.frame_names
    np.testing.assert_allclose(made.frame_origin_m, [TASK.target.origin_m])


@pytest.mark.parametrize("period_s", [0.005, 0.02, 0.05, 0.3])
def test_the_hand_is_learned_at_one_rate_whatever_its_own(tmp_path: Path, period_s: float):
    library = TaskLibrary(TASK, tmp_path)
    library.record(FRAMES)
    times = np.arange(0.0, 2.0 + 1e-9, period_s)
    for time_s in times:
        library.hand(np.array([0.1 + 0.3 * time_s, 0.5]), 7.0 + time_s)
    library.end()
    points = library.strokes[0]
    assert len(points) == pytest.approx(times[-1] / LEARNING_PERIOD_S + 1, abs=1)
    np.testing.assert_allclose(
        points[:, 0], 0.1 + 0.3 * LEARNING_PERIOD_S * np.arange(len(points)), atol=1e-9
    )


def test_undo_puts_everything_back_bit_for_bit(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    teach(library)
    before, strokes = library.learned, library.strokes
    teach(library, n=40)
    assert library.learned is not None and before is not None
    assert library.learned.sha256 != before.sha256
    library.undo()
    assert library.learned.content == before.content and library.strokes == strokes
    assert load(tmp_path / TASK.name / "newest.farhand") == before.model
    library.undo()
    assert library.learned is None and not library.can_undo
    assert "newest.farhand" not in files(tmp_path)
    with pytest.raises(NotNow):
        library.undo()


def test_undo_while_recording_forgets_the_running_demonstration_alone(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    teach(library)
    before = library.learned
    library.record(FRAMES)
    library.hand(np.array([0.1, 0.1]), 0.0)
    library.undo()
    assert not library.recording and not library.current
    assert library.learned is not None and before is not None
    assert library.learned.content == before.content


def test_the_same_strokes_give_the_same_model(tmp_path: Path):
    one, other = TaskLibrary(TASK, tmp_path / "a"), TaskLibrary(TASK, tmp_path / "b")
    for library in (one, other):
        library.learn(sample_strokes(TASK))
    assert one.learned is not None and other.learned is not None
    assert one.learned.content == other.learned.content
    assert len(one.strokes) == len(TASK.samples)


def test_record_and_end_in_the_wrong_order_say_what_to_press(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    with pytest.raises(NotNow, match="Record"):
        library.end()
    library.record(FRAMES)
    with pytest.raises(NotNow, match="end or undo"):
        library.record(FRAMES)
    assert library.recording


def test_a_demonstration_that_is_too_short_is_forgotten(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    library.record(FRAMES)
    library.hand(np.array([0.1, 0.1]), 0.0)
    with pytest.raises(NotNow, match="too short"):
        library.end()
    assert not library.recording and library.learned is None and not library.can_undo


BAD_HANDS = {
    "not finite": ((np.nan, 0.1), 0.1),
    "too many": ((0.1, 0.1, 0.1), 0.1),
    "backwards": ((0.1, 0.1), -1.0),
    "a jump": ((0.1, 0.1), 1e6),
    "no time": ((0.1, 0.1), np.nan),
}


@pytest.mark.parametrize("case", BAD_HANDS)
def test_a_bad_event_of_the_hand_is_refused_and_teaches_nothing(tmp_path: Path, case: str):
    library = TaskLibrary(TASK, tmp_path)
    library.record(FRAMES)
    library.hand(np.array([0.1, 0.1]), 0.0)
    position, time_s = BAD_HANDS[case]
    with pytest.raises(InvalidDemonstration):
        library.hand(np.array(position), time_s)
    assert len(library.current) == 1 and library.recording


def test_a_hand_that_is_not_recorded_teaches_nothing(tmp_path: Path):
    with pytest.raises(InvalidDemonstration):
        TaskLibrary(TASK, tmp_path).hand(np.array([0.1, 0.1]), 0.0)


def test_the_forming_model_grows_with_the_stroke(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    assert library.forming() is None
    library.record(FRAMES)
    assert library.forming() is None
    sizes = []
    for position, time_s in zip(*stroke(), strict=True):
        library.hand(position, float(time_s))
        if (forming := library.forming()) is not None:
            sizes.append(forming.n_components)
    assert len(sizes) > 50
    assert sizes[0] == 1 and sizes[-1] >= 2 and sizes == sorted(sizes)
    library.end()
    assert library.forming() is None


def test_a_folder_that_cannot_be_written_costs_nothing_that_was_learned(tmp_path: Path):
    (tmp_path / TASK.name).write_text("a file where the folder should be")
    library = TaskLibrary(TASK, tmp_path)
    with pytest.raises(NotSaved, match="cannot be written"):
        teach(library)
    assert library.learned is not None and len(library.strokes) == 1 and not library.recording
