"""Revisions of a task: gone back to bit for bit, also by a later process, also after a kill at any moment."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from farhand.common.errors import InvalidDemonstration
from farhand.common.model.model_file import content_hash, load
from farhand.local_site.teaching.revisions import KEPT
from farhand.local_site.teaching.samples import sample_strokes
from farhand.local_site.teaching.task_library import TaskLibrary
from farhand.local_site.teaching.teaching_permission import NotNow
from tests.local_site.robot_end import FRAMES, TASK, stroke

INDEX = "library.json"


def teach(library: TaskLibrary, n: int = 60) -> str:
    """Make a demonstration that differs with n. Returns the model's hash."""
    library.record(FRAMES)
    for position, time_s in zip(*stroke(n), strict=True):
        library.hand(position, float(time_s) + 3.7)
    return library.end().sha256


def demonstration_files(data_dir: Path) -> set[str]:
    return {path.name for path in (data_dir / TASK.name).glob("demonstration-*.npz")}


def test_a_later_process_begins_with_what_was_taught_bit_for_bit_and_refines_it(tmp_path: Path):
    first = TaskLibrary(TASK, tmp_path)
    for n in (60, 45):
        sha256 = teach(first, n)
    later = TaskLibrary(TASK, tmp_path)
    assert later.learned is not None and later.learned.sha256 == sha256
    assert later.revision == first.revision == 2 and not later.recording
    for one, other in zip(later.strokes, first.strokes, strict=True):
        np.testing.assert_array_equal(one, other)
    assert teach(later, 50) == teach(first, 50)


