"""Runner of studies: trials on all cores, recorded in `DIR/STUDY.json` and `DIR/STUDY.md`.

A study is a module of this package, named in `STUDIES`, with three functions and an optional fourth:

    cases(trials, seed)     -> list of plain dictionaries, one per trial
    trial(case)             -> a plain dictionary; runs in another process
    summarise(results)      -> (summary, Markdown)
    draw(results, out_dir)  -> names of the figures that it made there

A study with real processes says `ONE_AT_A_TIME = True`: its cases would disturb each other.
A study that takes hours says `GOES_ON = True`: stopped, the same command goes on where it was. Its results are plain JSON.
A study of the arm says `TAKES_ROBOT = True`; then each case names the `arm` and the `own_arm` that the command line names.

Seeds that were used for tuning never report: `reporting_seeds` and `tuning_seeds` cannot overlap.
"""

from __future__ import annotations

import importlib
import multiprocessing
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing.util import Finalize
from pathlib import Path
from typing import Protocol, cast

from rich.console import Console
from rich.progress import track

from farhand.common.errors import InvalidConfiguration
from farhand.common.parent_process import end_with_parent
from farhand.evaluation.study_record import Case, FinishedTrials, StudyRecord, try_writing

STUDIES = {
    "planar": "farhand.evaluation.paper.planar",
    "hot-stab": "farhand.evaluation.arm.hot_stab",
    "hot-stab-removal": "farhand.evaluation.arm.hot_stab_removal",
    "hot-stab-live": "farhand.evaluation.live.hot_stab_live",
    "hot-stab-cuts": "farhand.evaluation.live.hot_stab_cuts",
    "hot-stab-links": "farhand.evaluation.live.hot_stab_links",
    "robustness": "farhand.evaluation.arm.robustness",
    "cross-arms": "farhand.evaluation.arm.cross_arms",
    "arm-soak": "farhand.evaluation.arm.arm_soak",
    "in-and-out": "farhand.evaluation.arm.in_and_out",
    "hot-stab-point": "farhand.evaluation.paper.hot_stab_point",
    "promp": "farhand.evaluation.paper.promp",
    "few-shot": "farhand.evaluation.paper.few_shot",
    "moving-target": "farhand.evaluation.paper.moving_target",
    "frame-age": "farhand.evaluation.paper.frame_age",
    "lambda": "farhand.evaluation.paper.max_distance",
    "algorithm-1": "farhand.evaluation.paper.algorithm_1",
    "online-batch": "farhand.evaluation.paper.online_batch",
    "assignment": "farhand.evaluation.paper.assignment",
    "noise": "farhand.evaluation.paper.noise",
    "human": "farhand.evaluation.human.human",
    "handwriting": "farhand.evaluation.human.handwriting",
    "hub": "farhand.evaluation.link.hub",
    "link-chaos": "farhand.evaluation.link.link_chaos",
    "link-delay": "farhand.evaluation.link.link_delay",
    "delivery": "farhand.evaluation.link.delivery",
    "bad-peers": "farhand.evaluation.link.bad_peers",
    "renewal": "farhand.evaluation.live.renewal",
    "link-recovery": "farhand.evaluation.link.link_recovery",
    "link-profiles": "farhand.evaluation.link.link_profiles",
    "link-profiles-real": "farhand.evaluation.link.real_profiles",
    "cuts": "farhand.evaluation.link.cuts",
    "cuts-real": "farhand.evaluation.link.real_cuts",
    "kills": "farhand.evaluation.live.kills",
    "surroundings": "farhand.evaluation.live.surroundings",
    "tick": "farhand.evaluation.live.tick",
    "mutations": "farhand.evaluation.faults.mutation_study",
    "neighbours": "farhand.evaluation.live.neighbours",
    "stop-lane": "farhand.evaluation.live.stop_lane",
    "modes": "farhand.evaluation.modes.modes",
    "freshness": "farhand.evaluation.link.freshness",
}

_FIRST_REPORTING_SEED = 1_000_000
_SEEDS_PER_STUDY = 10_000
_MOST = 1_000_000


class Study(Protocol):
    """Interface of a study's module."""

    def cases(self, trials: int | None, seed: int) -> list[Case]:
        """List the cases to run."""
        ...

    def trial(self, case: Case) -> Case:
        """Run one case."""
        ...

    def summarise(self, results: list[Case]) -> tuple[Case, str]:
        """Return summary and Markdown."""
        ...


