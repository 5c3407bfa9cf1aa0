"""Arrays of a MATLAB file, or one line on why there are none."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pilotage.core.errors import InputError


def load_mat(path: Path, names: Sequence[str]) -> dict[str, Any]:
    """Read the named arrays of a MATLAB file (level 5; those that are there).

    Raises
    ------
    InputError
        Where it cannot be read or is no such file.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    # What its parser stumbles over in a broken file comes as nearly anything.
    broken = (MatReadError, OSError, ValueError, TypeError, KeyError, IndexError, EOFError, zlib.error)
    try:
        return dict(loadmat(path, variable_names=list(names)))
    except NotImplementedError:
        raise InputError(
            f"{path}: expected a MATLAB file up to level 7, found one of 7.3 (HDF5); save it with -v7"
        ) from None
    except (*broken, OverflowError, MemoryError) as error:
        raise InputError(f"{path}: expected a MATLAB file with {', '.join(names)}, found: {error}") from None
