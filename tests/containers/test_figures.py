"""The figures of docs/deployment.md: size, time until the page answers, processor and memory at rest.

`pytest -m soak --log-cli-level=INFO tests/containers/test_figures.py` says them; take them on a quiet machine.
"""

from __future__ import annotations

import logging
import time

import pytest

from farhand.local_site.script.scripted_actions import RealTime
from tests.containers.engine import BUILD_S, RUN_S, Engine
from tests.containers.place import MIB, SERVICES, Place

log = logging.getLogger(__name__)
pytestmark = [pytest.mark.containers, pytest.mark.timeout(BUILD_S + RUN_S)]

_IMAGE_BYTES = 800_000_000
_ANSWER_S = 20.0
_ROBOT_CORES = 0.2
_REST_S = 30.0
_CGROUP = """
cat /sys/fs/cgroup/cpuacct/cpuacct.usage 2>/dev/null || awk '$1 == "usage_usec" { print 1000 * $2 }' /sys/fs/cgroup/cpu.stat
cat /sys/fs/cgroup/memory/memory.stat 2>/dev/null || cat /sys/fs/cgroup/memory.stat
"""


def test_the_image_is_small(engine: Engine) -> None:
    n_bytes = int(engine.do("image", "inspect", "--format={{.Size}}", "farhand"))
    log.info("image: %.0f MB", n_bytes / 1e6)
    assert n_bytes <= _IMAGE_BYTES


_CAPTURE = """
from farhand.common.arm.cell import Cell
from farhand.deploy.places import find_robot
from farhand.remote_site.camera.simulated_camera import SimulatedCamera
camera = SimulatedCamera(Cell(robot=find_robot("jaco")))
print(camera.capture().pixels.std())
camera.close()
"""


@pytest.mark.soak
def test_an_image_with_a_library_to_draw_with_has_the_robots_camera_and_the_usual_one_says_that_it_has_none(
    engine: Engine,
) -> None:
    with_library = "--build-arg=DRAW_WITH=libosmesa6", "--file=docker/Dockerfile", "--tag=farhand-camera", "."
    engine.do("build", "--quiet", *with_library, timeout_s=BUILD_S)
    n_bytes = [
        int(engine.do("image", "inspect", "--format={{.Size}}", image))
        for image in ("farhand", "farhand-camera")
    ]
    log.info("image with a camera: %.0f MB more", (n_bytes[1] - n_bytes[0]) / 1e6)
    confined = "--rm", "--read-only", "--tmpfs=/tmp", "--cap-drop=ALL", "--memory=768m", "--pids-limit=128"
    draw = "--entrypoint=python3", "--network=none"
    seen = engine.do("run", *confined, *draw, "farhand-camera", "-c", _CAPTURE, timeout_s=RUN_S)
    assert float(seen) > 20.0, "a picture with something in it"
    without = engine.run(engine.docker, "run", *confined, *draw, "farhand", "-c", _CAPTURE, timeout_s=RUN_S)
    assert without.returncode != 0 and "nothing to draw with" in without.stderr


@pytest.mark.soak
def test_the_page_answers_soon_after_up_and_all_of_it_rests_quietly(place: Place) -> None:
    place.compose("down", "--volumes", "--timeout", "10")
    answered_s = place.up()
    for service in SERVICES:
        place.await_troubles(service, set())
    before, began_s = {service: usage(place, service) for service in SERVICES}, time.monotonic()
    RealTime().pause(_REST_S)
    after, took_s = {service: usage(place, service) for service in SERVICES}, time.monotonic() - began_s
    cores = {service: (after[service][0] - before[service][0]) / took_s for service in SERVICES}
    log.info("page: %.1f s after up", answered_s)
    for service in SERVICES:
        log.info(
            "%s: %.1f %% of a core at rest, %.0f MiB",
            service,
            100.0 * cores[service],
            after[service][1] / MIB,
        )
    assert answered_s <= _ANSWER_S
    assert cores["robot"] <= _ROBOT_CORES


def usage(place: Place, service: str) -> tuple[float, int]:
    """Processor time [s] and memory [B] of a container, without the files that its kernel could drop."""
    used, *lines = place.run(service, "sh", "-c", _CGROUP).splitlines()
    memory = {name: int(value) for name, value in map(str.split, lines)}
    return float(used) * 1e-9, memory.get("total_rss") or memory["anon"]