def tuning_seeds(seed: int, n: int) -> range:
    """Return seeds for choosing parameters; none of them is ever a reporting seed."""
    first = seed % (_FIRST_REPORTING_SEED // _SEEDS_PER_STUDY) * _SEEDS_PER_STUDY
    return range(first, first + min(n, _SEEDS_PER_STUDY))


def reporting_seeds(seed: int, n: int) -> range:
    """Return seeds for the reported figures."""
    first = _FIRST_REPORTING_SEED + seed * _SEEDS_PER_STUDY
    return range(first, first + n)


def run(
    name: str,
    trials: int | None,
    seed: int,
    out_dir: Path | str,
    command: str,
    robot: str = "",
    own_arm: str = "",
    only: str | None = None,
) -> Path:
    """Run a study and write its record.

    Args:
        name: One of `STUDIES`.
        trials: Number of trials; the study's own number when not given.
        seed: Chooses the reporting seeds.
        out_dir: Folder of the record, or of one folder for each robot or own arm that is named; made when missing.
        command: Command line, for the record.
        robot: Name or file of the robot, for a study of the arm.
        own_arm: Name or file of the arm on which such a study is taught.
        only: Runs only the cases in which some value is this word.

    Returns:
        Path of the JSON file.

    Raises:
        InvalidConfiguration: When there is no such study or it cannot run here.
    """
    if name not in STUDIES:
        raise InvalidConfiguration("evaluate", "study", f"one of {', '.join(sorted(STUDIES))}, got {name!r}")
    if trials is not None and not 1 <= trials <= _MOST:
        raise InvalidConfiguration("evaluate", "trials", f"at least one, at most {_MOST}, got {trials}")
    if not 0 <= seed <= _MOST:
        raise InvalidConfiguration("evaluate", "seed", f"from 0 to {_MOST}, got {seed}")
    study = cast(Study, importlib.import_module(STUDIES[name]))
    arms = {key: value for key, value in (("arm", robot), ("own_arm", own_arm)) if value}
    if arms and not getattr(study, "TAKES_ROBOT", False):
        raise InvalidConfiguration(
            "evaluate", next(iter(arms)), f"none: {name} runs on no arm, or on one alone"
        )
    which = _names_of(arms)
    out_dir = Path(out_dir) / which
    try_writing(out_dir)
    finished = FinishedTrials(name, out_dir) if getattr(study, "GOES_ON", False) else None
    results = _run_all(
        name, study.trial, [{**case, **arms} for case in chosen(study.cases(trials, seed), only)],
        getattr(study, "ONE_AT_A_TIME", False), finished,
    )  # fmt: skip
    summary, markdown = study.summarise(results)
    out_dir.mkdir(parents=True, exist_ok=True)
    figures = getattr(study, "draw", lambda results, out_dir: [])(results, out_dir)
    title, _, text = markdown.partition("\n")
    titled = "\n".join([f"{title}: {which}" if which else title, text])
    path = StudyRecord(name, command, seed, results, summary).write(out_dir, titled, figures)
    if finished is not None:
        finished.forget()
    return path


def _names_of(arms: dict[str, str]) -> str:
    """Return the folder of another arm's results, which do not take the place of the usual arm's; empty for that."""
    robot, own_arm = (Path(arms.get(key, "")).stem for key in ("arm", "own_arm"))
    return f"{robot}-taught-on-{own_arm}".removeprefix("-") if own_arm else robot


def words(cases: list[Case]) -> list[str]:
    """Return the words that tell the cases apart, for `--only`."""
    return sorted({value for case in cases for value in case.values() if isinstance(value, str)})


def chosen(cases: list[Case], only: str | None) -> list[Case]:
    """Return the cases with this word; all when it is None.

    Raises:
        InvalidConfiguration: When no case has it.
    """
    found = [case for case in cases if only is None or only in map(str, case.values())]
    if not found:
        told_apart = (
            f"one of {', '.join(words(cases))}"
            if words(cases)
            else "none: the study does not tell cases apart"
        )
        raise InvalidConfiguration("evaluate", "only", f"{told_apart}, got {only!r}")
    return found


def by_value(results: list[Case], key: str, values: Iterable[str]) -> dict[str, list[Case]]:
    """Group results by one of their values, without the values that `--only` left out."""
    groups = {value: [result for result in results if result[key] == value] for value in values}
    return {value: group for value, group in groups.items() if group}


def _run_all(
    name: str,
    trial: Callable[[Case], Case],
    cases: list[Case],
    one_at_a_time: bool = False,
    finished: FinishedTrials | None = None,
) -> list[Case]:
    """Run the cases in other processes, in any order, and return their results in the cases' order."""
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):  # for the children, before they import numpy
        os.environ.setdefault(variable, "1")
    earlier = {number: finished.get(case) for number, case in enumerate(cases)} if finished else {}
    results = {number: result for number, result in earlier.items() if result is not None}
    context = multiprocessing.get_context("spawn")
    n_workers = 1 if one_at_a_time else min(os.cpu_count() or 1, len(cases))
    with ProcessPoolExecutor(n_workers, context, _begin_worker, (os.getpid(),)) as pool:
        numbers = {
            pool.submit(trial, case): number for number, case in enumerate(cases) if number not in results
        }
        try:
            for future in _shown(name, as_completed(numbers), len(numbers)):
                number = numbers[future]
                results[number] = future.result()
                if finished is not None:
                    finished.add(cases[number], results[number])
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for worker in multiprocessing.active_children():  # its trial may take minutes more
                worker.terminate()
            raise
    return [results[number] for number in range(len(cases))]


def _begin_worker(parent_pid: int) -> None:
    end_with_parent(parent_pid)
    # Its results are delivered by then. The interpreter would wait for connections that are being closed, and could abort in them.
    Finalize(None, _leave, exitpriority=-100)


def _leave() -> None:
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


def _shown(name: str, items: Iterator, total: int) -> Iterator:
    """Iterate over the items with a progress bar on the terminal."""
    return iter(track(items, description=name, total=total, console=Console(file=sys.stderr)))
