"""A heading as a unit vector, turned from step to step: sines and cosines are most of a rollout's cost."""

from __future__ import annotations

import math

from pilotage.kernels.jit import kernel

SMALL_RAD = 0.25
"""To this half angle the series below leave out less than a double's last digit."""

S3, S5, S7, S9, S11 = -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0, -1.0 / 39_916_800.0
C2, C4, C6, C8, C10 = -1.0 / 2.0, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40_320.0, -1.0 / 3_628_800.0
"""Of the sine's series, divided by its argument, and of the cosine's."""


@kernel
def along_arc(
    x: float, y: float, c: float, s: float, distance: float, angle: float
) -> tuple[float, float, float, float]:
    """``exact_arc`` from a heading of cosine c and sine s: place and heading at its end.

    The norm of (c, s) stays 1 but for rounding, a few last digits after some hundred steps.
    """
    half = 0.5 * angle
    if abs(half) <= SMALL_RAD:
        q = half * half
        ratio = 1.0 + q * (S3 + q * (S5 + q * (S7 + q * (S9 + q * S11))))
        ch = 1.0 + q * (C2 + q * (C4 + q * (C6 + q * (C8 + q * C10))))
        sh = half * ratio
    else:
        ch, sh = math.cos(half), math.sin(half)
        ratio = sh / half
    mc, ms = c * ch - s * sh, s * ch + c * sh
    chord = distance * ratio
    return x + chord * mc, y + chord * ms, mc * ch - ms * sh, ms * ch + mc * sh
