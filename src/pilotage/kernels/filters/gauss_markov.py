"""The EKF whose state holds, after the pose, the Gauss-Markov errors of drive and sensor.

State (15 + 2 L): x, y, theta; of the drive: relative errors of speed and turn rate, their offsets, and
the course (direction of travel less heading); of the sensor: bearing offset, relative range error, range
offset, how far its mount lies ahead and to the left of where it should be, the age of its readings, and
the angle of a camera's optical axis; then the error of each landmark's range, and of each landmark's
bearing, in units of their standard deviations. Each error is a first-order Gauss-Markov process,
e <- e exp(-dt / tau), which keeps its stationary variance (Bar-Shalom et al. 2001, sect. 8.2 and 11.9).
"""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import FloatArray, IntArray
from pilotage.kernels.filters.sighting import (
    OUTCOME_ACCEPTED,
    OUTCOME_GATED,
    OUTCOME_UNKNOWN,
    Known,
    Seen,
    landmark_index,
)
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel

SPEED, TURN, SPEED_OFFSET, TURN_OFFSET, COURSE = 3, 4, 5, 6, 7
BEARING, SCALE, OFFSET, AHEAD, LEFT, AGE, AXIS, LANDMARKS = 8, 9, 10, 11, 12, 13, 14, 15
"""Places in the state: the errors after the pose, and the first landmark's range error."""
SLOPES = 12
"""A reading depends on the pose, the sensor's seven errors and its landmark's two."""
MIN_COSINE = 0.2
"""A depth says nothing of what lies abeam: a bearing beyond 78 degrees counts as one of 78."""
MIN_RANGE_M = 0.1
"""An error across the line of sight counts as one at this range where the landmark is closer."""


@kernel
def predict(
    state: FloatArray,
    cov: FloatArray,
    distance: float,
    angle: float,
    dt: float,
    position_var: float,
    angle_var: float,
    fading: FloatArray,
    stationary: FloatArray,
) -> None:
    """Move ``state`` (N,) and ``cov`` (N, N) in place by an increment of ``dt`` seconds.

    The true increment is distance (1 + e_v) + o_v dt, angle (1 + e_w) + o_w dt along the heading plus the
    course; the distance's and angle's variances are those of the increment, white from step to step.

    Parameters
    ----------
    fading
        (N, 3) 1 / tau of each error, and how fast it fades with the distance and the angle that the robot
        moves (one over a length in m, over an angle in rad); 0 for a constant one, and in the pose's rows.
    stationary
        (N,) variances that the errors settle at.
    """
    n = state.shape[0]
    d = distance * (1.0 + state[SPEED]) + dt * state[SPEED_OFFSET]
    a = angle * (1.0 + state[TURN]) + dt * state[TURN_OFFSET]
    middle = state[2] + state[COURSE] + 0.5 * a
    c, s = math.cos(middle), math.sin(middle)
    state[0] += d * c
    state[1] += d * s
    state[2] = wrap(state[2] + a)
    # F differs from the identity in the pose's rows only.
    columns = (2, SPEED, TURN, SPEED_OFFSET, TURN_OFFSET, COURSE)
    fx = (-d * s, distance * c, -0.5 * d * s * angle, dt * c, -0.5 * d * s * dt, -d * s)
    fy = (d * c, distance * s, 0.5 * d * c * angle, dt * s, 0.5 * d * c * dt, d * c)
    for j in range(n):  # F P
        px, py = 0.0, 0.0
        for k in range(6):
            value = cov[columns[k], j]
            px += fx[k] * value
            py += fy[k] * value
        turned = angle * cov[TURN, j] + dt * cov[TURN_OFFSET, j]
        cov[0, j] += px
        cov[1, j] += py
        cov[2, j] += turned
    for i in range(n):  # (F P) F'
        px, py = 0.0, 0.0
        for k in range(6):
            value = cov[i, columns[k]]
            px += fx[k] * value
            py += fy[k] * value
        turned = angle * cov[i, TURN] + dt * cov[i, TURN_OFFSET]
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
    kept = np.ones(n)
    for i in range(SPEED, n):
        past = fading[i - 1]
        if fading[i, 0] == past[0] and fading[i, 1] == past[1] and fading[i, 2] == past[2]:
            kept[i] = kept[i - 1]  # neighbours mostly fade alike: one exponential for all of them
        else:
            kept[i] = math.exp(-dt * fading[i, 0] - abs(d) * fading[i, 1] - abs(a) * fading[i, 2])
        state[i] *= kept[i]
    for i in range(n):
        cov[i, i] = kept[i] * kept[i] * cov[i, i] + stationary[i] * (1.0 - kept[i] * kept[i])
        for j in range(i + 1, n):
            value = 0.5 * kept[i] * kept[j] * (cov[i, j] + cov[j, i])
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
def slant_of_depth(bearing: float, depth: float) -> float:
    """How a range made of a depth grows with the angle of the optical axis, as a fraction of the range.

    Along an axis at the angle e the depth is r cos(bearing - e), so that the range made of it is
    r (cos(bearing - e) / cos(bearing))^depth, to first order r (1 + depth tan(bearing) e).
    """
    c = max(math.cos(bearing), MIN_COSINE)
    return float(depth * math.copysign(math.sqrt(1.0 - c * c), bearing) / c)


