"""How much a file from outside may be, and the one setting that raises it."""

from __future__ import annotations

import math
import os

from pilotage.core.errors import InputError

VARIABLE = "PILOTAGE_LIMITS"
"""Environment variable: all limits times this number, from 1 to 1000."""
MB = 1_000_000

TEXT_BYTES = 256 * MB
"""A log or a table as text, unpacked."""
DATA_BYTES = 512 * MB
"""Arrays, packed or not: .npy, .npz, .mat, .parquet, raw heights, an image's pixels."""
VALUES_BYTES = 32 * MB
"""A file of values: YAML, JSON."""
VALUES = 1_000_000
"""Values of a YAML or JSON file, those that aliases stand for included."""
DEPTH = 64
"""Lists and mappings inside one another; no setting raises it."""
NUMBER_LENGTH = 400
"""Characters of a number: the smallest double in full has fewer digits that count."""
LARGEST = 1000.0


def limit(usual: int) -> int:
    """A limit as the user's setting has it.

    Raises
    ------
    InputError
        Where ``PILOTAGE_LIMITS`` is no number from 1 to 1000.
    """
    text = os.environ.get(VARIABLE)
    if not text:
        return usual
    try:
        factor = float(text)
    except ValueError:
        factor = math.nan
    if not 1.0 <= factor <= LARGEST:
        raise InputError(f"{VARIABLE}: expected a number from 1 to {LARGEST:g}, found '{text}'")
    return int(usual * factor)


def too_large(where: str, most: int, found: int | None, unit: str = "MB") -> InputError:
    """The error for what is over a limit.

    Parameters
    ----------
    most
        The limit as it stands, from ``limit``: bytes where the unit is MB, else a count.
    found
        What there is; None where nobody knows, because reading stopped at the limit.
    """
    scale = MB if unit == "MB" else 1
    has = "more" if found is None else f"{found / scale:,.0f} {unit}"
    return InputError(
        f"{where}: expected at most {most / scale:,.0f} {unit}, found {has}; where it is meant so, "
        f"the environment variable {VARIABLE}=N takes N times the usual limits"
    )
