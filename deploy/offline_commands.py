"""Commands that work on files alone: recordings, models, studies. The help texts here are documentation."""

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
    """Lambda of the learning [m]; a quarter of the demonstrations' extent when not given. The page uses the task's value,
    0.1 for the hot-stab."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        from farhand.deploy.offline import learn

        return learn(self.demonstrations, self.out, self.max_distance_m)


@dataclass(frozen=True)
class RolloutCommand:
    """Reproduce a model on the point plant, from the start of a demonstration and in its frames."""

    model: File
    """A model file."""
    like: Path
    """Demonstration file with the start and the frames."""
    out: Path | None = None
    """Demonstration file to write the motion to."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        from farhand.deploy.offline import rollout

        return rollout(self.model, self.like, self.out)


@dataclass(frozen=True)
class Model:
    """Show the content of a model file: components, durations, transitions, size, hash."""

    do: Annotated[Literal["show"], tyro.conf.Positional]
    """Action; show is the only one."""
    model: File
    """A model file."""
    figure: Path | None = None
    """Image file for the paper's Fig. 3 of this model (.png, .pdf, .svg)."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        from farhand.deploy.offline import show

        return show(self.model, self.figure)


@dataclass(frozen=True)
class Evaluate:
    """Run a study of the evaluation, and write its page, its figures and its JSON."""

    study: Annotated[str, tyro.conf.Positional]
    """Name of the study: docs/results/README.md lists all, with their durations; an unknown name lists the names."""
    trials: int | None = None
    """Number of trials; the study's own number when not given."""
    seed: int = 0
    """Seed of the first trial; reporting and tuning never share one."""
    out: Path = Path("results")
    """Folder for the results; those of another robot or own arm are in a folder of its name there."""
    only: str | None = None
    """Only the trials of this task, neighbour, profile or whatever else the study tells apart; an unknown word lists them."""
    robot: str = ""
    """Robot of a study of the arm: name of one that comes with Farhand, or a robot file; jaco when not given."""
    own_arm: str = ""
    """Arm on which the scripted operator teaches for such a study; the demonstrations that come along when not given."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        from farhand.deploy.offline import evaluate

        return evaluate(self.study, self.trials, self.seed, self.out, self.robot, self.own_arm, self.only)


@dataclass(frozen=True)
class Import(ImportOptions):
    """Turn recordings of other programs into demonstration files, and report the interpretation of each.

    CSV and other text, rosbag2 and MCAP, data sets of LeRobot and robomimic, and the research sets.
    """

    files: Files
    """Recordings: files, or the folder of a bag or a data set."""
    out: Path | None = None
    """Folder for the demonstration files."""
    preview: bool = False
    """Only report the interpretation of the recordings; write nothing."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        from farhand.deploy.offline import import_recordings

        return import_recordings(self.files, self.out, self.preview, self)


@dataclass(frozen=True)
class SamplesCommand:
    """Have the scripted operator demonstrate on its simulated arm, and write files like the samples of Farhand."""

    out: Path
    """Folder for the demonstration files."""
    task: Literal["hot-stab", "hot-stab-removal"] = "hot-stab"
    """Task of the demonstrations: to insert the plug, or to take it out."""
    n: int = 5
    """Number of demonstrations."""
    seed: int = 0
    """Seed of the first demonstration; each further one adds 1."""
    own_arm: str = ""
    """Arm on which to demonstrate: name of one that comes with Farhand, or a robot file; jaco when not given."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        from farhand.deploy.offline import make_samples

        return make_samples(self.out, self.task, self.n, self.seed, self.own_arm)


@dataclass(frozen=True)
class RobotCommand:
    """Check a robot file against its model and its workplace, search a base and a rest posture for it, or draw it."""

    do: Annotated[Literal["check", "place", "show"], tyro.conf.Positional]
    """check: masses, ranges, reach and size of the looks; place: candidates of base and rest posture, the best is printed;
    show: a picture of the robot at rest before its receptacle (needs EGL or OSMesa)."""
    robot: Annotated[str, tyro.conf.Positional]
    """Name of a robot that comes with Farhand, or a robot file."""
    candidates: int = 300
    """With place: number of candidates; each takes up to a second."""
    seed: int = 0
    """With place: seed of the candidates."""
    out: Path = Path("robot.png")
    """With show: the picture to write."""

    def run(self) -> int:
        """Run the command and return its exit status."""
        from farhand.deploy.robots_report import check, place, show

        if self.do == "check":
            return check(self.robot)
        return (
            show(self.robot, self.out) if self.do == "show" else place(self.robot, self.candidates, self.seed)
        )
