"""The EKF whose state holds, after the pose, the slowly varying errors of drive and sensor.

State (8 + L): x, y, theta; relative errors of speed and turn rate; course (direction of travel less
heading); bearing offset; relative range error of the sensor and, beside it, of each landmark. Each
error is a first-order Gauss-Markov process,
e <- e exp(-dt / tau), which keeps its stationary variance (Bar-Shalom et al. 2001, sect. 8.2 and 11.9).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pilotage.kernels.jit import kernel
from pilotage.kernels.motion import wrap

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SPEED, TURN, COURSE, BEARING, SCALE, RANGES = 3, 4, 5, 6, 7, 8
"""Places in the state: the errors after the pose, and the first landmark's range error."""
MIN_COSINE = 0.2
"""A depth says nothing of what lies abeam: a bearing beyond 78 degrees counts as one of 78."""

OUTCOME_ACCEPTED = 1
OUTCOME_GATED = 0
OUTCOME_UNKNOWN = -1


@kernel
def predict(
    state: FloatArray,
    cov: FloatArray,
    distance: float,
    angle: float,
    dt: float,
    position_var: float,
    angle_var: float,
    rates: FloatArray,
    stationary: FloatArray,
) -> None:
    """Move ``state`` (N,) and ``cov`` (N, N) in place by an increment of ``dt`` seconds.

    The true increment is distance (1 + e_v), angle (1 + e_w) along the heading plus the course; the
    distance's and angle's variances are those of the increment, white from step to step.

    Parameters
    ----------
    rates
        (N,) 1 / tau of each error, 0 for a constant one; the pose's are not looked at.
    stationary
        (N,) variances that the errors settle at.
    """
    n = state.shape[0]
    d, a = distance * (1.0 + state[SPEED]), angle * (1.0 + state[TURN])
    middle = state[2] + state[COURSE] + 0.5 * a
    c, s = math.cos(middle), math.sin(middle)
    state[0] += d * c
    state[1] += d * s
    state[2] = wrap(state[2] + a)
    # F differs from the identity in the pose's rows only: theta, speed, turn, course.
    columns = (2, SPEED, TURN, COURSE)
    fx = (-d * s, distance * c, -0.5 * d * s * angle, -d * s)
    fy = (d * c, distance * s, 0.5 * d * c * angle, d * c)
    for j in range(n):  # F P
        px, py = 0.0, 0.0
        for k in range(4):
            value = cov[columns[k], j]
            px += fx[k] * value
            py += fy[k] * value
        turned = angle * cov[TURN, j]
        cov[0, j] += px
        cov[1, j] += py
        cov[2, j] += turned
    for i in range(n):  # (F P) F'
        px, py = 0.0, 0.0
        for k in range(4):
            value = cov[i, columns[k]]
            px += fx[k] * value
            py += fy[k] * value
        turned = angle * cov[i, TURN]
        cov[i, 0] += px
        cov[i, 1] += py
        cov[i, 2] += turned
    # White noise of the increment: along the direction of travel, and of the turn.
    cx, cy = -0.5 * d * s, 0.5 * d * c
    cov[0, 0] += c * c * position_var + cx * cx * angle_var
    cov[1, 1] += s * s * position_var + cy * cy * angle_var
    cov[2, 2] += angle_var
    cov[0, 1] += c * s * position_var + cx * cy * angle_var
    cov[0, 2] += cx * angle_var
    cov[1, 2] += cy * angle_var
    cov[1, 0], cov[2, 0], cov[2, 1] = cov[0, 1], cov[0, 2], cov[1, 2]
    for i in range(SPEED, n):
        if rates[i] == 0.0:
            continue
        kept = math.exp(-dt * rates[i])
        state[i] *= kept
        for j in range(n):
            cov[i, j] *= kept
            cov[j, i] *= kept
        cov[i, i] += stationary[i] * (1.0 - kept * kept)
    for i in range(n):
        for j in range(i + 1, n):
            value = 0.5 * (cov[i, j] + cov[j, i])
            cov[i, j] = value
            cov[j, i] = value


@kernel
def range_of_depth(reading: float, bearing: float, depth: float) -> float:
    """Range of a reading r cos(bearing)^depth: ``depth`` 0 is a range already, 1 a camera's depth.

    By the bearing as it was read, not as the pose predicts it: the camera's axis is known no better than
    the bearing offset, and thousands of depths would pretend to measure the heading by it.
    """
    if depth == 0.0:
        return reading
    return float(reading / max(math.cos(bearing), MIN_COSINE) ** depth)


@kernel
def measure(
    state: FloatArray, mx: float, my: float, index: int, mount: FloatArray, z: FloatArray, H: FloatArray
) -> bool:
    """Predict range and bearing (2,) of landmark ``index`` and the rows' six slopes H (2, 6).

    H's columns: x, y, theta, the bearing offset, the sensor's range error, the landmark's. False where
    landmark and sensor coincide. Thrun et al. 2005, eq. 7.12-7.14, for a sensor off the axle whose range
    reads r (1 + errors).
    """
    c, s = math.cos(state[2]), math.sin(state[2])
    ox, oy = c * mount[0] - s * mount[1], s * mount[0] + c * mount[1]
    dx, dy = mx - (state[0] + ox), my - (state[1] + oy)
    q = dx * dx + dy * dy
    if q <= 1e-18:
        return False
    r = math.sqrt(q)
    factor = 1.0 + state[SCALE] + state[RANGES + index]
    z[0] = r * factor
    z[1] = wrap(math.atan2(dy, dx) - state[2] - mount[2] + state[BEARING])
    H[0, 0], H[0, 1], H[0, 2] = -dx / r * factor, -dy / r * factor, (dx * oy - dy * ox) / r * factor
    H[0, 3], H[0, 4], H[0, 5] = 0.0, r, r
    H[1, 0], H[1, 1], H[1, 2] = dy / q, -dx / q, -1.0 - (dx * ox + dy * oy) / q
    H[1, 3], H[1, 4], H[1, 5] = 1.0, 0.0, 0.0
    return True


