"""The rights, the room and the logs that each container has: tried from inside, and read from its kernel."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest

from tests.containers.engine import ANSWER_S, BUILD_S, Engine
from tests.containers.place import MIB, SERVICES, Place

pytestmark = [pytest.mark.containers, pytest.mark.timeout(BUILD_S)]

MEMORY_MIB = {"robot": 768, "link": 256, "operator": 768}
_PROCESSES = 128
_LOG_BYTES = 15_000_000
"""Three files of 5 MB."""
_PROBE = """
import ctypes, errno, json, os
def fault(path):
    try:
        with open(path, "w"):
            os.remove(path)
    except OSError as error:
        return errno.errorcode[error.errno]
    return ""
def first(*paths):
    return next(open(path).read().strip() for path in paths if os.path.exists(path))
libc = ctypes.CDLL(None, use_errno=True)
status = dict(line.rstrip().split(":\\t", 1) for line in open("/proc/1/status") if ":\\t" in line)
print(json.dumps({
    "status": status,
    "writes": {folder: fault(os.path.join(folder, "probe")) for folder in ("/", "/usr", "/opt/application", "/var/cache/farhand", "/tmp")},
    "mount": "done" if libc.mount(b"none", b"/tmp", b"tmpfs", 0, None) == 0 else errno.errorcode[ctypes.get_errno()],
    "memory": first("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"),
    "pids": first("/sys/fs/cgroup/pids.max", "/sys/fs/cgroup/pids/pids.max"),
}))
"""


@pytest.mark.parametrize("service", SERVICES)
def test_a_process_has_no_rights_and_no_room_that_it_does_not_need(place: Place, service: str) -> None:
    found = json.loads(place.run(service, "python3", "-c", _PROBE))
    status = found["status"]
    assert "0" not in status["Uid"].split()
    assert int(status["CapEff"], 16) == int(status["CapBnd"], 16) == 0
    assert status["NoNewPrivs"] == "1"
    assert found["mount"] == "EPERM"  # as somebody without rights
    read_only = ("/", "/usr", "/opt/application", "/var/cache/farhand")
    assert found["writes"] == dict.fromkeys(read_only, "EROFS") | {"/tmp": ""}
    assert int(found["memory"]) == MEMORY_MIB[service] * MIB
    assert int(found["pids"]) == _PROCESSES


@pytest.fixture
def talker(place: Place) -> Iterator[str]:
    """A container of the link's service, and with its settings, that has written 40 MB."""
    write = "for k in range(400_000): print(f'{k:99}')"
    run = ("run", "--detach", "--no-deps", "--entrypoint", "python3", "link", "-c", write)
    container = place.compose(*run).split()[-1]
    yield container
    place.engine.do("rm", "--force", container)


def test_what_a_container_logs_is_bounded_and_the_newest_is_kept(place: Place, talker: str) -> None:
    engine = place.engine
    assert engine.do("wait", talker, timeout_s=60.0) == "0"
    kept = engine.do("logs", talker, timeout_s=60.0)
    assert 1_000_000 < len(kept) <= _LOG_BYTES
    assert kept.split()[-1] == "399999"
    assert len({log_settings(engine, each) for each in (talker, *map(engine.container, SERVICES))}) == 1


def log_settings(engine: Engine, container: str) -> str:
    return engine.do("inspect", "--format={{json .HostConfig.LogConfig}}", container, timeout_s=ANSWER_S)
