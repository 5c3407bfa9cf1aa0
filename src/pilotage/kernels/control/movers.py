"""Moving bodies: clusters of scan points, tracked by constant-velocity Kalman filters, and foretold."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.control.footprint import polygon_distance
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel

# Columns of a track: place, velocity, variances (of place, place and velocity, velocity; alike in x and y),
# number of readings, steps since the last one, place at birth.
X, Y, VX, VY, PP, PV, VV, READINGS, MISSED, X0, Y0 = range(11)
COLUMNS = 11
UNUSED = -1
NOTCH_M = 0.08
"""Two people side by side, of 0.25 m radius, leave a notch twice as deep between them."""
CLOSES_M = 1e-4
"""Of rounding: less is no motion towards anybody, and no speed."""
AWAY = 0.3
"""Share of its motion by which a robot gains distance from those whom it drives away from."""
SHIFT_M = 0.18
"""Mean of what a laser sees of a body of 0.25 m radius lies so far in front of its middle."""


@kernel
def scan_clusters(
    x: float, y: float, points: FloatArray, gap: float, widest: float, least: int
) -> tuple[FloatArray, IntArray]:
    """Centres (C, 2) of the clusters of scan points (N, 2) in the order of the beams, and each point's (N,).

    A cluster ends where two points are farther apart than ``gap``; those wider than ``widest`` or of fewer
    than ``least`` points are none (-1), but for one of up to twice the width with a notch in it: two bodies
    side by side. A centre is shifted away from the sensor at x, y by what a round body hides.
    """
    count = points.shape[0]
    centres = np.empty((count, 2))
    of_point = np.full(count, UNUSED)
    found = 0
    begin = 0
    for k in range(1, count + 1):
        joined = k < count
        if joined:
            dx, dy = points[k, 0] - points[k - 1, 0], points[k, 1] - points[k - 1, 1]
            joined = dx * dx + dy * dy <= gap * gap
        if joined:
            continue
        width = math.hypot(points[k - 1, 0] - points[begin, 0], points[k - 1, 1] - points[begin, 1])
        cut = k
        if widest < width <= 2.0 * widest:
            cut = _notch(points, begin, k)
        for first, end in ((begin, cut), (cut, k)):
            if end - first < least:
                continue
            last = end - 1
            width = math.hypot(points[last, 0] - points[first, 0], points[last, 1] - points[first, 1])
            if width > widest:
                continue
            mx, my = 0.0, 0.0
            for i in range(first, end):
                mx += points[i, 0]
                my += points[i, 1]
                of_point[i] = found
            mx /= end - first
            my /= end - first
            away = max(math.hypot(mx - x, my - y), 1e-6)
            centres[found, 0] = mx + SHIFT_M * (mx - x) / away
            centres[found, 1] = my + SHIFT_M * (my - y) / away
            found += 1
        begin = k
    return centres[:found], of_point


@kernel
def cut_off(
    points: FloatArray, beams: IntArray, ranges: FloatArray, reach: float, gap: float, around: bool
) -> BoolArray:
    """Which points (N, 2) belong to a thing of which no more is seen than the end of the view shows.

    They are in the order of the ``beams`` (N,) of the scan (B,) that met them. A thing, points no farther
    apart than ``gap``, is cut off by the first and the last beam of a scan that does not look all
    ``around``, and by the ``reach`` where a beam beside it ends less than ``gap`` beyond that: what of it is
    seen moves as the robot does.
    """
    count = points.shape[0]
    out = np.zeros(count, np.bool_)
    begin, cut = 0, False
    for k in range(count):
        for beside in (beams[k] - 1, beams[k] + 1):
            if 0 <= beside < ranges.shape[0]:
                cut = cut or reach <= ranges[beside] < reach + gap
            else:
                cut = cut or not around
        ends = k == count - 1
        if not ends:
            dx, dy = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
            ends = dx * dx + dy * dy > gap * gap
        if ends:
            out[begin : k + 1] = cut
            begin, cut = k + 1, False
    return out


@kernel
def _notch(points: FloatArray, begin: int, end: int) -> int:
    """Where to cut a cluster that two round bodies make: the deepest point behind both their fronts.

    A front is the point that sticks out most to the sensor's side of the cluster's chord, on either side of
    the cut. ``end`` where nothing is as deep as ``NOTCH_M``: a wall has no notch, and a corner no fronts.
    """
    ax, ay = points[begin, 0], points[begin, 1]
    bx, by = points[end - 1, 0], points[end - 1, 1]
    length = math.hypot(bx - ax, by - ay)
    # Beams run counter-clockwise: the sensor is on the left of the chord from the first to the last point.
    nx, ny = -(by - ay) / length, (bx - ax) / length
    best, at = NOTCH_M, end
    total = end - begin
    right = np.empty(total)
    most = -math.inf
    for i in range(end - 1, begin - 1, -1):
        most = max(most, (points[i, 0] - ax) * nx + (points[i, 1] - ay) * ny)
        right[i - begin] = most
    left = -math.inf
    for i in range(begin, end):
        here = (points[i, 0] - ax) * nx + (points[i, 1] - ay) * ny
        left = max(left, here)
        front = min(left, right[i - begin])
        depth = front - here
        if depth > best and front > 0.5 * NOTCH_M:
            best, at = depth, i
    return at


@kernel
def _acceleration_var(track: FloatArray, acceleration_std: float, turning_std: float) -> float:
    """Variance of a body's acceleration: who is fast turns and brakes by more, in rad/s times the speed."""
    vx, vy = track[VX], track[VY]
    variance: float = max(
        acceleration_std * acceleration_std, turning_std * turning_std * (vx * vx + vy * vy)
    )
    return variance


