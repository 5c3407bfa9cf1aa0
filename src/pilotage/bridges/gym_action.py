"""What a learner asks for, as numbers that can be driven."""

from __future__ import annotations

from typing import Any

import numpy as np

from pilotage.core import given
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray


def shares_of(action: Any, *shape: int) -> FloatArray:
    """An action as shares of the greatest speeds, of that shape; what is beyond them is the greatest.

    Raises
    ------
    InputError
        Where it is no array of real numbers of that shape, or one of them is NaN: a policy that has diverged
        would drive a robot that is nowhere from then on.
    """
    shares = given.array("gymnasium: action", action, *shape, finite=False)
    if np.isnan(shares).any():
        raise InputError("gymnasium: action: expected numbers from -1 to 1, found NaN")
    return np.clip(shares, -1.0, 1.0)
