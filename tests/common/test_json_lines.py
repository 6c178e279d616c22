from __future__ import annotations

import json
import logging
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from farhand.common.json_lines import JsonLinesFile


def kept(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_bytes().splitlines()]


def test_each_event_is_a_line_with_the_wall_time_beside_it(tmp_path: Path):
    log = JsonLinesFile(tmp_path / "deep" / "events.jsonl")
    before = datetime.now(UTC).replace(microsecond=0)
    log.append(kind="control", who="ann", measured=1.5)
    log.append(kind="control", who="bob\n", measured=None)
    log.close()
    first, second = kept(log.path)
    assert (first["who"], first["measured"], second["who"]) == ("ann", 1.5, "bob\n")
    assert before <= datetime.fromisoformat(first["time"]) <= datetime.now(UTC)


def test_a_later_process_goes_on_in_the_same_file(tmp_path: Path):
    for n in range(3):
        log = JsonLinesFile(tmp_path / "events.jsonl")
        log.append(n=n)
        log.close()
    assert [row["n"] for row in kept(tmp_path / "events.jsonl")] == [0, 1, 2]


def test_a_full_log_is_begun_anew_and_the_one_before_is_kept(tmp_path: Path):
    log = JsonLinesFile(tmp_path / "events.jsonl", max_bytes=2000)
    for n in range(100):
        log.append(n=n)
    log.close()
    older, newer = kept(tmp_path / "events.jsonl.1"), kept(log.path)
    numbers = [row["n"] for row in older + newer]
    assert numbers == list(range(numbers[0], 100)) and len(older) > 20
    assert log.path.stat().st_size <= 2000


def test_a_line_that_a_crash_cut_short_spoils_no_other(tmp_path: Path):
    path = tmp_path / "events.jsonl"
    path.write_bytes(b'{"n":0}\n{"n":1,"te')
    log = JsonLinesFile(path)
    log.append(n=2)
    log.append(n=3)
    log.close()
    lines = path.read_bytes().splitlines()
    assert [json.loads(line)["n"] for line in (lines[0], *lines[2:])] == [0, 2, 3]


def test_one_odd_value_does_not_end_the_log(tmp_path: Path):
    log = JsonLinesFile(tmp_path / "events.jsonl")
    log.append(measured=np.float64(1.5), path=tmp_path)
    log.append(measured=float("nan"))
    log.close()
    assert [row["measured"] for row in kept(log.path)] == ["1.5", None]


def test_a_disk_that_is_gone_stops_the_log_and_nothing_else(tmp_path: Path, caplog, monkeypatch):
    monkeypatch.setattr(logging.getLogger("farhand.common.json_lines"), "filters", [])
    (tmp_path / "file").write_text("")
    log = JsonLinesFile(tmp_path / "file" / "events.jsonl")
    log.append(n=1)
    log.close()
    assert "could not write an event" in caplog.text
