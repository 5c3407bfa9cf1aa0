"""The least and the greatest of a pixel's colour channels, which are a picture's last axis.

NumPy reduces an axis of three a pixel at a time; channel by channel it takes a fifteenth.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

__all__ = ["greatest_channel", "least_channel"]

N = TypeVar("N", bound=np.number[Any])


def least_channel(picture: NDArray[N]) -> NDArray[N]:
    """(..., C) to (...): how dark a pixel is at most, by its darkest colour."""
    found = picture[..., 0].copy()
    for channel in range(1, picture.shape[-1]):
        np.minimum(found, picture[..., channel], out=found)
    return found


def greatest_channel(picture: NDArray[N]) -> NDArray[N]:
    """(..., C) to (...): of differences, that of the colour that differs most."""
    found = picture[..., 0].copy()
    for channel in range(1, picture.shape[-1]):
        np.maximum(found, picture[..., channel], out=found)
    return found
