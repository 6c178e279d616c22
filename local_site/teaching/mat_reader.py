"""Reader of one MATLAB file, in a process of its own: `python -P mat_reader.py NAME < FILE.mat > ARRAYS.npz`.

Malformed files crash the library or make it ask for any amount of memory; here that ends this process alone.
It imports nothing of Farhand, so that it starts quickly and anywhere. The last line of stderr names the
error. The output has the arrays `NUMBER.FIELD`, with one number per structure.
"""

from __future__ import annotations

import sys
from io import BytesIO
from pathlib import Path

import numpy as np
from scipy.io import loadmat

_MEMORY_BYTES = 256_000_000
_WORK_S = 4


def main(name: str) -> None:
    """Write the numeric fields of the structure with this name, or of each structure in an array."""
    content = sys.stdin.buffer.read()
    _limit()
    found = loadmat(BytesIO(content), simplify_cells=True)[name]
    structures = [found] if isinstance(found, dict) else list(found)
    arrays = {
        f"{number}.{field}": np.asarray(value)
        for number, structure in enumerate(structures)
        for field, value in structure.items()
        if np.asarray(value).dtype.kind in "fiu"
    }
    out = BytesIO()
    np.savez(out, allow_pickle=False, **arrays)
    sys.stdout.buffer.write(out.getvalue())


def _limit() -> None:
    """Limit this process's memory and time, beyond what it has taken to start."""
    import resource

    taken = Path("/proc/self/statm")
    if taken.exists():  # elsewhere only time is limited
        used = int(taken.read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + _MEMORY_BYTES, used + _MEMORY_BYTES))
    spent_s = int(resource.getrusage(resource.RUSAGE_SELF).ru_utime)
    resource.setrlimit(resource.RLIMIT_CPU, (spent_s + _WORK_S, spent_s + _WORK_S + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    try:
        main(sys.argv[1])
    except Exception as error:
        sys.exit(" ".join(str(error).split())[:200] or type(error).__name__)
