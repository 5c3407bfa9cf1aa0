"""Moving bodies: tracked by constant-velocity Kalman filters, and foretold."""

from __future__ import annotations

import math

import numpy as np

from pilotage.kernels.arrays import BoolArray, FloatArray, IntArray
from pilotage.kernels.control.scan_clusters import UNUSED
from pilotage.kernels.jit import kernel

# Columns of a track: place, velocity, variances (of place, place and velocity, velocity; alike in x and y),
# number of readings, steps since the last one, place at birth.
X, Y, VX, VY, PP, PV, VV, READINGS, MISSED, X0, Y0 = range(11)
COLUMNS = 11
WALKED_M, THROUGH_M = 0.6, 0.25
"""So far from where it was first seen, which the laser sees through by so much: it walks beyond doubt."""
STRAIGHT = 0.8
"""Share of its motion by which somebody who comes straight on is nearer."""


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
    readings: int,
    stands: int,
    parks: int,
) -> tuple[BoolArray, bool]:
    """Which tracks (M, 11) do not stand, and whether one of them is of somebody who walks, or did.

    Somebody walks who is faster than ``walks_speed`` and ``WALKED_M`` from where he was first seen, if the
    laser at x, y sees ``THROUGH_M`` behind that place, or if he comes straight on, by ``STRAIGHT`` of his
    motion. Of him the place is dropped (NaN) and readings count anew from ``readings``: with ``stands``
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
            if went > WALKED_M:
                dx, dy = track[X0] - x, track[Y0] - y
                away = math.hypot(dx, dy)
                beam = round(((math.atan2(dy, dx) - first) % (2.0 * math.pi)) / step)
                seen = beam - 1 < ranges.shape[0]
                for k in range(max(beam - 1, 0), min(beam + 2, ranges.shape[0])):
                    # Also of a beam without an answer nothing is known.
                    seen = seen and ranges[k] > away + THROUGH_M
                known[i] = seen or away - math.hypot(track[X] - x, track[Y] - y) > STRAIGHT * went
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
def off_discs(
    points: FloatArray, discs: FloatArray, x: float, y: float, reach: float, tolerance: float
) -> FloatArray:
    """Points (K, 2) nearer to (x, y) than ``reach``, and farther than ``tolerance`` from each disc (N, 3)."""
    out = np.empty_like(points)
    count = 0
    for k in range(points.shape[0]):
        px, py = points[k, 0], points[k, 1]
        if math.hypot(px - x, py - y) >= reach:
            continue
        off = True
        for i in range(discs.shape[0]):
            if math.hypot(px - discs[i, 0], py - discs[i, 1]) - discs[i, 2] <= tolerance:
                off = False
                break
        if off:
            out[count] = points[k]
            count += 1
    return out[:count].copy()