@kernel
def measure(
    state: FloatArray,
    mx: float,
    my: float,
    places: IntArray,
    mount: FloatArray,
    motion: FloatArray,
    scales: FloatArray,
    slant: float,
    z: FloatArray,
    H: FloatArray,
) -> bool:
    """Predict range and bearing (2,) of a landmark at ``mx``, ``my`` and their slopes H (2, 12).

    False where landmark and sensor coincide. Thrun et al. 2005, eq. 7.12-7.14, for a sensor off the axle,
    from where it was when the reading was taken: r (1 + scale + slant axis) + offset + the landmark's own
    error.

    Parameters
    ----------
    places
        (12,) of the slopes in the state; the last two are the landmark's errors.
    mount
        (4,) of the sensor: x, y, theta; and the age of its readings as known before, in s.
    motion
        (2,) speed and turn rate now.
    scales
        (4,) standard deviations of a landmark's error: fraction of the range, metres along; radians,
        metres across.
    slant
        Of this reading, by `slant_of_depth`; 0 where ranges are measured as such.
    """
    v, w = motion[0], motion[1]
    age = mount[3] + state[AGE]
    course = state[2] + state[COURSE] - 0.5 * w * age
    vx, vy = v * math.cos(course), v * math.sin(course)
    x, y, theta = state[0] - age * vx, state[1] - age * vy, state[2] - age * w
    c, s = math.cos(theta), math.sin(theta)
    ahead, left = mount[0] + state[AHEAD], mount[1] + state[LEFT]
    ox, oy = c * ahead - s * left, s * ahead + c * left
    dx, dy = mx - (x + ox), my - (y + oy)
    q = dx * dx + dy * dy
    if q <= 1e-18:
        return False
    r = math.sqrt(q)
    near = max(r, MIN_RANGE_M)
    along = math.sqrt((scales[0] * r) ** 2 + scales[1] ** 2)
    across = math.sqrt(scales[2] ** 2 + (scales[3] / near) ** 2)
    factor = 1.0 + state[SCALE] + slant * state[AXIS]
    z[0] = r * factor + state[OFFSET] + along * state[places[10]]
    z[1] = wrap(math.atan2(dy, dx) - theta - mount[2] + state[BEARING] + across * state[places[11]])
    # By the place and heading that the reading was taken at ...
    rx, ry, rt = -dx / r * factor, -dy / r * factor, (dx * oy - dy * ox) / r * factor
    bx, by, bt = dy / q, -dx / q, -1.0 - (dx * ox + dy * oy) / q
    # ... which the pose now leads to: x_then = x - age v cos(course), and turned by d theta alike.
    H[0, 0], H[0, 1], H[0, 2] = rx, ry, rt + age * (rx * vy - ry * vx)
    H[1, 0], H[1, 1], H[1, 2] = bx, by, bt + age * (bx * vy - by * vx)
    H[0, 3], H[1, 3] = 0.0, 1.0
    H[0, 4], H[1, 4] = r, 0.0
    H[0, 5], H[1, 5] = 1.0, 0.0
    H[0, 6], H[1, 6] = rx * c + ry * s, bx * c + by * s
    H[0, 7], H[1, 7] = -rx * s + ry * c, -bx * s + by * c
    # The half turn inside the course is of second order in the age and left out.
    H[0, 8], H[1, 8] = -(rx * vx + ry * vy + rt * w), -(bx * vx + by * vy + bt * w)
    H[0, 9], H[1, 9] = slant * r, 0.0
    H[0, 10], H[1, 10] = along, 0.0
    H[0, 11], H[1, 11] = 0.0, across
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
    """Update in place by a pair of measurements that depend on ``places`` (12,) of the state only.

    Returns the squared Mahalanobis distance, beyond ``gate`` nothing is changed; nan where the innovation
    covariance is not positive. Joseph form, (I - K H) P (I - K H)' + K R K', multiplied out as
    P - K (P H')' - (P H') K' + K S K'.
    """
    n = state.shape[0]
    PH = np.zeros((n, 2))
    for i in range(n):
        for k in range(SLOPES):
            value = cov[i, places[k]]
            PH[i, 0] += value * H[0, k]
            PH[i, 1] += value * H[1, k]
    s00, s01, s11 = R[0, 0], R[0, 1], R[1, 1]
    for k in range(SLOPES):
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
    seen: Seen,
    known: Known,
    mount: FloatArray,
    motion: FloatArray,
    scales: FloatArray,
    depth: float,
    white: FloatArray,
    gate: float,
) -> tuple[int, FloatArray, IntArray]:
    """Update in place by any number of landmarks (K), one after the other; returns as the EKF's does.

    ``white`` (4,) is the variance that is new with every reading, white[0] + white[1] r^2 of the range and
    white[2] + white[3] / r^2 of the bearing; the rest as in `measure`.
    """
    z, H, R = np.empty(2), np.empty((2, SLOPES)), np.zeros((2, 2))
    innovation = np.empty(2)
    places = np.array([0, 1, 2, BEARING, SCALE, OFFSET, AHEAD, LEFT, AGE, AXIS, 0, 0])
    count, used = known.ids.shape[0], 0
    nis, outcome = np.empty(seen.ids.shape[0]), np.empty(seen.ids.shape[0], np.int64)
    for k in range(seen.ids.shape[0]):
        nis[k] = math.nan
        outcome[k] = OUTCOME_UNKNOWN
        i = landmark_index(known.ids, seen.ids[k])
        if i < 0:
            continue
        places[10], places[11] = LANDMARKS + i, LANDMARKS + count + i
        x, y = known.points[i, 0], known.points[i, 1]
        slant = slant_of_depth(seen.bearings[k], depth)
        if not measure(state, x, y, places, mount, motion, scales, slant, z, H):
            continue
        reading = range_of_depth(seen.ranges[k], seen.bearings[k], depth)
        innovation[0] = reading - z[0]
        innovation[1] = wrap(seen.bearings[k] - z[1])
        R[0, 0] = white[0] + white[1] * reading * reading
        R[1, 1] = white[2] + white[3] / max(reading, MIN_RANGE_M) ** 2
        nis[k] = joseph_update(state, cov, places, H, innovation, R, gate)
        outcome[k] = OUTCOME_ACCEPTED if nis[k] <= gate else OUTCOME_GATED
        used += outcome[k]
    return used, nis, outcome


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
