"""The authority's files against an independent oracle, the `openssl` command: chains, purposes, dates, names, keys."""

from __future__ import annotations

import errno
import itertools
import os
import shutil
import stat
import subprocess
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farhand.common.errors import InvalidConfiguration
from farhand.common.link.certificates import SiteCertificate
from farhand.common.whole_file import Claim, FolderInUse
from farhand.deploy.pki.issue import parse_hosts
from farhand.deploy.pki.registry import Registry
from farhand.deploy.pki.throw_away import keep_throw_away, make_throw_away

pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl command")
NOW = datetime(2027, 3, 1, 12, tzinfo=UTC)


def openssl(*arguments: str | Path) -> str:
    done = subprocess.run(["openssl", *arguments], check=False, capture_output=True, text=True, timeout=30)
    return done.stdout + done.stderr


def verify(site: Path, purpose: str, at: datetime = NOW, *more: str) -> str:
    return openssl(
        "verify", "-x509_strict", "-purpose", purpose, "-attime", str(int(at.timestamp())), *more,
        "-CAfile", site / "ca.pem", site / "certificate.pem",
    )  # fmt: skip


def mode(file: Path) -> int:
    return stat.S_IMODE(file.stat().st_mode)


@pytest.fixture
def registry(tmp_path: Path) -> Registry:
    return Registry.create(tmp_path / "pki", "fleet", NOW)


def test_openssl_accepts_a_robot_as_server_and_client_and_an_operator_as_client_alone(registry: Registry):
    robot = registry.issue("rov1", "robot", ("rov1.example", "10.0.0.5", "fd00::5"), 365, NOW)
    operator = registry.issue("shore-1", "operator", (), 90, NOW)
    for site, purpose in ((robot, "sslserver"), (robot, "sslclient"), (operator, "sslclient")):
        assert verify(site, purpose).endswith("certificate.pem: OK\n")
    assert "unsuitable certificate purpose" in verify(operator, "sslserver")


def test_openssl_finds_exactly_the_hosts_that_were_asked_for(registry: Registry):
    robot = registry.issue("rov1", "robot", ("ROV1.example", "10.0.0.5", "[fd00::5]", "10.0.0.5"), 365, NOW)
    for name in (("-verify_hostname", "rov1.example"), ("-verify_ip", "10.0.0.5"), ("-verify_ip", "fd00::5")):
        assert ": OK" in verify(robot, "sslserver", NOW, *name)
    for name in (("-verify_hostname", "rov2.example"), ("-verify_ip", "10.0.0.6")):
        assert "mismatch" in verify(robot, "sslserver", NOW, *name)
    text = openssl("x509", "-noout", "-text", "-in", robot / "certificate.pem")
    assert text.count("IP Address:10.0.0.5") == 1
    assert "CN = rov1\n" in text
    assert "ASN1 OID: prime256v1" in text


@pytest.mark.parametrize("days", [1, 90, 3650])
def test_openssl_accepts_a_certificate_on_the_days_asked_for_and_on_no_other(registry: Registry, days: int):
    site = registry.issue("shore-1", "operator", (), days, NOW)
    end = NOW + timedelta(days=days)
    for at in (NOW - timedelta(minutes=59), NOW, end - timedelta(seconds=1)):
        assert ": OK" in verify(site, "sslclient", at)
    assert "certificate is not yet valid" in verify(site, "sslclient", NOW - timedelta(minutes=61))
    assert "certificate has expired" in verify(site, "sslclient", end + timedelta(seconds=1))


def test_no_certificate_outlives_its_authority(registry: Registry):
    later = NOW + timedelta(days=3000)
    site = registry.issue("shore-1", "operator", (), 3650, later)
    end = NOW + timedelta(days=3650)
    assert ": OK" in verify(site, "sslclient", end - timedelta(seconds=1))
    assert SiteCertificate.load(site).certificate.not_valid_after_utc == end


def test_openssl_refuses_what_another_authority_issued_under_the_same_names(
    tmp_path: Path, registry: Registry
):
    site = registry.issue("shore-1", "operator", (), 90, NOW)
    other = Registry.create(tmp_path / "other", "fleet", NOW).issue("shore-1", "operator", (), 90, NOW)
    shutil.copy(other / "certificate.pem", site / "certificate.pem")
    assert "verification failed" in verify(site, "sslclient")
    shutil.copy(other / "key.pem", site / "key.pem")
    with pytest.raises(InvalidConfiguration, match=r"certificate\.pem: issued by the authority of ca\.pem"):
        SiteCertificate.load(site)


