"""A disc that drives among walls: it stops at the first contact."""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.motion import exact_arc
from pilotage.kernels.geometry.plane import distance_to_nearest
from pilotage.kernels.jit import kernel

CONTACT_TOLERANCE_M = 1e-9
BISECTIONS = 40


@kernel
def advance_disc(
    x: float,
    y: float,
    theta: float,
    distance: float,
    angle: float,
    radius: float,
    clearance: float,
    segments: FloatArray,
    circles: FloatArray,
) -> tuple[float, float, float, float, float]:
    """Drive an arc as far as the disc can.

    Parameters
    ----------
    clearance
        Distance from the disc's edge to the nearest obstacle at the start.

    Returns
    -------
    x, y, theta, fraction, clearance
        Where it stands, the fraction of the arc driven (below 1 after a contact) and the clearance there.
    """
    ex, ey, etheta = exact_arc(x, y, theta, distance, angle)
    end = distance_to_nearest(ex, ey, segments, circles) - radius
    # Clearance is 1-Lipschitz in position: from here no contact can happen on the way.
    if clearance > abs(distance) or (distance == 0.0):
        return ex, ey, etheta, 1.0, end
    pieces = max(1, math.ceil(abs(distance) / (0.25 * radius)))
    last, last_clearance = 0.0, clearance
    for i in range(pieces):
        part = (i + 1) / pieces
        px, py, _ = exact_arc(x, y, theta, part * distance, part * angle)
        here = distance_to_nearest(px, py, segments, circles) - radius
        # Leaving a contact is allowed: only a clearance that is negative and shrinking stops the disc.
        if here < -CONTACT_TOLERANCE_M and here < last_clearance:
            low, high = last, part
            for _ in range(BISECTIONS):
                middle = 0.5 * (low + high)
                mx, my, _ = exact_arc(x, y, theta, middle * distance, middle * angle)
                if distance_to_nearest(mx, my, segments, circles) - radius < 0.0:
                    high = middle
                else:
                    low = middle
            sx, sy, stheta = exact_arc(x, y, theta, low * distance, low * angle)
            return sx, sy, stheta, low, distance_to_nearest(sx, sy, segments, circles) - radius
        last, last_clearance = part, here
    return ex, ey, etheta, 1.0, end
