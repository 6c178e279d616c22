"""The commands that work on files alone: recordings, models, studies. The help texts here are documentation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from farhand.local_site.recordings.options import ImportOptions

Files = Annotated[tuple[Path, ...], tyro.conf.Positional]
File = Annotated[Path, tyro.conf.Positional]


@dataclass(frozen=True)
class Learn:
    """Learn a model from recorded demonstrations, in one pass."""

    demonstrations: Files
    """Demonstration files (.npz)."""
    out: Path
    """The model file to write."""
    max_distance_m: float | None = None
    """Lambda of the learning [m]; a quarter of the demonstrations' extent when not given. The page takes the task's own:
    0.1 for the hot-stab."""

    def run(self) -> int:
        """Do it."""
        from farhand.deploy.offline import learn

        return learn(self.demonstrations, self.out, self.max_distance_m)


@dataclass(frozen=True)
class Rollout:
    """Reproduce a model on the point plant, from a demonstration's start in its frames."""

    model: File
    """A model file."""
    like: Path
    """The demonstration whose start and frames are taken."""
    out: Path | None = None
    """Write the motion as a demonstration file."""

    def run(self) -> int:
        """Do it."""
        from farhand.deploy.offline import rollout

        return rollout(self.model, self.like, self.out)


@dataclass(frozen=True)
class Model:
    """Look into a model file: components, durations, transitions, size, hash."""

    do: Annotated[Literal["show"], tyro.conf.Positional]
    """What to do."""
    model: File
    """A model file."""
    figure: Path | None = None
    """Draw the paper's Fig. 3 of it to this file (.png, .pdf, .svg)."""

    def run(self) -> int:
        """Do it."""
        from farhand.deploy.offline import show

        return show(self.model, self.figure)


@dataclass(frozen=True)
class Evaluate:
    """Run a study of the evaluation; writes its page, its figures and its JSON."""

    study: Annotated[str, tyro.conf.Positional]
    """Name of the study: docs/results/README.md has them all, with what each takes; an unknown one lists the names."""
    trials: int | None = None
    """How many trials; all of the study's when not given."""
    seed: int = 0
    """Seed of the first trial; reporting and tuning never share one."""
    out: Path = Path("results")
    """Folder for the results."""

    def run(self) -> int:
        """Do it."""
        from farhand.deploy.offline import evaluate

        return evaluate(self.study, self.trials, self.seed, self.out)


@dataclass(frozen=True)
class Import(ImportOptions):
    """Turn recordings of other programs into demonstration files, and say how each was understood.

    CSV and other text, rosbag2 and MCAP, data sets of LeRobot and robomimic, and the research sets.
    """

    files: Files
    """Recordings: files, or the folder of a bag or a data set."""
    out: Path | None = None
    """Folder for the demonstration files."""
    preview: bool = False
    """Only say how the recordings are understood."""

    def run(self) -> int:
        """Do it."""
        from farhand.deploy.offline import import_recordings

        return import_recordings(self.files, self.out, self.preview, self)


@dataclass(frozen=True)
class Samples:
    """Have the scripted operator demonstrate on its simulated arm; files like those that come along."""

    out: Path
    """Folder for the demonstration files."""
    task: Literal["hot-stab", "hot-stab-removal"] = "hot-stab"
    """What it demonstrates: to insert the plug, or to take it out."""
    n: int = 5
    """How many."""
    seed: int = 0
    """Of the first one."""

    def run(self) -> int:
        """Do it."""
        from farhand.deploy.offline import make_samples

        return make_samples(self.out, self.task, self.n, self.seed)
