"""The first lines of every `farhand` process: its own code, and an end on Ctrl-C, before anything else is imported.

Child processes run this file by its path (`own_command`). `python -m` would put the working directory before
everything that is imported, and a PYTHONPATH with an empty part does so too: a folder `farhand/` or a file
`queue.py` that happens to stand there would be run in place of ours.
"""

import _signal  # pyright: ignore[reportMissingImports]  (the interpreter's: what `signal` imports takes long enough for a Ctrl-C)

if __name__ == "__main__" and _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
    # Until something needs an orderly end, Ctrl-C simply ends the process: imports take a second.
    _signal.signal(_signal.SIGINT, _signal.SIG_DFL)

import os
import signal
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
"""The folder that holds the package of this very program."""

PACKAGE = "farhand"


class OwnPackage:
    """Finds Farhand's package in `ROOT`, whatever else `sys.path` offers under its name."""

    @staticmethod
    def find_spec(name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Return where our package is; None for everything else."""
        return PathFinder.find_spec(name, [ROOT]) if name == PACKAGE else None


sys.meta_path.insert(0, OwnPackage)  # on import: a pool's processes import this file too, and call nothing


def own_command(*arguments: str) -> list[str]:
    """Return the words that start another `farhand` process with the code of this one, from any folder.

    Args:
        arguments: Arguments of the `farhand` command.
    """
    # -P keeps the folder of this file off the path as well: it holds files with common names.
    return [sys.executable, "-P", os.path.join(ROOT, PACKAGE, "deploy", "entry.py"), *arguments]


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command line, see `farhand.deploy.cli.main`."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    # On small matrices more BLAS threads only cost time. numpy reads this when it is imported.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # For the processes of a pool, which Python starts on its own.
    os.environ["PYTHONSAFEPATH"] = "1"
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words == ["--version"]:
        return _say_version()
    from farhand.deploy.cli import main

    status, link = main(words), sys.modules.get("farhand.common.link.session")
    if arguments is None and link is not None and link.are_closing():
        os._exit(status)  # all is done; a connection that is being closed may take ten seconds more
    return status


def _say_version() -> int:
    """Print the version, and import nothing for it that takes time."""
    from farhand.common.version import installed_version
    from farhand.deploy.standard_streams import standard_streams

    with standard_streams() as streams:
        sys.stdout.write(f"farhand {installed_version()}\n")
        return streams.final_status(0)


if __name__ == "__main__":
    sys.exit(run())