@kernel
def joseph_update(
    state: FloatArray,
    cov: FloatArray,
    places: IntArray,
    H: FloatArray,
    innovation: FloatArray,
    R: FloatArray,
    gate: float,
) -> float:
    """Update in place by a pair of measurements that depend on ``places`` (6,) of the state only.

    Returns the squared Mahalanobis distance, beyond ``gate`` nothing is changed; nan where the innovation
    covariance is not positive. Joseph form, (I - K H) P (I - K H)' + K R K', multiplied out as
    P - K (P H')' - (P H') K' + K S K'.
    """
    n = state.shape[0]
    PH = np.zeros((n, 2))
    for i in range(n):
        for k in range(6):
            value = cov[i, places[k]]
            PH[i, 0] += value * H[0, k]
            PH[i, 1] += value * H[1, k]
    s00, s01, s11 = R[0, 0], R[0, 1], R[1, 1]
    for k in range(6):
        s00 += H[0, k] * PH[places[k], 0]
        s01 += H[0, k] * PH[places[k], 1]
        s11 += H[1, k] * PH[places[k], 1]
    determinant = s00 * s11 - s01 * s01
    if not determinant > 0.0:
        return math.nan
    i00, i01, i11 = s11 / determinant, -s01 / determinant, s00 / determinant
    v0, v1 = innovation[0], innovation[1]
    nis = v0 * (i00 * v0 + i01 * v1) + v1 * (i01 * v0 + i11 * v1)
    if nis > gate:
        return float(nis)
    K = np.empty((n, 2))
    for i in range(n):
        K[i, 0] = PH[i, 0] * i00 + PH[i, 1] * i01
        K[i, 1] = PH[i, 0] * i01 + PH[i, 1] * i11
        state[i] += K[i, 0] * v0 + K[i, 1] * v1
    state[2] = wrap(state[2])
    for i in range(n):
        ks0, ks1 = K[i, 0] * s00 + K[i, 1] * s01, K[i, 0] * s01 + K[i, 1] * s11
        for j in range(i, n):
            value = (
                cov[i, j]
                - K[i, 0] * PH[j, 0]
                - K[i, 1] * PH[j, 1]
                - PH[i, 0] * K[j, 0]
                - PH[i, 1] * K[j, 1]
                + ks0 * K[j, 0]
                + ks1 * K[j, 1]
            )
            cov[i, j] = value
            cov[j, i] = value
    return float(nis)


@kernel
def update_range_bearings(
    state: FloatArray,
    cov: FloatArray,
    ids: IntArray,
    ranges: FloatArray,
    bearings: FloatArray,
    known_ids: IntArray,
    known_points: FloatArray,
    mount: FloatArray,
    depth: float,
    range_var: float,
    range_var_per_m2: float,
    bearing_var: float,
    gate: float,
    nis: FloatArray,
    outcome: IntArray,
) -> int:
    """Update in place by any number of landmarks (K), one after the other; returns how many were used.

    ``known_ids`` is sorted. ``nis`` (K,) and ``outcome`` (K,) are filled: accepted, gated, unknown id. The
    range's white variance is range_var + range_var_per_m2 r^2.
    """
    z, H, R = np.empty(2), np.empty((2, 6)), np.zeros((2, 2))
    innovation = np.empty(2)
    places = np.array([0, 1, 2, BEARING, SCALE, RANGES])
    used = 0
    for k in range(ids.shape[0]):
        nis[k] = math.nan
        outcome[k] = OUTCOME_UNKNOWN
        i = np.searchsorted(known_ids, ids[k])
        if i >= known_ids.shape[0] or known_ids[i] != ids[k]:
            continue
        if not measure(state, known_points[i, 0], known_points[i, 1], i, mount, z, H):
            continue
        reading = range_of_depth(ranges[k], bearings[k], depth)
        innovation[0] = reading - z[0]
        innovation[1] = wrap(bearings[k] - z[1])
        R[0, 0] = range_var + range_var_per_m2 * reading * reading
        R[1, 1] = bearing_var
        places[5] = RANGES + i
        nis[k] = joseph_update(state, cov, places, H, innovation, R, gate)
        outcome[k] = OUTCOME_ACCEPTED if nis[k] <= gate else OUTCOME_GATED
        used += outcome[k]
    return used


@kernel
def inflate(cov: FloatArray, factor: float, floor: FloatArray) -> None:
    """Trust the pose less: its standard deviations times ``factor``, plus at least ``floor`` (3,) variances.

    Rows and columns are scaled alike, so that what the pose has in common with the errors stays in
    proportion and the covariance stays positive.
    """
    n = cov.shape[0]
    for i in range(3):
        for j in range(n):
            cov[i, j] *= factor
            cov[j, i] *= factor
    for i in range(3):
        cov[i, i] += floor[i]
