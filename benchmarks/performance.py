"""`make bench`: one table, one run, one core; each line beside its peer.

python -m benchmarks.performance [FILE]        writes docs/performance.md unless told otherwise
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # before numpy is imported: one core

import importlib.metadata
import platform
import sys
from pathlib import Path

from benchmarks import arm, control, learning
from benchmarks.timing import BenchmarkRow

_PACKAGES = ("numpy", "scipy", "numba", "scikit-learn", "osqp", "mujoco", "mink")
_TEXT = """# Performance

Written by `make bench`: one run, on one core, with BLAS on one thread. Each time is the least of interleaved repeats, in
processor time of the one thread that does all the work, so that what else the machine does meets ours and the peer
alike; trust ratios rather than times. The load of the machine was {load_before:.1f} at the start and {load_after:.1f} at the end of the
run, on {cores} cores. `observe` is one datapoint, checked; `observe_many` a whole demonstration of 2000. The batch EM sees
what the online assignment sees (point, direction, distance travelled) of the same datapoints.

{versions}. {machine}.

| what | ours [us] | peer | peer [us] | peer / ours | target | |
|---|---:|---|---:|---:|---|---|
"""


def main(path: Path) -> None:
    """Measure everything and write the table."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    load_before = os.getloadavg()[0]
    rows = learning.rows() + control.rows() + arm.rows()
    growth = control.memory_growth_bytes()
    text = _TEXT.format(
        load_before=load_before,
        load_after=os.getloadavg()[0],
        cores=os.cpu_count(),
        versions=", ".join(
            [f"Python {platform.python_version()}"]
            + [f"{name} {importlib.metadata.version(name)}" for name in _PACKAGES]
        ),
        machine=f"{_processor()}, {platform.system()} {platform.release()}",
    )
    lines = [_line(row) for row in rows]
    kept = f"Resident memory after 1,000,000 ticks less that after 50,000: {growth / 2**20:.2f} MiB (target <= 1 MiB)."
    path.write_text(text + "\n".join(lines) + f"\n\n{kept}\n")
    sys.stdout.write(path.read_text())


def _line(row: BenchmarkRow) -> str:
    if row.peer_us is None:
        peer = ratio = ""
    else:
        peer, ratio = f"{row.peer_us:.3g}", f"{row.peer_us / row.ours_us:.3g}"
    return (
        f"| {row.what} | {row.ours_us:.3g} | {row.peer} | {peer} | {ratio} | {row.target} | {_verdict(row)} |"
    )


def _verdict(row: BenchmarkRow) -> str:
    """Return whether each part of the target was met.

    The parts: `<= N us`, `>= Nx` the peer, `<= N` of or times the peer.
    """
    if not row.target:
        return ""
    return "met" if all(_met(row, part.split()) for part in row.target.split(", ")) else "missed"


def _met(row: BenchmarkRow, words: list[str]) -> bool:
    limit = float(words[1].rstrip("x"))
    if words[0] == ">=":
        assert row.peer_us is not None
        return row.peer_us / row.ours_us >= limit
    if words[2:] == ["us"]:
        return row.ours_us <= limit
    assert row.peer_us is not None
    return row.ours_us / row.peer_us <= limit


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    names = [s for s in info.read_text().splitlines() if s.startswith("model name")] if info.exists() else []
    return names[0].partition(":")[2].strip() if names else platform.processor()


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/performance.md"))
