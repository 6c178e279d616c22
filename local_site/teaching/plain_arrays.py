"""The plain arrays of a `.npz` file; nothing in it is ever unpickled."""

from __future__ import annotations

import zipfile
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from farhand.common.errors import InvalidDemonstration


def plain_arrays(path: Path | str) -> dict[str, NDArray]:
    """All arrays of a `.npz` file, without unpickling anything.

    Raises:
        InvalidDemonstration: Naming the file, when it cannot be read or is of another kind.
    """
    try:
        with Path(path).open("rb") as file:  # numpy leaves a file open that it does not understand
            archive = np.load(file, allow_pickle=False)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise ValueError("not an archive")
            with archive:
                return {name: archive[name] for name in archive.files}
    except OSError as error:
        raise InvalidDemonstration(
            str(path), "", f"a readable .npz file ({error.strerror or error})"
        ) from error
    except (ValueError, EOFError, KeyError, NotImplementedError, zipfile.BadZipFile, zlib.error) as error:
        raise InvalidDemonstration(str(path), "", "a whole .npz file of plain arrays") from error
