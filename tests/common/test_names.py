"""Names that become paths, keys of the link or parts of pages: one pattern, said when it is broken."""

from __future__ import annotations

import getpass
import socket
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farhand.common.errors import InvalidConfiguration, InvalidMessage
from farhand.common.link.access import AccessWatch
from farhand.common.link.endpoint import EndpointSettings
from farhand.common.names import (
    MOST_SITE_NAME,
    RULE,
    Name,
    SiteName,
    check_name,
    default_site_name,
    user_path,
)
from farhand.common.task import PointTask
from farhand.common.wire.codec import decode, encode
from farhand.common.wire.messages import LeaseRequest, Stop
from farhand.deploy.pki.commands import Revoke
from farhand.deploy.places import data_folder, find_task

BAD = [
    "", ".", "..", "../../evil", "a/b", "a\\b", "a b", "a\nb", "a\n", "a\u2028b", "-a", ".hidden", "a\0b", "<b>a</b>", "rov*",
    "rov1/**", "$a", "a#b", "a?b", "\u00e4", "\u202eevil", "~", "CON:", "a,b", "x" * 200,
]  # fmt: skip
GOOD = ["operator", "a", "Ann-2", "rov_1", "v1.2", "0"]
USUAL = Path("/home/someone/farhand")


@pytest.mark.parametrize("name", BAD)
def test_what_breaks_the_rule_is_refused_everywhere_with_the_rule(name):
    with pytest.raises(InvalidConfiguration, match=f"site: {RULE}"):
        check_name(name, "site")
    for kind in (SiteName, Name):
        with pytest.raises(msgspec.ValidationError):
            msgspec.convert(name, kind)
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert({"vehicle": name}, EndpointSettings)
    for message in (Stop(stop_id="x", site_name=name), LeaseRequest(session="x", site_name=name)):
        with pytest.raises(InvalidMessage, match="site_name"):
            decode(encode(message), type(message))
    with pytest.raises(InvalidConfiguration):
        find_task(name)


@pytest.mark.parametrize("name", GOOD)
def test_what_keeps_the_rule_is_taken_everywhere(name):
    assert check_name(name, "site") == name
    assert msgspec.convert(name, SiteName) == name
    assert msgspec.convert({"vehicle": name}, EndpointSettings).vehicle == name
    stop = Stop(stop_id="x", site_name=name)
    assert decode(encode(stop), Stop) == stop


@pytest.mark.parametrize("name", ["../evil", "a\n", "<i>"])
def test_a_task_and_its_frames_have_names_of_the_same_rule(name):
    task = {
        "robot": "point", "name": "a", "frame_names": ["goal"], "n_dims": 2, "workspace_m": [1, 1], "start_m": [0, 0],
        "target": {"origin_m": [0, 0], "amplitude_m": [0, 0]},
    }  # fmt: skip
    assert msgspec.convert(task, PointTask).name == "a"
    for wrong in ({"name": name}, {"frame_names": [name]}):
        with pytest.raises(msgspec.ValidationError):
            msgspec.convert(task | wrong, PointTask)


@pytest.mark.parametrize("field", ["certificates", "sites", "data_dir", "folder"])
@pytest.mark.parametrize("text", ["~nobody-of-this-name/x", "~nobody-of-this-name", "~\udcff/x"])
def test_a_home_that_nobody_has_is_refused_by_the_field_that_names_it(field: str, text: str):
    asked: dict[str, Callable[[], object]] = {
        "certificates": lambda: EndpointSettings(certificates=text).certificate_folder,
        "sites": lambda: AccessWatch(Path(), text, lambda: None),
        "data_dir": lambda: data_folder(text),
        "folder": lambda: Revoke(name="rov1", folder=text).run(),
    }
    with pytest.raises(InvalidConfiguration, match="a path from a home that exists, got") as refused:
        asked[field]()
    assert refused.value.field == field and "\n" not in str(refused.value)


def test_the_own_home_is_found(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("HOME", "/home/ann")
    assert user_path("~/pki", "folder") == Path("/home/ann/pki")
    assert user_path("pki/~x", "folder") == Path("pki/~x")


def site_name(monkeypatch: pytest.MonkeyPatch, user: str, host: str, folder: Path = USUAL) -> str:
    monkeypatch.setattr(getpass, "getuser", lambda: user)
    monkeypatch.setattr(socket, "gethostname", lambda: host)
    return default_site_name(folder, USUAL)


def test_a_site_that_nobody_named_has_the_name_of_its_user_and_host(monkeypatch):
    assert site_name(monkeypatch, "ann", "bridge") == "ann-bridge"


def test_operators_who_leave_the_name_alone_differ_by_user_host_or_folder(monkeypatch):
    """Also where names are long, or where a hyphen moves from one to the other."""
    people = [
        ("ann", "bridge", USUAL), ("bob", "bridge", USUAL), ("ann", "shore", USUAL), ("ann", "bridge", Path("/tmp/other")),
        ("ann", "bridge.ship", USUAL), ("ann-bridge", "a", USUAL), ("ann", "bridge-a", USUAL), ("", "ann-bridge", USUAL),
        ("x" * 40, "one", USUAL), ("x" * 40, "two", USUAL), ("\u5c71\u7530", "\u6a4b", USUAL), ("\u5c71\u672c", "\u6a4b", USUAL),
    ]  # fmt: skip
    names = [site_name(monkeypatch, *person) for person in people]
    assert len(set(names)) == len(names), names


@given(st.text(max_size=30), st.text(max_size=30), st.text(max_size=10))
def test_a_default_name_is_always_a_name_and_the_same_after_a_restart(user: str, host: str, folder: str):
    with pytest.MonkeyPatch.context() as patch:
        place = USUAL / folder.replace("\0", "").replace("\ud800", "") if folder.isprintable() else USUAL
        once, again = (site_name(patch, user, host, place) for _ in range(2))
    assert once == again == check_name(once, "site", most=MOST_SITE_NAME)


def test_a_user_whom_the_system_does_not_know_has_a_name_all_the_same(monkeypatch):
    def unknown() -> str:
        raise KeyError("getpwuid(): uid not found")

    monkeypatch.setattr(getpass, "getuser", unknown)
    monkeypatch.setattr(socket, "gethostname", lambda: "box")
    assert check_name(default_site_name(USUAL, USUAL), "site", most=MOST_SITE_NAME).startswith("uid")