def test_every_revision_has_its_parent_and_its_model(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    hashes = [teach(library, n) for n in (60, 45, 50)]
    assert [(r.number, r.parent, r.sha256) for r in library.revisions] == [
        (1, 0, hashes[0]), (2, 1, hashes[1]), (3, 2, hashes[2]),
    ]  # fmt: skip


def test_undo_goes_back_a_revision_and_what_was_undone_can_be_had_again(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    one, two = teach(library, 60), teach(library, 45)
    library.undo()
    assert library.learned is not None and library.learned.sha256 == one
    assert (library.revision, len(library.revisions)) == (1, 2)
    library.go_to(2)
    assert library.learned.sha256 == two
    assert content_hash((tmp_path / TASK.name / "newest.farhand").read_bytes()) == two


def test_a_branch_from_an_older_revision_is_a_new_one(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    teach(library, 60)
    teach(library, 45)
    library.go_to(1)
    teach(library, 50)
    assert [(r.number, r.parent) for r in library.revisions] == [(1, 0), (2, 1), (3, 1)]


def test_starting_anew_keeps_what_was_taught(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    sha256 = teach(library)
    library.start_anew()
    assert library.learned is None and not library.strokes and not library.can_undo
    assert not (tmp_path / TASK.name / "newest.farhand").exists()
    library = TaskLibrary(TASK, tmp_path)
    assert library.learned is None and library.revision == 2
    library.go_to(1)
    assert library.learned is not None and library.learned.sha256 == sha256


def test_only_the_newest_revisions_are_kept_and_no_demonstration_that_none_of_them_has(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    teach(library, 60)
    library.undo()
    for n in range(40, 40 + KEPT):
        teach(library, n)
    assert [r.number for r in library.revisions] == list(range(3, 3 + KEPT))
    named = {name for revision in library.revisions for name in revision.demonstrations}
    assert demonstration_files(tmp_path) == named and len(named) == KEPT
    # Undo is not limited by that: every demonstration of the present revision can be taken back.
    for left in range(KEPT - 1, -1, -1):
        library.undo()
        assert len(library.strokes) == left


@pytest.mark.parametrize("leave", ["anew", "to an older one", "anew twice"])
def test_what_was_left_on_purpose_stays_until_it_is_deleted_however_much_is_taught_since(
    tmp_path: Path, leave: str
):
    library = TaskLibrary(TASK, tmp_path)
    teach(library, 60)
    own = teach(library, 45)
    number = library.revision
    if leave == "to an older one":
        library.go_to(1)
    else:
        library.start_anew()
    if leave == "anew twice":
        teach(library, 44)
        library.start_anew()
    for _ in range(2):
        library.learn(sample_strokes(TASK))
    for n in range(40, 40 + 2 * KEPT):
        teach(library, n)
    library = TaskLibrary(TASK, tmp_path)
    library.go_to(number)
    assert library.learned is not None and library.learned.sha256 == own
    library.go_to(library.revisions[-1].number)
    library.delete(number)
    assert number not in [r.number for r in library.revisions]


def test_a_deleted_revision_is_gone_and_the_one_that_counts_cannot_be(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    teach(library, 60)
    library.start_anew()
    teach(library, 45)
    with pytest.raises(NotNow, match="is the current one"):
        library.delete(3)
    library.delete(1)
    with pytest.raises(NotNow, match="revision 1 is not kept"):
        library.go_to(1)
    assert len(demonstration_files(tmp_path)) == 1
    assert [r.number for r in TaskLibrary(TASK, tmp_path).revisions] == [2, 3]


def test_nothing_is_gone_back_to_while_a_demonstration_is_recorded(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    teach(library)
    library.record(FRAMES)
    for ask in (lambda: library.go_to(1), library.start_anew):
        with pytest.raises(NotNow, match="being recorded"):
            ask()
    assert library.recording


def test_a_revision_whose_file_is_damaged_is_refused_and_changes_nothing(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    teach(library, 60)
    library.start_anew()
    sha256 = teach(library, 45)
    (damaged,) = library.revisions[0].demonstrations
    (tmp_path / TASK.name / damaged).write_bytes(b"PK")
    with pytest.raises(InvalidDemonstration, match=damaged):
        library.go_to(1)
    assert library.learned is not None and library.learned.sha256 == sha256 and library.revision == 3


@pytest.mark.parametrize(
    "content",
    ["", "{", '{"schema": 2}', '{"revisions": [{"number": 1}]}',
     '{"current": 1, "last": 1, "revisions": [{"number": 1, "parent": 0, "sha256": "", '
     '"demonstrations": ["../secret.npz"], "made": ""}]}'],
)  # fmt: skip
def test_a_list_that_is_not_understood_is_kept_aside_and_the_task_begins_empty(tmp_path: Path, content: str):
    (tmp_path / TASK.name).mkdir()
    (tmp_path / TASK.name / INDEX).write_text(content)
    library = TaskLibrary(TASK, tmp_path)
    assert not library.revisions and library.learned is None
    assert (tmp_path / TASK.name / "library.unreadable").read_text() == content
    teach(library)
    assert TaskLibrary(TASK, tmp_path).revision == 1


TEACHER = """
import sys
from pathlib import Path
from farhand.local_site.teaching.task_library import TaskLibrary
from tests.local_site.teaching.test_lesson import TASK, teach
library = TaskLibrary(TASK, Path(sys.argv[1]))
print("ready", flush=True)
for n in range(40, 400):
    print(teach(library, n), flush=True)
    if n % 3 == 0:
        library.undo()
"""


def test_a_kill_at_any_moment_loses_nothing_that_was_said_to_be_kept(tmp_path: Path):
    for n_said in (1, 2, 4, 7):
        process = subprocess.Popen(
            [sys.executable, "-c", TEACHER, str(tmp_path)], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout is not None
        said = [process.stdout.readline().strip() for _ in range(1 + n_said)]
        process.kill()
        process.wait()
        process.stdout.close()
        library = TaskLibrary(TASK, tmp_path)
        present = next(r for r in library.revisions if r.number == library.revision)
        assert library.learned is not None and library.learned.sha256 == present.sha256
        assert said[-1] in {revision.sha256 for revision in library.revisions}
        assert load(tmp_path / TASK.name / "newest.farhand") == library.learned.model
        named = {name for revision in library.revisions for name in revision.demonstrations}
        assert named <= demonstration_files(tmp_path)


@pytest.mark.parametrize("which", [0, 1, 2])
def test_one_demonstration_is_removed_and_undo_brings_it_back_bit_for_bit(tmp_path: Path, which: int):
    library, others = TaskLibrary(TASK, tmp_path / "all"), TaskLibrary(TASK, tmp_path / "others")
    lengths = [60, 45, 50]
    for n in lengths:
        teach(library, n)
    whole, names = library.learned, library.demonstration_names
    for k, n in enumerate(lengths):
        if k != which:
            teach(others, n)
    library.remove(names[which])
    assert library.demonstration_names == tuple(name for k, name in enumerate(names) if k != which)
    assert library.learned is not None and others.learned is not None and whole is not None
    assert library.learned.content == others.learned.content
    with pytest.raises(NotNow, match="not in the current revision any more"):
        library.remove(names[which])  # a second press means the same one
    later = TaskLibrary(TASK, tmp_path / "all")
    assert later.learned is not None and later.learned.content == others.learned.content
    library.undo()
    assert library.learned.content == whole.content and library.demonstration_names == names
    assert demonstration_files(tmp_path / "all") == set(names)


def test_the_only_demonstration_can_be_removed_and_had_again(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    sha256 = teach(library)
    library.remove(library.demonstration_names[0])
    assert library.learned is None and library.can_undo
    library.undo()
    assert library.learned is not None and library.learned.sha256 == sha256


def test_what_is_learned_after_a_removal_is_undone_first_as_ever(tmp_path: Path):
    library = TaskLibrary(TASK, tmp_path)
    for n in (60, 45):
        teach(library, n)
    library.remove(library.demonstration_names[0])
    rest = library.learned
    teach(library, 50)
    library.undo()
    assert rest is not None and library.learned is not None and library.learned.content == rest.content
