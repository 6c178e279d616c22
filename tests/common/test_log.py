from __future__ import annotations

import logging
from collections.abc import Iterator

import pytest

from farhand.common.log import RateLimitFilter, configure_logging, loop_logger


@pytest.fixture
def root_logger() -> Iterator[logging.Logger]:
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    yield root
    root.handlers[:], root.level = handlers, level


def records(filter_: RateLimitFilter, lines: list[int]) -> list[logging.LogRecord]:
    made = [
        logging.LogRecord("x", logging.WARNING, "file.py", line, "late by %d ms", (n,), None)
        for n, line in enumerate(lines)
    ]
    return [record for record in made if filter_.filter(record)]


def test_one_place_speaks_once_a_period():
    assert [r.lineno for r in records(RateLimitFilter(3600.0), [1, 1, 2, 1, 2])] == [1, 2]


def test_silence_is_counted_and_said():
    limited = RateLimitFilter(3600.0)
    records(limited, [1] * 5)
    limited._period_s = 0.0
    (record,) = records(limited, [1])
    assert record.getMessage() == "late by 0 ms (and 4 more like it)"


def test_a_loop_logger_is_limited_once_however_often_it_is_asked_for():
    assert loop_logger("tests.loop") is loop_logger("tests.loop")
    assert [type(f) for f in loop_logger("tests.loop").filters] == [RateLimitFilter]


def test_each_line_names_its_process(root_logger, capsys):
    configure_logging("remote")
    logging.getLogger("anything").info("ready")
    assert "INFO    remote: ready" in capsys.readouterr().err


def test_what_libraries_tell_about_themselves_is_shown_on_request_only(root_logger, capsys):
    configure_logging("remote")
    logging.getLogger("absl").info("hidden")
    logging.getLogger("absl").warning("a warning")
    configure_logging("remote", verbose=True)
    logging.getLogger("absl").info("shown")
    assert "hidden" not in (err := capsys.readouterr().err) and "a warning" in err and "shown" in err


def test_debug_records_are_shown_on_request_only(root_logger, capsys):
    configure_logging("remote")
    logging.getLogger("anything").debug("hidden")
    configure_logging("remote", verbose=True)
    logging.getLogger("anything").debug("shown")
    assert "hidden" not in (err := capsys.readouterr().err) and "shown" in err