def test_a_site_cannot_issue_certificates(tmp_path: Path, registry: Registry):
    robot = registry.issue("rov1", "robot", ("rov1",), 365, NOW)
    request, forged = tmp_path / "request.pem", tmp_path / "forged.pem"
    openssl("req", "-new", "-key", robot / "key.pem", "-subj", "/CN=shore-1", "-out", request)
    openssl("x509", "-req", "-in", request, "-CA", robot / "certificate.pem", "-CAkey", robot / "key.pem",
            "-CAcreateserial", "-days", "1", "-out", forged)  # fmt: skip
    assert forged.stat().st_size
    verdict = openssl("verify", "-CAfile", robot / "ca.pem", "-untrusted", robot / "certificate.pem",
                      "-attime", str(int(NOW.timestamp())), forged)  # fmt: skip
    assert "invalid CA certificate" in verdict


def test_keys_are_for_their_owner_alone_whatever_the_umask(tmp_path: Path):
    before = os.umask(0)
    try:
        registry = Registry.create(tmp_path / "pki", "ca", NOW)
        site = registry.issue("shore-1", "operator", (), 90, NOW)
    finally:
        os.umask(before)
    assert mode(tmp_path / "pki" / "ca.key") == mode(site / "key.pem") == 0o600
    assert mode(tmp_path / "pki") == mode(site) == 0o700
    assert sorted(file.name for file in site.iterdir()) == ["ca.pem", "certificate.pem", "key.pem"]
    for file in (tmp_path / "pki").rglob("*"):
        if file.is_file() and file.name not in ("ca.key", "key.pem"):
            assert "PRIVATE KEY" not in file.read_text()


def test_a_renewed_certificate_has_the_same_key_name_and_hosts_and_another_serial(registry: Registry):
    site = registry.issue("rov1", "robot", ("rov1.example", "10.0.0.5"), 30, NOW)
    before = {question: openssl("x509", "-noout", f"-{question}", "-in", site / "certificate.pem")
              for question in ("pubkey", "subject", "ext=subjectAltName", "serial")}  # fmt: skip
    key = (site / "key.pem").read_bytes()
    later = NOW + timedelta(days=29)
    assert registry.renew("rov1", 365, later) == site / "certificate.pem"
    after = {q: openssl("x509", "-noout", f"-{q}", "-in", site / "certificate.pem") for q in before}
    assert after.pop("serial") != before.pop("serial")
    assert after == before
    assert (site / "key.pem").read_bytes() == key
    assert ": OK" in verify(site, "sslserver", later + timedelta(days=364))


def test_a_revoked_name_is_never_given_out_again_and_its_key_is_gone(tmp_path: Path, registry: Registry):
    site = registry.issue("shore-1", "operator", (), 90, NOW)
    registry.revoke("shore-1", NOW)
    registry.revoke("shore-1", NOW + timedelta(days=1))  # changes nothing
    assert not (site / "key.pem").exists()
    again = Registry.open(tmp_path / "pki")
    (issued,) = again.all()
    assert issued.fault(NOW) == "revoked on 2027-03-01 12:00 UTC"
    with pytest.raises(InvalidConfiguration, match="was revoked: choose another name"):
        again.issue("shore-1", "operator", (), 90)
    with pytest.raises(InvalidConfiguration, match="not revoked"):
        again.renew("shore-1", 90)


def test_a_second_authority_does_not_take_the_place_of_the_first(tmp_path: Path, registry: Registry):
    key = (tmp_path / "pki" / "ca.key").read_bytes()
    with pytest.raises(InvalidConfiguration, match="which a new one would make worthless"):
        Registry.create(tmp_path / "pki", "other")
    assert (tmp_path / "pki" / "ca.key").read_bytes() == key


def test_what_makes_no_sense_is_refused_by_field_and_leaves_nothing_behind(
    tmp_path: Path, registry: Registry
):
    issue = registry.issue
    for call, words in (
        (lambda: issue("../x", "operator", (), 90), "name: a name of letters"),
        (lambda: issue("a" * 17, "operator", (), 90), "at most 16"),
        (lambda: issue("shore", "hub", (), 90), "san: at least one"),
        (lambda: issue("shore-1", "operator", (), 90, robots=("ro v",)), "robots: a name of letters"),
        (lambda: issue("rov1", "robot", ("10.0.0.256",), 90), "san: a host name"),
        (lambda: issue("rov1", "robot", ("rov1:7447",), 90), "without port"),
        (lambda: issue("shore-1", "operator", (), 0), "days: 1 to 3650"),
        (lambda: registry.renew("nobody", 90), r"name: a name that was issued \(none yet\), got 'nobody'"),
        (lambda: registry.revoke("nobody"), "name that was issued"),
    ):
        with pytest.raises(InvalidConfiguration, match=words):
            call()
    assert not (tmp_path / "pki" / "sites").exists()
    assert list(Registry.open(tmp_path / "pki").all()) == []


