"""Import of recordings: files of other programs become demonstrations, with a report of their interpretation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration
from farhand.common.whole_file import fault_of
from farhand.local_site.recordings.columns import Roles, Table, assign
from farhand.local_site.recordings.formats import ReadRecording, read_file
from farhand.local_site.recordings.frames import FrameTrack, frame_of, in_root, with_tool
from farhand.local_site.recordings.options import FrameChoice, ImportOptions
from farhand.local_site.recordings.tracks import Track, check_gaps, track_of
from farhand.local_site.teaching.demonstration import Demonstration
from farhand.local_site.teaching.plausibility import check_scale, check_units

Array = NDArray[np.float64]


class Understood(NamedTuple):
    """Interpreted recording.

    Args:
        number: Number of the recording in its file.
        demonstration: The demonstration.
        told: Interpretation in words, by subject: time, position, repairs, ...
    """

    number: int
    demonstration: Demonstration
    told: tuple[tuple[str, str], ...]


def understand(file: Path | str, options: ImportOptions) -> list[Understood]:
    """Read the recordings of one file or folder.

    Args:
        file: CSV, a rosbag2 or MCAP, a LeRobot data set, an HDF5 of robomimic, or a file of a research set.
        options: Choices of the user that the recording lacks.

    Raises:
        InvalidDemonstration: Naming the file, the row and what to do, when one of its recordings is at fault.
        InvalidConfiguration: Naming an option that fits no recording.
    """
    options.check()
    path = Path(file)
    recordings = read_file(path, options)
    found = list[Understood]()
    with fault_of(path, InvalidDemonstration, "a recording"):
        for recording in recordings:
            try:
                found.append(_understood(f"{path.name} {recording.number}", recording, options))
            except InvalidDemonstration as error:
                which = f"recording {recording.number}" if len(recordings) > 1 else ""
                field = ", ".join(part for part in (which, error.field) if part)
                leave_out = "; --only leaves recordings out" if which else ""
                raise InvalidDemonstration("", field, error.expected + leave_out) from None
    return found


def read_demonstrations(file: Path | str, options: ImportOptions) -> list[Demonstration]:
    """Return the demonstrations in one file; errors as `understand`."""
    return [understood.demonstration for understood in understand(file, options)]


def write_all(files: Sequence[Path], found: Sequence[Sequence[Understood]], out_dir: Path) -> list[Path]:
    """Write the demonstrations of each file as ``STEM_NUMBER.npz`` into a folder, which is created if missing.

    Raises:
        InvalidDemonstration: When two files have one name; nothing was written.
    """
    paths: dict[Path, Demonstration] = {}
    for file, recordings in zip(files, found, strict=True):
        for recording in recordings:
            path = out_dir / f"{file.stem or file.resolve().stem}_{recording.number:02d}.npz"
            if path in paths:
                raise InvalidDemonstration(
                    str(file), "", "a name of its own: another file has the same; import it elsewhere"
                )
            paths[path] = recording.demonstration
    out_dir.mkdir(parents=True, exist_ok=True)
    for path, demonstration in paths.items():
        demonstration.save(path)
    return list(paths)


def _understood(source: str, recording: ReadRecording, options: ImportOptions) -> Understood:
    bodies = {
        body: (table, roles)
        for table in recording.tables
        for roles in [assign(table, options)]
        for body in roles.bodies
    }
    name = _motion(recording, bodies, options)
    choices = options.chosen_frames()
    wanted = [name, *(choice.source for choice in choices if choice.source in bodies)]
    tracks = _tracks(bodies, wanted, options)
    motion = with_tool(in_root(name, tracks), options.tool)
    if len(motion.time_s) < 2:
        raise _invalid("", f"two or more poses of {name or 'the motion'}, got one")
    check_gaps(motion)
    frames = [frame_of(choice, motion, tracks) for choice in choices]
    made = _demonstration(motion, frames, choices, source)
    table = bodies[name][0]
    told = [("text", table.told)] if table.told else []
    told += [
        ("motion", f"{name or 'the only body'}{f', in {motion.parent}' if motion.parent else ''}"),
        *motion.told,
    ]
    told += [(f"frame {choice.name}", words) for choice, (_, _, words) in zip(choices, frames, strict=True)]
    ignored = [*bodies[name][1].ignored, *(f"body {other}" for other in bodies if other not in wanted)]
    if ignored:
        told.append(("not used", ", ".join(ignored[:12]) + (", ..." if len(ignored) > 12 else "")))
    told.append(("extent", _extent(made)))
    try:
        check_units(made)
    except InvalidDemonstration as error:
        told.append(("not learned", error.expected))
    return Understood(recording.number, made, tuple(told))


def _motion(recording: ReadRecording, bodies: dict[str, tuple[Table, Roles]], options: ImportOptions) -> str:
    """Return the name of the body whose motion is demonstrated."""
    if not bodies:
        headers = [header for table in recording.tables for header in table.headers]
        named = ", ".join(map(repr, headers[:24])) + (", ..." if len(headers) > 24 else "")
        expected = f"columns with the position of a body, got {named}: name them, --columns x=... y=... z=..., by name or number"
        raise _invalid("header", expected)
    names = ", ".join(repr(name) for name in bodies)
    if options.motion is not None:
        if options.motion not in bodies:
            raise _invalid("--motion", f"one of {names}, got {options.motion!r}")
        return options.motion
    frames = {choice.source for choice in options.chosen_frames() if choice.source}
    left = [name for name in bodies if name not in frames]
    if "" in left:
        return ""
    if len(left) != 1:
        raise _invalid(
            "",
            f"one body that moves, got {names}: choose with --motion NAME, and task frames with --frames FRAME=NAME",
        )
    return left[0]


def _tracks(
    bodies: dict[str, tuple[Table, Roles]], wanted: Sequence[str], options: ImportOptions
) -> dict[str, Track]:
    """Return the tracks of the wanted bodies and of all their parent frames."""
    tracks: dict[str, Track] = {}
    for name in wanted:
        while name in bodies and name not in tracks:
            tracks[name] = track_of(*bodies[name], name, options)
            name = tracks[name].parent
    return tracks


def _demonstration(
    motion: Track, frames: list[FrameTrack], choices: Sequence[FrameChoice], source: str
) -> Demonstration:
    T, D = motion.position_m.shape
    moving = any(len(origin) > 1 or len(A) > 1 for origin, A, _ in frames)
    n = T if moving else 1
    origin = np.stack([np.broadcast_to(origin, (n, D)) for origin, _, _ in frames], axis=1)
    rotation = np.stack([np.broadcast_to(A, (n, D, D)) for _, A, _ in frames], axis=1)
    made = Demonstration(
        time_s=motion.time_s - motion.time_s[0],
        position_m=motion.position_m,
        frame_origin_m=origin if moving else origin[0],
        frame_rotation=rotation if moving else rotation[0],
        frame_names=tuple(choice.name for choice in choices),
        quat_wxyz=motion.quat_wxyz if D == 3 else None,
        source=source,
    )
    try:
        check_scale(made)
    except InvalidDemonstration as error:
        option = "--time-unit" if error.field == "time_s" else "--length-unit"
        raise _invalid(error.field, f"{error.expected}; {option} says which it is") from None
    return made


def _extent(made: Demonstration) -> str:
    size = " x ".join(f"{edge:.3f}" for edge in np.ptp(made.position_m, axis=0))
    turns = ", with orientations" if made.space.oriented else ""
    rate_hz = (len(made.time_s) - 1) / made.time_s[-1]
    return f"{len(made.time_s)} samples, {made.time_s[-1]:.2f} s at {rate_hz:.0f} Hz, {size} m{turns}"


def _invalid(field: str, expected: str) -> InvalidDemonstration:
    return InvalidDemonstration("recording", field, expected)