@kernel
def track_step(
    tracks: FloatArray,
    centres: FloatArray,
    dt: float,
    place_std: float,
    acceleration_std: float,
    turning_std: float,
    lasts: float,
    gate: float,
    likeliest: bool,
    most_missed: int,
) -> tuple[FloatArray, IntArray]:
    """One step of all tracks (M, 11): predict, take the nearest centre (C, 2), begin and end tracks.

    Constant velocity with acceleration noise (``_acceleration_var``), drawn anew after ``lasts`` seconds, or
    after a step if that is longer: the spectral density of white noise is the variance times that time.
    The pair nearest in standard deviations comes first, or the ``likeliest`` in the gate (both wrong where
    two bodies meet): the former gives the centre of a sure track to a vague one, of who was not seen for a
    while. Returns the tracks (M', 11) and the track of each centre (C,).
    """
    m, c = tracks.shape[0], centres.shape[0]
    out = np.empty((m + c, COLUMNS))
    r = place_std * place_std
    moved = tracks.copy()
    for i in range(m):
        q = _acceleration_var(tracks[i], acceleration_std, turning_std) * max(1.0, lasts / dt)
        moved[i, X] += dt * moved[i, VX]
        moved[i, Y] += dt * moved[i, VY]
        moved[i, PP] += 2.0 * dt * moved[i, PV] + dt * dt * moved[i, VV] + q * dt**4 / 4.0
        moved[i, PV] += dt * moved[i, VV] + q * dt**3 / 2.0
        moved[i, VV] += q * dt * dt
    of_centre = np.full(c, UNUSED)
    taken = np.zeros(m, np.bool_)
    for _ in range(min(m, c)):
        best, bi, bj = math.inf, -1, -1
        for i in range(m):
            if taken[i]:
                continue
            s = moved[i, PP] + r
            vague = 2.0 * math.log(s) if likeliest else 0.0
            for j in range(c):
                if of_centre[j] >= 0:
                    continue
                dx, dy = centres[j, 0] - moved[i, X], centres[j, 1] - moved[i, Y]
                d2 = (dx * dx + dy * dy) / s
                if d2 < gate * gate and d2 + vague < best:
                    best, bi, bj = d2 + vague, i, j
        if bi < 0:
            break
        taken[bi] = True
        of_centre[bj] = bi
        s = moved[bi, PP] + r
        k1, k2 = moved[bi, PP] / s, moved[bi, PV] / s
        dx, dy = centres[bj, 0] - moved[bi, X], centres[bj, 1] - moved[bi, Y]
        moved[bi, X] += k1 * dx
        moved[bi, Y] += k1 * dy
        moved[bi, VX] += k2 * dx
        moved[bi, VY] += k2 * dy
        moved[bi, VV] -= k2 * moved[bi, PV]
        moved[bi, PV] *= 1.0 - k1
        moved[bi, PP] *= 1.0 - k1
        moved[bi, READINGS] += 1.0
        moved[bi, MISSED] = -1.0
    kept = 0
    place = np.full(m, UNUSED)
    for i in range(m):
        moved[i, MISSED] += 1.0
        if moved[i, MISSED] <= most_missed:
            out[kept] = moved[i]
            place[i] = kept
            kept += 1
    for j in range(c):
        if of_centre[j] >= 0:
            of_centre[j] = place[of_centre[j]]
            continue
        out[kept, X], out[kept, Y] = centres[j, 0], centres[j, 1]
        out[kept, VX], out[kept, VY] = 0.0, 0.0
        out[kept, PP], out[kept, PV], out[kept, VV] = r, 0.0, 1.0
        out[kept, READINGS], out[kept, MISSED] = 1.0, 0.0
        out[kept, X0], out[kept, Y0] = centres[j, 0], centres[j, 1]
        of_centre[j] = kept
        kept += 1
    return out[:kept], of_centre


