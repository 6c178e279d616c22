"""What the robot's side tells of those it refuses, in our words: from lines of the transport, and by counts."""

from __future__ import annotations

import subprocess
import sys

import pytest

from farhand.common.link.refusals import Refusals

HEAD = "2026-11-30T13:46:52.42Z  WARN acc-0 ThreadId(05) "
TLS, QUIC = (
    f"{HEAD}zenoh_link_tls::unicast: ",
    f"{HEAD}zenoh_link_commons::quic::unicast: QUIC acceptor failed: ",
)


class Told:
    """Refusals on a clock that is set, with all that was told."""

    def __init__(self) -> None:
        self.now_s, self.words = 100.0, list[str]()
        self.refusals = Refusals(self.words.append, lambda: self.now_s)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (f"{TLS}invalid peer certificate: certificate expired: verification time 1796046412", "has expired"),
        (f"{QUIC}TransportError(... certificate not valid yet: verification time 1)", "not valid yet"),
        (
            f'{QUIC}TransportError(... reason: "invalid peer certificate: BadSignature" }})',
            "another authority",
        ),
        (f"{TLS}invalid peer certificate: UnknownIssuer.", "another authority"),
        (f"{TLS}peer sent no certificates. Hint: increase the system open file limit.", "no certificate"),
        (f"{TLS}received corrupt message of type InvalidContentType.", "does not speak TLS"),
        (f"{TLS}received fatal alert: DecryptError.", "does not accept this certificate"),
        (
            f"{QUIC}ConnectionClosed(ConnectionClose {{ error_code: Code::crypto(2a) }})",
            "does not accept this",
        ),
        (f"{TLS}invalid peer certificate: something new", "not accepted"),
    ],
)
def test_a_line_of_the_transport_is_told_by_its_reason(line: str, words: str):
    told = Told()
    assert told.refusals.transport_said(line)
    (said,) = told.words
    assert words in said


def test_other_lines_of_the_transport_are_no_refusals():
    told = Told()
    assert not told.refusals.transport_said(f"{HEAD}Scouting delay elapsed before start conditions are met.")
    assert told.words == []


def test_one_reason_is_told_once_in_ten_seconds_with_the_number_of_those_left_out():
    told = Told()
    for _ in range(50):
        told.refusals.add("a site was refused")
        told.refusals.add("another one was refused")
    assert told.words == ["a site was refused", "another one was refused"]
    told.now_s += 11.0
    told.refusals.add("a site was refused")
    assert told.words[2:] == ["a site was refused (49 more like it)"]


def test_a_flood_is_told_by_its_site_and_single_messages_are_not():
    told = Told()
    for _ in range(1000):  # ten a second
        told.refusals.unwanted("shore-1")
        told.now_s += 0.1
    assert told.words == []
    for _ in range(1000):
        told.refusals.unwanted("shore-2")
        told.now_s += 0.001
    assert told.words == ["shore-2 sends too fast, or what is not understood: it is read more slowly"]


def test_what_a_driver_prints_is_printed_and_the_transport_s_own_lines_are_not():
    script = (
        "import os, sys; from farhand.common.link.refusals import transport_refusals\n"
        "with transport_refusals(lambda words: sys.stderr.write(words)):\n"
        "    print('a driver says this', flush=True)\n"
        "    os.write(1, b'2026-11-30T13:46:52.4Z  WARN x: peer sent no certificates.\\n')\n"
        "print('and this', flush=True)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60.0
    )
    assert done.stdout.splitlines() == ["a driver says this", "and this"]
    assert done.stderr == "a site was refused: it shows no certificate"