def test_two_commands_at_once_forget_nothing_of_each_other(tmp_path: Path, registry: Registry):
    registry.issue("lost", "operator", (), 90, NOW)
    one, other = Registry.open(tmp_path / "pki"), Registry.open(tmp_path / "pki")
    one.revoke("lost", NOW)
    other.issue("shore-1", "operator", (), 90, NOW)
    one.issue("shore-2", "operator", (), 90, NOW)
    with pytest.raises(InvalidConfiguration, match="not revoked"):
        other.renew("lost", 90, NOW)
    rights = Registry.open(tmp_path / "pki").rights
    assert list(rights) == ["lost", "shore-1", "shore-2"] and rights["lost"].revoked == NOW


def test_while_one_process_changes_the_authority_another_one_is_refused_in_one_line(
    tmp_path: Path, registry: Registry
):
    registry.issue("shore-1", "operator", (), 90, NOW)
    before = (tmp_path / "pki" / "sites.json").read_bytes()
    with Claim(tmp_path / "pki", "the authority"):
        for change in (
            lambda: registry.issue("shore-2", "operator", (), 90),
            lambda: registry.renew("shore-1", 90),
            lambda: registry.revoke("shore-1"),
            lambda: Registry.create(tmp_path / "pki", "other"),
        ):
            with pytest.raises(
                FolderInUse, match=rf"process {os.getpid()} keeps the authority there: repeat"
            ):
                change()
        assert [issued.name for issued in Registry.open(tmp_path / "pki").all()] == ["shore-1"]
    assert (tmp_path / "pki" / "sites.json").read_bytes() == before
    registry.revoke("shore-1")


