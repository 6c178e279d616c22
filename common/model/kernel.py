"""`kernel`: the decorator of all compiled functions.

Numba keeps compiled functions on disk, but looks only at the file of the function itself when it asks
whether they are still valid: a kernel that calls one of another, changed file would go on running the old
code. So the cache lies in a folder that is named by the content of all files with kernels.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from numba import njit
from numba.core import config

_ROOT = Path(__file__).resolve().parents[2]
_FOLDERS = ("common/model", "local_site/learning", "remote_site/reproduction")


def _cache_folder() -> Path:
    digest = hashlib.sha256()
    for folder in _FOLDERS:
        for file in sorted((_ROOT / folder).glob("*.py")):
            content = file.read_bytes()
            if b"@kernel" in content:
                digest.update(content)
    parent = vars(config)["CACHE_DIR"] or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(parent) / "farhand" / f"kernels-{digest.hexdigest()[:12]}"


config.__dict__["CACHE_DIR"] = str(_cache_folder())  # what the variable NUMBA_CACHE_DIR sets
kernel = njit(cache=True, error_model="numpy")
