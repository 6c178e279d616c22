"""`farhand learn`, `rollout`, `model`, `import`, `samples`, `evaluate`: work on files, without robot or link."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from farhand.common.errors import InvalidConfiguration
from farhand.common.model.gaussian_product import frame_shares, idle_frames
from farhand.common.model.model_file import content_hash, encode, load, part_sizes, save
from farhand.common.model.tphsmm import TPHSMM
from farhand.local_site.recordings.options import ImportOptions

_MOST_SAMPLES = 1000


def learn(demonstrations: Sequence[Path], out: Path, max_distance_m: float | None) -> int:
    """Learn a model file from demonstration files."""
    from farhand.local_site.learning.online_learner import LearnerSettings
    from farhand.local_site.teaching.offline_learning import learn_files

    if not demonstrations:
        raise InvalidConfiguration("command line", "demonstrations", "at least one demonstration file")
    settings = LearnerSettings(max_distance_m) if max_distance_m is not None else None
    model = learn_files(demonstrations, settings)
    save(model, out)
    _say(f"learned {_components(model)} from {len(demonstrations)} demonstrations: {out}")
    return 0


def rollout(model_file: Path, like: Path, out: Path | None) -> int:
    """Reproduce a model from a demonstration's start in its frames.

    Returns:
        0, or 1 for a motion that was given up before its end.
    """
    from farhand.deploy.rollout import reproduce
    from farhand.local_site.teaching.demonstration import Demonstration

    model, demonstration = load(model_file), Demonstration.load(like)
    motion, arrived = reproduce(model, demonstration)
    ends_apart_m = float(np.linalg.norm(motion.position_m[-1] - demonstration.position_m[-1]))
    moved = f"{motion.time_s[-1]:.2f} s, {ends_apart_m * 1e3:.2f} mm from the demonstration's end"
    _say(f"moved for {moved}" if arrived else f"gave up before the model's end: moved for {moved}")
    if out is not None:
        motion.save(out)
        _say(f"written: {out}")
    return 0 if arrived else 1


def show(model_file: Path, figure: Path | None) -> int:
    """Say what is in a model file; its components count from one, as on the page."""
    model = load(model_file)
    content = encode(model)
    _say(
        f"{model_file}: {_components(model)}, {model.n_dims} dimensions, frames {', '.join(model.frame_names)}"
    )
    _say(f"  learned from  {model.n_demonstrations} demonstrations, lambda {model.max_distance_m:g} m")
    _say(f"  paths         {model.n_paths}")
    for number, way in enumerate(model.ways, start=1):
        n = way.n_demonstrations
        told = f"{n} demonstration{'s' * (n != 1)}, {way.duration_s:.2f} s"
        _say(f"  way {number:<9d} {told}, ends in component {way.terminal + 1}")
    sizes = part_sizes(content)
    _say(f"  size          {len(content)} B: {', '.join(f'{name} {n}' for name, n in sizes.items())}")
    _say(
        f"  beyond paper  {sizes['extensions']} B, {100 * sizes['extensions'] / len(content):.0f} %, and the ways"
    )
    _say(f"  sha256        {content_hash(content)}")
    _say("  component  points  duration_s        leads to")
    for i in range(model.n_components):
        deviation_s = float(np.sqrt(model.duration_variance_s2[i]))
        duration = "end" if model.terminal[i] else f"{model.duration_mean_s[i]:.2f} +- {deviation_s:.2f}"
        targets = [f"{k + 1} ({model.transition[i, k]:.2f})" for k in np.flatnonzero(model.transition[i])]
        begins = " begins here" if model.initial[i] > 0 else ""
        _say(f"  {i + 1:9d}  {model.counts[i]:6d}  {duration:16s}  {', '.join(targets) or '-'}{begins}")
    if model.n_frames > 1:
        _say_relevance(model)
    if figure is not None:
        from farhand.evaluation.paper.model_figure import draw_model

        draw_model(model, figure)
        _say(f"written: {figure}")
    return 0


def _say_relevance(model: TPHSMM) -> None:
    """Say which share each frame has in each component, and which frame says nothing."""
    shares = frame_shares(model.residual_covariances)
    _say("  component  " + "  ".join(f"{name:>12s}" for name in model.frame_names))
    for i in range(model.n_components):
        _say(f"  {i + 1:9d}  " + "  ".join(f"{100 * share:10.0f} %" for share in shares[:, i]))
    means = shares @ model.counts / model.counts.sum()
    _say("  the motion " + "  ".join(f"{100 * share:10.0f} %" for share in means))
    for j in idle_frames(shares, model.counts):
        name, share = model.frame_names[j], f"{100 * means[j]:.0f} % of the motion"
        _say(f"  frame {name} has {share} and no component of its own: drop it, it says nothing of this task")


def import_recordings(files: Sequence[Path], out: Path | None, preview: bool, options: ImportOptions) -> int:
    """Say how foreign recordings are understood, and make demonstration files of them."""
    from farhand.local_site.recordings.importing import understand, write_all

    if not files:
        raise InvalidConfiguration("command line", "files", "at least one recording")
    if out is None and not preview:
        raise InvalidConfiguration(
            "command line", "--out", "a folder for the demonstrations, or --preview to look first"
        )
    found = [understand(file, options) for file in files]
    for file, recordings in zip(files, found, strict=True):
        _say(f"{file}")
        told_before: tuple[tuple[str, str], ...] = ()
        for recording in recordings:
            _say(f"  recording {recording.number}")
            for subject, words in recording.told:
                if (subject, words) not in told_before:
                    _say(f"    {subject:12s}  {words}")
            told_before = recording.told
    if out is None or preview:
        _say("nothing is written: --out FOLDER, without --preview, writes the demonstrations")
        return 0
    written = write_all(files, found, out)
    _say(f"{len(written)} demonstrations: {written[0]} to {written[-1].name}")
    return 0


def make_samples(out: Path, task: str, n: int, seed: int, own_arm: str = "") -> int:
    """Have the scripted operator demonstrate."""
    from farhand.deploy.places import find_cell, find_task
    from farhand.local_site.workcell.operator_arm import demonstrations

    if not 1 <= n <= _MOST_SAMPLES or seed < 0:
        expected = f"1 to {_MOST_SAMPLES}, and zero or more, got {n}, {seed}"
        raise InvalidConfiguration("command line", "n, seed", expected)
    cell = find_cell(find_task(task), own_arm)
    assert cell is not None, "the tasks of DEMONSTRATIONS are an arm's"
    out.mkdir(parents=True, exist_ok=True)
    shown = demonstrations(task, n, seed, cell, lambda reason: _say(f"left out: {reason}"))
    for number, each in enumerate(shown):
        file = out / f"{task}-{number}.npz"
        each.save(file)
        _say(f"written: {file}")
    return 0


def evaluate(
    study: str,
    trials: int | None,
    seed: int,
    out: Path,
    robot: str = "",
    own_arm: str = "",
    only: str | None = None,
) -> int:
    """Run a study; of the arm, on a robot, with what is taught on the operator's arm."""
    from farhand.evaluation.study import run

    command = " ".join(["farhand", *sys.argv[1:]])
    result = run(study, trials, seed, out, command, robot, own_arm, only)
    _say(f"written: {result.with_suffix('.md')}, with its figures and {result.name} beside it")
    return 0


def _components(model: TPHSMM) -> str:
    n_terminal = int(model.terminal.sum())
    return f"{model.n_components - n_terminal} components and {n_terminal} terminal"


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