DAMAGE: dict[str, Callable[[Path], object]] = {
    "lost": Path.unlink,
    "empty": lambda file: file.write_bytes(b""),
    "no text": lambda file: file.write_bytes(b"\xff\xfe" * 100),
    "cut": lambda file: file.write_bytes(file.read_bytes()[:200]),
    "a folder": lambda file: (file.unlink(), file.mkdir()),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_certificate_is_told_can_be_revoked_and_hinders_no_other_site(
    tmp_path: Path, registry: Registry, damage: str
):
    for name in ("shore-1", "shore-2"):
        registry.issue(name, "operator", (), 90, NOW)
    DAMAGE[damage](registry.folder_of("shore-1") / "certificate.pem")
    shown = {issued.name: issued.fault(NOW) for issued in Registry.open(tmp_path / "pki").all()}
    assert "certificate.pem: " in shown["shore-1"] and "\n" not in shown["shore-1"] and not shown["shore-2"]
    registry.renew("shore-2", 90, NOW)
    with pytest.raises(InvalidConfiguration, match=r"shore-1.certificate\.pem: "):
        registry.renew("shore-1", 90, NOW)
    registry.revoke("shore-1", NOW)
    (lost, _) = Registry.open(tmp_path / "pki").all()
    assert (
        lost.fault(NOW).startswith("revoked on") and not (registry.folder_of("shore-1") / "key.pem").exists()
    )


def fails_at(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    """Let the disk be full at one of the files that are written from now on."""
    fsync, written = os.fsync, itertools.count()

    def full(descriptor: int) -> None:
        if next(written) == number:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", full)


@pytest.mark.parametrize("number", range(4))
def test_what_cannot_be_written_as_a_whole_leaves_no_certificate_that_nobody_could_revoke(
    registry: Registry, number: int, monkeypatch: pytest.MonkeyPatch
):
    with monkeypatch.context() as patched, pytest.raises(OSError, match="No space left"):
        fails_at(patched, number)
        registry.issue("shore-1", "operator", (), 90, NOW)
    assert list(registry.folder_of("shore-1").iterdir()) == []
    assert ": OK" in verify(registry.issue("shore-1", "operator", (), 90, NOW), "sslclient")


@pytest.mark.parametrize("number", range(3))
def test_an_authority_that_cannot_be_written_as_a_whole_can_be_made_again(
    tmp_path: Path, number: int, monkeypatch: pytest.MonkeyPatch
):
    with monkeypatch.context() as patched, pytest.raises(OSError, match="No space left"):
        fails_at(patched, number)
        Registry.create(tmp_path / "pki", "fleet", NOW)
    site = Registry.create(tmp_path / "pki", "fleet", NOW).issue("shore-1", "operator", (), 90, NOW)
    assert ": OK" in verify(site, "sslclient")


@pytest.mark.parametrize("name", ["../../x", "a/b", "a\\nb", "", "<b>", "x" * 40, "*"])
def test_a_list_of_sites_with_a_name_that_is_none_is_refused(tmp_path: Path, registry: Registry, name: str):
    (tmp_path / "pki" / "sites.json").write_text(f'{{"{name}": {{"role": "operator"}}}}')
    with pytest.raises(InvalidConfiguration, match=r"sites\.json: "):
        Registry.open(tmp_path / "pki")
    with pytest.raises(InvalidConfiguration, match=r"sites\.json: "):
        registry.issue("shore-1", "operator", (), 90, NOW)


@pytest.mark.parametrize("name", ["ca.pem", "ca.key", "sites.json"])
def test_a_damaged_file_of_the_authority_is_named(tmp_path: Path, registry: Registry, name: str):
    (tmp_path / "pki" / name).write_text("damaged")
    with pytest.raises(InvalidConfiguration, match=name.replace(".", r"\.")):
        Registry.open(tmp_path / "pki")


def test_a_site_names_the_file_that_does_not_fit(registry: Registry):
    site, other = (registry.issue(name, "operator", (), 90, NOW) for name in ("shore-1", "shore-2"))
    assert SiteCertificate.load(site).name == "shore-1"
    shutil.copy(other / "key.pem", site / "key.pem")
    with pytest.raises(InvalidConfiguration, match=r"key\.pem: the key of certificate\.pem"):
        SiteCertificate.load(site)
    (site / "key.pem").unlink()
    with pytest.raises(InvalidConfiguration, match=r"key\.pem: a readable file"):
        SiteCertificate.load(site)


def test_a_site_warns_for_the_last_fortnight_and_then_says_what_is_wrong(registry: Registry):
    certificate = SiteCertificate.load(registry.issue("shore-1", "operator", (), 90, NOW))
    end = NOW + timedelta(days=90)
    assert certificate.warning(end - timedelta(days=14, seconds=1)) == ""
    assert "expires in 13 days: farhand pki renew shore-1" in certificate.warning(
        end - timedelta(days=13, hours=1)
    )
    assert "expires in 5 hours" in certificate.warning(end - timedelta(hours=5, minutes=1))
    assert certificate.fault(end) == certificate.fault(NOW) == ""
    assert (
        certificate.fault(end + timedelta(seconds=1))
        == "the certificate of shore-1 expired on 2027-05-30 12:00 UTC"
    )
    assert "is the clock of this machine right?" in certificate.fault(NOW - timedelta(days=1))
    assert certificate.warning(end + timedelta(days=1)) == ""


def test_a_throw_away_authority_keeps_no_key_of_its_own(tmp_path: Path):
    robot, operator = make_throw_away(tmp_path / "pki", "rov1", ("127.0.0.1",), "here")
    assert ": OK" in verify(robot, "sslserver", datetime.now(UTC), "-verify_ip", "127.0.0.1")
    assert ": OK" in verify(operator, "sslclient", datetime.now(UTC))
    assert not (tmp_path / "pki" / "ca.key").exists()


def test_throw_away_certificates_are_kept_until_they_fit_no_more(tmp_path: Path):
    folders = tmp_path / "robot", tmp_path / "operator"
    folders[0].mkdir()
    assert keep_throw_away(folders, "rov1", ("link-shore",), "operator")
    key = (folders[0] / "key.pem").read_bytes()
    assert (folders[0] / "key.pem").stat().st_mode & 0o077 == 0
    assert ": OK" in verify(folders[0], "sslserver", datetime.now(UTC), "-verify_hostname", "link-shore")
    assert not keep_throw_away(folders, "rov1", ("link-shore",), "operator")
    assert (folders[0] / "key.pem").read_bytes() == key
    for n, (hosts, operator) in enumerate(((("other",), "operator"), (("other",), "shore-2"))):
        assert keep_throw_away(folders, "rov1", hosts, operator), n
        assert SiteCertificate.load(folders[1]).name == operator
    (folders[1] / "key.pem").unlink()
    assert keep_throw_away(folders, "rov1", ("other",), "shore-2")


@settings(deadline=None, derandomize=True, max_examples=200)
@given(st.text(max_size=12) | st.from_regex(r"[a-z0-9.:\[\]-]{1,20}", fullmatch=True))
def test_a_host_is_an_address_a_name_or_refused(text: str):
    try:
        (host,) = parse_hosts((text,))
    except InvalidConfiguration as error:
        assert error.field == "san"
    else:
        assert parse_hosts((host,)) == (host,)
        assert not set(host) & set(" /[]@*_")
