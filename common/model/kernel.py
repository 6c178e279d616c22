"""`kernel`: the decorator of all compiled functions, and where compiled functions are kept.

Numba looks only at the file of the function itself when it asks whether what it keeps is still valid: a kernel
that calls one of another, changed file would go on running the old code. So the cache lies in a folder that is
named by the content of all files with kernels.

A cache is there to save time, and must never end a process: one that may only be read is used as it is, one
that is damaged or has no room costs a line and the time to compile.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import shutil
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from numba import njit
from numba.core import config
from numba.core.caching import CompileResultCacheImpl, FunctionCache, UserProvidedCacheLocator

from farhand.common.temporary_folder import NoTemporaryFolder, is_own, own_temporary_folder

_log = logging.getLogger(__name__)

_ROOT = Path(__file__).resolve().parents[2]
_FOLDERS = ("common/model", "local_site/learning", "remote_site/reproduction")
_TRIED_BYTES = 65_536
_MOST_OTHERS, _IN_USE_S = 3, 3600.0
_REMEDY = "XDG_CACHE_HOME names a folder for them"


def _content_hash() -> str:
    digest = hashlib.sha256()
    for folder in _FOLDERS:
        for file in sorted((_ROOT / folder).rglob("*.py")):
            content = file.read_bytes()
            if b"common.model.kernel import" in content:
                digest.update(content)
    return digest.hexdigest()[:12]


def _usual_folder() -> Path | None:
    """Return the user's cache folder; None without a home."""
    try:
        return Path(vars(config)["CACHE_DIR"] or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:
        return None


def _writable_temporary_folder() -> Path | None:
    """Return this user's temporary folder: what is kept there is run, so nobody else may write it. None without one."""
    try:
        folder = own_temporary_folder()
        folder.mkdir(mode=0o700, exist_ok=True)
    except (OSError, NoTemporaryFolder):
        return None
    return folder if is_own(folder) and _may_write(folder) else None


def _may_write(folder: Path) -> bool:
    """Decide by writing: on a full disk an empty file can still be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(_TRIED_BYTES))
            file.flush()
            os.fsync(file.fileno())
    except OSError:
        return False
    return True


def _holds_something(folder: Path) -> bool:
    try:
        return any(folder.iterdir())
    except OSError:
        return False


def _cache_folder() -> Path | None:
    """Return the folder of the cache, which may be one that can only be read; None when none can be had."""
    name = f"farhand/kernels-{_content_hash()}"
    usual = _usual_folder()
    if usual is not None and (_holds_something(usual / name) or _may_write(usual / name)):
        drop_old(usual / name)
        return usual / name
    temporary = _writable_temporary_folder()
    where = "the user has no home" if usual is None else f"{usual} cannot be written"
    _log.warning("compiled functions are kept in %s: %s; %s", temporary or "no folder", where, _REMEDY)
    if temporary is not None:
        os.environ["XDG_CACHE_HOME"] = str(temporary)  # for child processes, which need not say it again
        return temporary / name
    return None


def drop_old(present: Path) -> None:
    """Note that a folder of compiled functions is used, and delete the others that nobody has used for long.

    The newest few stay, and whatever was used within the hour: its process may still read there. Several processes
    may do this at once; each folder is renamed by one of them, then deleted.
    """
    with contextlib.suppress(OSError):
        os.utime(present)
        others = [each for each in present.parent.glob("kernels-*") if each != present]
        used_s = {each: each.stat().st_mtime for each in others}
        for old in sorted(others, key=lambda each: used_s[each], reverse=True)[_MOST_OTHERS:]:
            if time.time() - used_s[old] > _IN_USE_S:
                dropped = old.with_name(f"dropped-{os.getpid()}-{old.name}")
                old.rename(dropped)
                shutil.rmtree(dropped, ignore_errors=True)


class _Locator(UserProvidedCacheLocator):
    """The folder of `config.CACHE_DIR`, also where it may only be read."""

    def ensure_cache_path(self) -> None:
        """Make the folder if that is possible."""
        with contextlib.suppress(OSError):
            Path(self.get_cache_path()).mkdir(parents=True, exist_ok=True)


class _CacheImpl(CompileResultCacheImpl):
    _locator_classes = (_Locator,)


class _Cache(FunctionCache):
    """A cache whose faults cost time and a line."""

    _impl_class = _CacheImpl
    _told = False

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was kept of a signature; None when that is nothing, or damaged: then it is compiled."""
        found = None
        try:
            found = super().load_overload(sig, target_context)
        except Exception as error:
            self._tell("read", error)
            with contextlib.suppress(OSError):
                self.flush()  # else a damaged index would be read again at every start
        if found is None:
            say_compiling("once on this machine")
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled, if there is room."""
        try:
            self._impl.locator.ensure_cache_path()  # somebody may have deleted the folder
            super().save_overload(sig, data)
        except Exception as error:
            self._tell("kept", error)

    def _tell(self, verb: str, error: Exception) -> None:
        if not _Cache._told:
            _Cache._told = True
            _log.warning(
                "compiled functions cannot be %s in %s (%s), which costs up to a minute; %s",
                verb, self.cache_path, error, _REMEDY,
            )  # fmt: skip


@cache
def say_compiling(how_often: str) -> None:
    """Say, once in a process, that it takes a while until the method runs."""
    _log.info("compiling the method, %s: about 20 s, up to a minute on a busy one", how_often)


_FOLDER = _cache_folder()
config.__dict__["CACHE_DIR"] = str(_FOLDER or "")  # what the variable NUMBA_CACHE_DIR sets


def kernel_folder() -> Path | None:
    """Return where compiled functions are kept; None when nowhere."""
    return _FOLDER


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function when it is called first, or take it from the cache."""
    return _compiled(function)


def plain_kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that makes no array, without counting references to those that it is given.

    Counting costs 20 ns for every part of an array that a function is handed, more than most of these compute for.
    Numba refuses a function that needs memory: one that makes an array, or assigns one to a part of another.
    """
    return _compiled(function, _nrt=False)


def _compiled(function: Callable[..., Any], **options: Any) -> Any:
    dispatcher: Any = njit(error_model="numpy", **options)(function)
    if _FOLDER is not None:
        dispatcher._cache = _Cache(function)
    return dispatcher