@kernel
def keep_unseen(
    tracks: FloatArray,
    x: float,
    y: float,
    theta: float,
    first: float,
    last: float,
    lost_var: float,
    readings: int,
    most_missed: int,
) -> None:
    """Readings of tracks (M, 11) cannot be missed where no beam goes; in place.

    Beams of a sensor at x, y look from ``first`` to ``last``, seen from ``theta``. A track goes on so until
    its place is vaguer than ``lost_var``.
    """
    for i in range(tracks.shape[0]):
        bearing = math.atan2(tracks[i, Y] - y, tracks[i, X] - x) - theta
        unseen = (bearing - first) % (2.0 * math.pi) > last - first
        if unseen and tracks[i, PP] < lost_var and tracks[i, READINGS] >= readings:
            tracks[i, MISSED] = min(tracks[i, MISSED], most_missed - 1.0)


@kernel
def tell_walkers(
    tracks: FloatArray,
    x: float,
    y: float,
    first: float,
    step: float,
    ranges: FloatArray,
    about: bool,
    walks_speed: float,
    unsure_var: float,
    walked: float,
    through: float,
    straight: float,
    readings: int,
    stands: int,
    parks: int,
) -> tuple[BoolArray, bool]:
    """Which tracks (M, 11) do not stand, and whether one of them is of somebody who walks, or did.

    Somebody walks who is faster than ``walks_speed`` and ``walked`` so far from where he was first seen, if
    the laser at x, y sees ``through`` behind that place, or if he comes ``straight`` on, by that share of
    his motion. Of him the place is dropped (NaN) and readings count anew from ``readings``: with ``stands``
    more he stands, with ``parks`` more he is a thing. Others do not stand only while people are ``about``.
    """
    out = np.zeros(tracks.shape[0], np.bool_)
    people = False
    fast_or_unsure = np.zeros(tracks.shape[0], np.bool_)
    known = np.zeros(tracks.shape[0], np.bool_)
    for i in range(tracks.shape[0]):
        track = tracks[i]
        unsure = track[VV] > unsure_var
        fast = math.hypot(track[VX], track[VY]) > walks_speed
        fast_or_unsure[i] = fast or unsure
        known[i] = math.isnan(track[X0])
        # Where nothing was seen it has gone by its own foretelling only.
        if fast and not unsure and not known[i] and track[MISSED] == 0.0:
            went = math.hypot(track[X] - track[X0], track[Y] - track[Y0])
            if went > walked:
                dx, dy = track[X0] - x, track[Y0] - y
                away = math.hypot(dx, dy)
                beam = round(((math.atan2(dy, dx) - first) % (2.0 * math.pi)) / step)
                seen = beam - 1 < ranges.shape[0]
                for k in range(max(beam - 1, 0), min(beam + 2, ranges.shape[0])):
                    # Also of a beam without an answer nothing is known.
                    seen = seen and ranges[k] > away + through
                known[i] = seen or away - math.hypot(track[X] - x, track[Y] - y) > straight * went
        if known[i] and fast and not unsure:
            track[READINGS], track[X0] = readings, math.nan
        if not known[i]:
            continue
        stood = track[READINGS] - readings
        if stood >= parks:
            track[X0], track[Y0] = track[X], track[Y]
        else:
            people = True
            out[i] = stood < stands
    for i in range(tracks.shape[0]):
        out[i] = out[i] or (fast_or_unsure[i] and (known[i] or about or people))
    return out, people


