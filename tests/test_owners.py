"""Each kind of fault ends at one place (docs/safety.md): who does by itself what a place is for, does so for a reason."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FOLDERS = ("common", "local_site", "remote_site", "deploy")
OWN = "the place itself"

# What only one place may do: how it looks in the code, and the files that do it all the same, each with its reason.
OWNERS: dict[str, tuple[str, dict[str, str]]] = {
    "writes a file": (
        r"\.write_(text|bytes)\(|\bos\.(open|rename|replace|truncate)\(|\.savefig\((?!drawn)|\bnp\.save|\bshutil\.(copy|move)"
        r"|\bopen\([^)]*[\"'][wax+]",
        {
            "common/whole_file.py": OWN,
            "common/json_lines.py": "appends to the events; a line that was cut short is begun anew",
            "local_site/teaching/recording.py": "appends to the samples under way; the last line may be cut short",
            "local_site/teaching/demonstration.py": "into memory, which is then written whole",
            "local_site/recordings/reader_process.py": "to the process that asked",
            "remote_site/robots/plant_memory.py": "20 times a second, a whole file each time, without waiting for the disk",
            "deploy/standard_streams.py": "the null device in place of a closed descriptor",
            "deploy/process_discovery.py": "a folder, for the short address of what is in it",
        },
    ),
    "reads a file": (
        r"\.read_(text|bytes)\(|\bnp\.(load|genfromtxt|loadtxt)\(|\bloadmat\(|\bZipFile\(|\btomllib\b|\bjson\.load\(",
        {
            "common/link/connection_faults.py": "the kernel's table of connections",
            "common/model/kernel.py": "its own cache, which is made again",
            "deploy/places.py": "the name of the usual robot, which comes with the program",
            "deploy/up.py": "the result that its own child has just written",
            "local_site/recordings/reader_process.py": "a process of its own, with bounds of time and memory",
            "local_site/teaching/plain_arrays.py": "bytes that were read within bounds, under `fault_of`",
            "local_site/view/host_name.py": "the kernel's table of routes",
            "local_site/view/server.py": "the page's own files, which come with the program",
        },
    ),
    "takes an address apart": (r"rpartition\(\":\"\)|rsplit\(\":\"", {"common/address.py": OWN}),
    "listens": (
        r"\.bind\(|\.listen\((?!_)(?=\d|\))|\bcreate_server\(|\bstart_(unix_)?server\(|\bHTTPServer\(|\bSOCK_STREAM\)$",
        {
            "common/address.py": OWN,
            "deploy/status_socket.py": "for this user alone; it reads nothing, and answers one after the other",
            "deploy/link/relay_connection.py": "dials, and does not listen",
            "local_site/console/console.py": "to messages of the robot",
        },
    ),
    "runs what it reads": (
        r"shell=True|\bos\.system\(|\beval\(|\bexec\(|\bpickle\.load",
        dict[str, str](),
    ),
    "finds a home": (
        r"\.expanduser\(|\bPath\.home\(",
        {
            "common/names.py": OWN,
            "common/model/kernel.py": "the user's own; a temporary folder takes its place",
            "deploy/places.py": "the user's own, whose lack has its own remedy",
        },
    ),
    "starts a process": (
        r"\bPopen\(|\bsubprocess\.run\(|\bcreate_subprocess_|\bProcessPoolExecutor\(",
        {
            "deploy/child_process.py": "the words of `own_command`",
            "local_site/recordings/formats.py": "by the path of a file that imports nothing of Farhand",
            "remote_site/camera/camera_process.py": "its own code, by the folder that holds it",
        },
    ),
    "reads the wall clock": (
        r"\btime\.time(_ns)?\(|\bdatetime\.now\(",
        {
            "common/json_lines.py": "the time of an event, for the reader",
            "common/model/kernel.py": "held against the times of files",
            "common/link/certificates.py": "a certificate is valid by the calendar",
            "deploy/pki/commands.py": "a certificate is valid by the calendar",
            "deploy/pki/issue.py": "a certificate is valid by the calendar",
            "deploy/pki/registry.py": "a certificate is valid by the calendar",
            "deploy/status_socket.py": "the time of an end, for the reader",
            "local_site/teaching/revisions.py": "the time of a revision, for the reader",
            "local_site/teaching/task_archive.py": "the name of a file, for the reader",
            "local_site/view/panels/html.py": "the time of an event, for the reader",
        },
    ),
    "reads a clock that stands still in a suspend": (
        r"\btime\.monotonic(_ns)?\b|\btime\.perf_counter",
        {
            "common/clock.py": "detects the suspend by it",
            "common/link/outbox.py": "how long a call was held up",
            "common/link/pace.py": "the rate of a line, which sends nothing in a suspend",
            "common/link/path_probe.py": "the wait for an answer",
            "common/link/quic.py": "the silence of the path while this computer is awake",
            "common/link/site_sessions.py": "the wait for an answer",
            "common/link/budget.py": "the silence of the path while this computer is awake",
            "common/link/session.py": "how often a reason is logged",
            "common/log.py": "how often a line is logged",
            "deploy/process_discovery.py": "the wait for an answer",
            "deploy/up.py": "the wait for a child",
            "local_site/view/server.py": "the rate of a tab's messages",
            "local_site/workcell/arm_drivers.py": "the pace of a loop",
            "remote_site/camera/camera_process.py": "the wait for an answer",
            "remote_site/camera/robot_camera.py": "the periods of pictures; a suspend ends this camera with its robot",
            "remote_site/site.py": "the age of a tick of a loop that a suspend ends",
        },
    ),
}


def files() -> list[Path]:
    return [file for folder in FOLDERS for file in sorted((ROOT / folder).rglob("*.py"))]


def who(pattern: str) -> set[str]:
    found = re.compile(pattern, re.MULTILINE)
    return {str(file.relative_to(ROOT)) for file in files() if found.search(file.read_text(encoding="utf-8"))}


@pytest.mark.parametrize("what", OWNERS)
def test_nobody_does_by_itself_what_one_place_is_for_and_no_exception_is_of_the_past(what: str):
    pattern, exceptions = OWNERS[what]
    assert who(pattern) == set(exceptions), (
        f"who {what}: use the place that docs/safety.md names, or say here why not"
    )


def test_the_patterns_find_what_they_are_for():
    """So the tests above can fail."""
    bypasses = {
        "writes a file": 'path.write_text(words)\nwith open(path, "w") as file:\nfigure.savefig(path)\npath.open("ab")',
        "reads a file": "path.read_bytes()\nnp.load(path)\njson.load(file)\nloadmat(path)",
        "takes an address apart": 'host, _, port = text.rpartition(":")\ntext.rsplit(":", 1)',
        "listens": "sock.listen()\nsock.bind(address)\nsock.listen(8)\nasyncio.start_server(serve)\nHTTPServer(address)",
        "runs what it reads": "run(words, shell=True)\nos.system(words)\npickle.load(file)",
        "finds a home": "Path(words).expanduser()\nPath.home()",
        "starts a process": "subprocess.Popen(words)\nsubprocess.run(words)\nawait asyncio.create_subprocess_exec(*words)",
        "reads the wall clock": "time.time()\ndatetime.now(UTC)",
        "reads a clock that stands still in a suspend": "time.monotonic()\nfield(default_factory=time.monotonic)",
    }
    assert bypasses.keys() == OWNERS.keys()
    for what, lines in bypasses.items():
        assert all(re.search(OWNERS[what][0], line) for line in lines.splitlines()), what
