"""Text as spreadsheets, motion capture, ROS and SLAM tools write it: imported right, or refused with its line and a remedy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from farhand.common.errors import InvalidConfiguration, InvalidDemonstration
from tests.local_site.recordings.truth import MOTIVE, SAMPLES, VICON, assert_true, read, words


def lines(header: str, row: Callable[..., str], end: str = "\n") -> str:
    """A header and a line per sample, each made of its time, position and quaternion w, x, y, z."""
    return end.join([header, *(row(t, p, q) for t, p, q in SAMPLES), ""])


def plain(t, p, q) -> str:
    return f"{t},{p[0]},{p[1]},{p[2]},{q[1]},{q[2]},{q[3]},{q[0]}"


PLAIN = lines("t,x,y,z,qx,qy,qz,qw", plain)
POSITIONS_ONLY = (
    "units by options",
    "columns by name and by number",
    "one column named, one left out, the others as their headers say",
    "seconds and nanoseconds",
    "dates",
    "no times",
)
EPOCH_NS = 1_700_000_000_000_000_000

RIGHT: dict[str, tuple[str | bytes, dict[str, Any]]] = {
    "plain columns": (PLAIN, {}),
    "CRLF": (PLAIN.replace("\n", "\r\n"), {}),
    "old line ends": (PLAIN.replace("\n", "\r"), {}),
    "byte-order mark": (b"\xef\xbb\xbf" + PLAIN.encode(), {}),
    "UTF-16 of a spreadsheet": (PLAIN.replace(",", "\t").encode("utf-16"), {}),
    "semicolons and decimal commas": (PLAIN.replace(",", ";").replace(".", ","), {}),
    "an empty last column": (PLAIN.replace("\n", ",\n"), {}),
    "blank lines and blank cells": (PLAIN.replace("\n", "\n\n") + ",,,,,,,\n", {}),
    "units in the header": (
        lines(
            "time [ms];pos_x [mm];pos_y [cm];pos_z (m);rot_w;rot_x;rot_y;rot_z",
            lambda t, p, q: f"{1e3 * t};{1e3 * p[0]};{1e2 * p[1]};{p[2]};{q[0]};{q[1]};{q[2]};{q[3]}",
        ),
        {},
    ),
    "units by options": (
        lines("t,x,y,z", lambda t, p, q: f"{1e6 * t},{1e2 * p[0]},{1e2 * p[1]},{1e2 * p[2]}"),
        {"time_unit": "us", "length_unit": "cm"},
    ),
    "columns by name and by number": (
        lines("A,B,C,D,E", lambda t, p, q: f"{p[2]},{p[1]},{p[0]},{t},7"),
        {"columns": ("t=D", "x=3", "y=B", "z=1")},
    ),
    "one column named, one left out, the others as their headers say": (
        lines("t,Foo,x,y,z,yaw", lambda t, p, q: f"{t},{p[0]},9,{p[1]},{p[2]},1"),
        {"columns": ("x=Foo", "yaw=-")},
    ),
    "no header": (
        lines("", lambda t, p, q: f"{t} {p[0]} {p[1]} {p[2]} {q[1]} {q[2]} {q[3]} {q[0]}"),
        {"columns": ("t=1", "x=2", "y=3", "z=4", "qx=5", "qy=6", "qz=7", "qw=8")},
    ),
    "trajectory of a SLAM tool": (
        lines("# timestamp tx ty tz qx qy qz qw", lambda *sample: plain(*sample).replace(",", " ")),
        {},
    ),
    "quaternion by number, w first": (
        lines("t,x,y,z,q0,q1,q2,q3", lambda t, p, q: ",".join(map(str, (t, *p, *q)))),
        {"quaternion_order": "wxyz"},
    ),
    "quaternion by number, w last": (
        lines("t,x,y,z,quat[0],quat[1],quat[2],quat[3]", plain),
        {"quaternion_order": "xyzw"},
    ),
    "quaternions that change sign": (
        lines(
            "t,x,y,z,qw,qx,qy,qz",
            lambda t, p, q: ",".join(map(str, (t, *p, *(c * (-1) ** round(20 * t) for c in q)))),
        ),
        {},
    ),
    "roll, pitch, yaw in degrees": (
        lines("t,x,y,z,roll_deg,pitch_deg,yaw_deg", lambda t, p, q: f"{t},{p[0]},{p[1]},{p[2]},0,0,{200 * t}"),
        {},
    ),
    "rotation vector in radians": (
        lines("t,x,y,z,rx,ry,rz", lambda t, p, q: f"{t},{p[0]},{p[1]},{p[2]},0,0,{np.radians(200 * t)}"),
        {"rotation": "rotvec", "angle_unit": "rad"},
    ),
    "ROS 1 echo with nanoseconds": (
        lines(
            "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.pose.position.x,field.pose.position.y,"
            "field.pose.position.z,field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w",
            lambda t, p, q: f"{EPOCH_NS},4,{EPOCH_NS + round(1e9 * t)},world," + plain(t, p, q).partition(",")[2],
        ),
        {},
    ),
    "seconds and nanoseconds": (
        lines(
            "header.stamp.sec,header.stamp.nanosec,pose.position.x,pose.position.y,pose.position.z",
            lambda t, p, q: f"1700000000,{round(1e9 * t)},{p[0]},{p[1]},{p[2]}",
        ),
        {},
    ),
    "dates": (
        lines("timestamp,X,Y,Z", lambda t, p, q: f"2026-03-01 12:00:00.{round(1e6 * t):06d},{p[0]},{p[1]},{p[2]}"),
        {},
    ),
    "Motive": (MOTIVE, {}),
    "Vicon": (VICON, {"rate_hz": 20.0, "rotation": "xyz"}),
    "no times": (lines("x,y,z", lambda t, p, q: f"{p[0]},{p[1]},{p[2]}"), {"rate_hz": 20.0}),
}  # fmt: skip


@pytest.mark.parametrize("kind", RIGHT)
def test_it_is_imported_with_the_values_computed_by_hand(kind: str, tmp_path: Path):
    content, options = RIGHT[kind]
    file = tmp_path / "recording.csv"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    (understood,) = read(file, **options)
    assert_true(understood, oriented=kind not in POSITIONS_ONLY)


def changed(line: int, cell: int, value: str) -> str:
    rows = [row.split(",") for row in PLAIN.splitlines()]
    rows[line - 1][cell] = value
    return "\n".join(map(",".join, rows))


REFUSED: dict[str, tuple[str | bytes, dict[str, Any], str]] = {
    "text for a number": (changed(4, 2, "0.2x"), {}, r"line 4, column 'y': a number, got '0.2x': mend it"),
    "a short line": (PLAIN + "0.55,0.2\n", {}, r"line 13: 8 cells as in the other lines, got 2: mend or delete it"),
    "time that goes back": (changed(6, 0, "0.01"), {}, r"line 6: a later time than in line 5, .*: sort the lines"),
    "one time, two poses": (changed(6, 0, str(SAMPLES[3][0])), {}, r"line 6: another time than in line 5, .*: delete one"),
    "no rotation": (changed(7, 7, "5"), {}, r"line 7: a quaternion of length 1, got length 5.*--columns"),
    "infinity": (changed(3, 1, "inf"), {}, r"line 3: finite numbers, got inf: .*delete"),
    "a long gap": (
        "t,x,y\n" + "\n".join(f"{t},{t},0" for t in (0.0, 0.05, 0.1, 0.15, 0.9, 0.95, 1.0)),
        {},
        r"line 5: no gap .* for 0.75 s until line 6: cut",
    ),
    "nothing seen for long": (
        "t,x,y\n" + "\n".join(f"{0.02 * k},{'' if 5 <= k < 30 else k / 100},0" for k in range(60)),
        {},
        r"line 6: no gap .* until line 32: cut",
    ),
    "milliseconds": (
        "t,x,y\n" + "\n".join(f"{20 * k},{k / 100},0" for k in range(60)),
        {},
        r"time_s: .*milliseconds.*--time-unit",
    ),
    "millimetres": (
        "t,x,y\n" + "\n".join(f"{0.02 * k},{10 * k},0" for k in range(60)),
        {},
        r"position_m: .*millimetres.*--length-unit",
    ),
    "an open order": (PLAIN.replace("qx,qy,qz,qw", "q0,q1,q2,q3"), {}, r"header: the order of .*'q0'.*--quaternion-order"),
    "an open unit of angles": (
        PLAIN.replace("qx,qy,qz,qw", "roll,pitch,yaw,a"), {}, r"header: the unit of the angles .*--angle-unit",
    ),
    "an open rotation": (PLAIN.replace("qx,qy,qz,qw", "rx,ry,rz,a"), {"angle_unit": "rad"}, r"header: .*--rotation"),
    "half a quaternion": (PLAIN.replace("qz,qw", "a,b"), {}, r"header: all columns of an orientation, got only 'qx', 'qy'"),
    "no position": (PLAIN.replace("x,y,z,", "a,b,c,"), {}, r"header: columns with the position.*--columns x="),
    "no times": (PLAIN.replace("t,", "a,"), {}, r"header: a column of times.*--columns t=.*--rate-hz"),
    "two columns of one name": (PLAIN.replace("y,z", "x,z"), {}, r"header: one column for x, got 'x' and 'x': .*--columns x="),
    "two bodies": (
        "t,a_x,a_y,b_x,b_y\n0,1,2,3,4\n0.1,1,2,3,4\n", {}, r"one body that moves, got 'a', 'b': choose with --motion",
    ),
    "an unknown column": (PLAIN, {"columns": ("x=Pos",)}, r"--columns Pos: one column of that name.*'qw'"),
    "no numbers": ("hello\nworld\n", {}, r"lines of numbers in columns.*--kind"),
    "nothing": ("", {}, r"lines of numbers in columns"),
    "binary": (b"\x89PNG\r\n\x1a\n\0", {}, r"text, got a binary file: --kind"),
    "one sample": ("t,x,y\n0,1,2\n", {}, r"two or more poses"),
    "a frame that is not there": (PLAIN, {"frames": ("goal=socket",)}, r"--frames: goal=last.*got 'socket'"),
    "a frame of the plane": (PLAIN, {"frames": ("goal=0.5,0.5",)}, r"--frames: goal in 3 dimensions"),
}  # fmt: skip


@pytest.mark.parametrize("kind", REFUSED)
def test_it_is_refused_with_its_line_and_a_remedy(kind: str, tmp_path: Path):
    content, options, expected = REFUSED[kind]
    file = tmp_path / "recording.csv"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InvalidDemonstration, match=expected) as caught:
        read(file, **options)
    assert str(caught.value).startswith(f"{file}: ") and "\n" not in str(caught.value)


def test_several_recordings_of_one_file_are_told_apart_and_chosen(tmp_path: Path):
    file = tmp_path / "two.csv"
    rows = [f"{n},{t},{p[0] + n},{p[1]}" for n in (3, 7) for t, p, _ in SAMPLES]
    file.write_text("\n".join(["episode,t,x,y", *rows]))
    first, second = read(file)
    assert (first.number, second.number) == (3, 7)
    apart_m = second.demonstration.position_m - first.demonstration.position_m
    np.testing.assert_allclose(apart_m, [[4.0, 0.0]] * len(SAMPLES))
    rows[14] = rows[14].replace("0.2", "oops")
    file.write_text("\n".join(["episode,t,x,y", *rows]))
    with pytest.raises(InvalidDemonstration, match=r"recording 7, line 16, column 'y': .*--only leaves"):
        read(file)
    assert [found.number for found in read(file, only=(3,))] == [3]
    with pytest.raises(InvalidDemonstration, match=r"--only: numbers of its recordings \(3, 7\), got \[4\]"):
        read(file, only=(4,))


def test_blank_and_repeated_rows_are_left_out_and_told(tmp_path: Path):
    file = tmp_path / "captured.csv"
    rows = [f"{0.01 * k:.2f},{'' if k in (4, 5) else k / 100},0.5" for k in range(20)]
    file.write_text("\n".join(["t,x,y", *rows[:10], rows[9], *rows[10:]]))
    (understood,) = read(file)
    np.testing.assert_allclose(
        understood.demonstration.position_m[:, 0], [k / 100 for k in range(20) if k not in (4, 5)]
    )
    assert (
        words(understood, "mended")
        == "2 lines without all numbers left out, from line 6; 1 repeated lines left out, from line 12"
    )


OPTIONS = {
    "--columns": {"columns": ("width=3",)}, "--frames": {"frames": ("goal",)}, "--tool": {"tool": (1.0, 2.0)},
    "--rate-hz": {"rate_hz": 0.0}, "--rotation": {"rotation": "xyx"},
}  # fmt: skip


@pytest.mark.parametrize("name", ["../goal", "a b", "<b>", "a\nb", "goal\u202e", "x" * 40])
def test_a_task_frame_with_a_name_that_no_task_could_have_is_refused(name: str, tmp_path: Path):
    with pytest.raises(InvalidConfiguration, match="command line: --frames: a name of letters") as caught:
        read(tmp_path / "none.csv", frames=(f"{name}=last",))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("option", OPTIONS)
def test_an_option_that_fits_no_recording_is_refused_by_name(option: str, tmp_path: Path):
    with pytest.raises(InvalidConfiguration, match=f"command line: {option}: "):
        read(tmp_path / "none.csv", **OPTIONS[option])