@kernel
def foretold(
    tracks: FloatArray,
    first: float,
    dt: float,
    steps: int,
    radius: float,
    deviations: float,
    acceleration_std: float,
    turning_std: float,
) -> FloatArray:
    """Discs (steps, M, 3) x, y, radius where tracks (M, 11) will be at ``first``, ``first`` + dt, ...

    The velocity stays; the radius grows by so many standard deviations of the foretold place.
    """
    m = tracks.shape[0]
    out = np.empty((steps, m, 3))
    for i in range(m):
        q = _acceleration_var(tracks[i], acceleration_std, turning_std)
        for k in range(steps):
            t = first + k * dt
            out[k, i, 0] = tracks[i, X] + t * tracks[i, VX]
            out[k, i, 1] = tracks[i, Y] + t * tracks[i, VY]
            variance = tracks[i, PP] + 2.0 * t * tracks[i, PV] + t * t * tracks[i, VV] + q * t**4 / 4.0
            out[k, i, 2] = radius + deviations * math.sqrt(max(variance, 0.0))
    return out


@kernel
def movers_clearance(
    x: float, y: float, theta: float, polygon: FloatArray, outer: float, movers: FloatArray, enough: float
) -> float:
    """Least distance of a footprint to discs (M, 3) at one time, at most ``enough``; negative inside."""
    best = enough
    c, s = math.cos(theta), math.sin(theta)
    for i in range(movers.shape[0]):
        dx, dy = movers[i, 0] - x, movers[i, 1] - y
        if math.sqrt(dx * dx + dy * dy) - movers[i, 2] - outer >= best:
            continue
        best = min(best, polygon_distance(c * dx + s * dy, c * dy - s * dx, polygon) - movers[i, 2])
    return best


@kernel
def closes_in(
    before: tuple[float, float, float],
    after: tuple[float, float, float],
    polygon: FloatArray,
    outer: float,
    movers: FloatArray,
    keep: float,
) -> bool:
    """Whether a footprint's own motion brings it nearer to one of the discs (M, 3) that is within ``keep``.

    The discs stand while it moves, from pose to pose: who drives away, and not merely past (``AWAY``: places
    are vague), closes no gap. Who turns on the spot swings corners to all sides, and counts as the disc of
    radius ``outer``.
    """
    x, y, theta = after
    x0, y0, theta0 = before
    moved = math.hypot(x - x0, y - y0)
    spins = abs(wrap(theta - theta0)) * outer > moved
    c, s = math.cos(theta), math.sin(theta)
    for i in range(movers.shape[0]):
        dx, dy = movers[i, 0] - x, movers[i, 1] - y
        reach = movers[i, 2] + keep
        if math.sqrt(dx * dx + dy * dy) - outer >= reach:
            continue
        if spins:
            return True
        away = polygon_distance(c * dx + s * dy, c * dy - s * dx, polygon)
        if away >= reach:
            continue
        c0, s0 = math.cos(theta0), math.sin(theta0)
        dx, dy = movers[i, 0] - x0, movers[i, 1] - y0
        if away < polygon_distance(c0 * dx + s0 * dy, c0 * dy - s0 * dx, polygon) + AWAY * moved - CLOSES_M:
            return True
    return False


@kernel
def drive_closes_in(
    x: float,
    y: float,
    theta: float,
    v: float,
    w: float,
    hold: float,
    deceleration: float,
    dt: float,
    radius: float,
    swings: bool,
    movers: FloatArray,
    keep: float,
) -> bool:
    """Whether a command, held and then braked from along its arc, brings a disc nearer to somebody.

    ``movers`` (K, M, 3): discs at dt, 2 dt, ...; beyond the last ones time stands. Only those count that are
    within ``keep`` by then, and each stands while the robot moves: who drives away, and not merely past
    (``AWAY``: places are vague), closes no gap. ``swings``: a body in the disc that is no disc itself may
    not turn there either.
    """
    rate = w / v if v != 0.0 else 0.0
    speed, t = v, 0.0
    for k in range(10 * movers.shape[0]):
        if t >= hold:
            left = abs(speed) - deceleration * dt
            if left <= CLOSES_M:
                return False
            speed = math.copysign(left, speed)
        turn = (rate * speed if v != 0.0 else w) * dt
        middle = theta + 0.5 * turn
        nx, ny = x + speed * dt * math.cos(middle), y + speed * dt * math.sin(middle)
        discs = movers[min(k, movers.shape[0] - 1)]
        for i in range(discs.shape[0]):
            px, py = discs[i, 0], discs[i, 1]
            after = math.hypot(px - nx, py - ny)
            if after >= radius + discs[i, 2] + keep:
                continue
            gained = after - math.hypot(px - x, py - y)
            if (swings and turn != 0.0) or gained < AWAY * abs(speed) * dt:
                return True
        x, y, theta, t = nx, ny, theta + turn, t + dt
    return True
