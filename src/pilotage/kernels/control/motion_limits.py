"""How a body with limited acceleration answers to commands, and where its braking ends."""

from __future__ import annotations

import math
from typing import NamedTuple

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.control.closing_in import closes_in
from pilotage.kernels.control.footprint import Body
from pilotage.kernels.control.ground import (
    Ground,
    clearance_of,
    disc_clearance,
    disc_seen,
    seen_under,
    sure_clearance,
)
from pilotage.kernels.control.heading_vector import along_arc
from pilotage.kernels.geometry.motion import exact_arc
from pilotage.kernels.jit import kernel

STOP_SPACING_M = 0.12
STOP_SPACING_RAD = 0.25
MOST_STOP_STEPS = 60


class Drive(NamedTuple):
    """Limits of a body as a kernel takes them, in SI units.

    ``reverse`` is the highest speed backwards, ``turn_acceleration`` holds for speeding up and slowing down.
    With a ``least_radius`` above 0 it turns no sharper than so, driving forward.
    """

    speed: float
    reverse: float
    acceleration: float
    deceleration: float
    turn_rate: float
    turn_acceleration: float
    least_radius: float = 0.0

    def scaled(self, share: float) -> Drive:
        """The limits with every acceleration multiplied by ``share``; not for kernels."""
        return Drive(
            self.speed,
            self.reverse,
            self.acceleration * share,
            self.deceleration * share,
            self.turn_rate,
            self.turn_acceleration * share,
            self.least_radius,
        )


@kernel
def approach(value: float, wanted: float, up: float, down: float) -> float:
    """One step from a rate towards the wanted one: ``up`` at most away from 0, ``down`` towards it."""
    if wanted > value:
        limit = up if value >= 0.0 else down
        return min(wanted, value + limit)
    limit = up if value <= 0.0 else down
    return max(wanted, value - limit)


@kernel
def advance(
    x: float, y: float, theta: float, v: float, w: float, cv: float, cw: float, dt: float, drive: Drive
) -> tuple[float, float, float, float, float]:
    """Pose and rates after ``dt`` under a command (cv, cw): the arc of the mean rates of the step."""
    nv, nw = rates_after(v, w, cv, cw, dt, drive)
    px, py, ptheta = exact_arc(x, y, theta, 0.5 * (v + nv) * dt, 0.5 * (w + nw) * dt)
    return px, py, ptheta, nv, nw


@kernel
def rates_after(v: float, w: float, cv: float, cw: float, dt: float, drive: Drive) -> tuple[float, float]:
    """Speed and turn rate after ``dt`` under a command (cv, cw)."""
    cv = min(max(cv, -drive.reverse), drive.speed)
    cw = min(max(cw, -drive.turn_rate), drive.turn_rate)
    nv = approach(v, cv, drive.acceleration * dt, drive.deceleration * dt)
    if drive.least_radius > 0.0:
        sharpest = max(nv, 0.0) / drive.least_radius
        cw = min(max(cw, -sharpest), sharpest)
    return nv, approach(w, cw, drive.turn_acceleration * dt, drive.turn_acceleration * dt)


@kernel
def braking_is_free(
    x: float,
    y: float,
    c: float,
    s: float,
    v: float,
    w: float,
    deceleration: float,
    body: Body,
    ground: Ground,
    margin: float,
) -> bool:
    """Whether the arc on which a robot comes to rest, curvature kept, is free, and seen to be so.

    The heading is given by its cosine and sine.
    Looks every 0.12 m or 0.25 rad; between them the body comes nearer by less than 2 cm.
    """
    polygon, outer, discs = body.polygon, body.outer_m, body.discs
    hits, nearest, mean, unseen = ground.hits, ground.nearest, ground.mean, ground.unseen_m
    x0, y0 = ground.x0_m, ground.y0_m
    cell, per_cell, coarse, per_coarse = ground.cell_m, ground.per_cell, ground.coarse_m, ground.per_coarse
    length = 0.5 * v * v / deceleration
    angle = 0.0 if v == 0.0 else length * w / abs(v)
    steps = max(math.ceil(length / STOP_SPACING_M), math.ceil(abs(angle) / STOP_SPACING_RAD))
    steps = min(steps, MOST_STOP_STEPS)
    sign = 1.0 if v >= 0.0 else -1.0
    for k in range(1, steps + 1):
        share = k / steps
        px, py, pc, ps = along_arc(x, y, c, s, sign * share * length, share * angle)
        if (
            disc_clearance(px, py, outer, nearest, mean, x0, y0, per_cell) < margin
            and clearance_of(
                px, py, pc, ps, polygon, outer, discs, hits, nearest, mean, x0, y0, cell, per_cell, margin
            )
            < margin
        ):
            return False
        if not (
            disc_seen(px, py, outer, unseen, x0, y0, per_coarse)
            or seen_under(px, py, pc, ps, outer, discs, unseen, x0, y0, coarse, per_coarse)
        ):
            return False
    return True


@kernel
def command_is_safe(
    start: FloatArray,
    cv: float,
    cw: float,
    hold: float,
    dt: float,
    keep_turning: bool,
    drive: Drive,
    worse: Drive,
    body: Body,
    ground: Ground,
    movers: FloatArray,
    margin: float,
    margin_s: float,
    movers_margin: float,
) -> tuple[bool, float]:
    """Whether a command, held and then followed by braking to rest, touches nothing that has been seen.

    The whole manoeuvre is simulated under the likely limits and once more under ``worse`` ones.

    Parameters
    ----------
    start
        (5,) x, y, theta, v, w when the command takes effect.
    hold
        For how long it is held before the braking begins.
    keep_turning
        Brake along the arc (curvature kept) instead of straightening.
    movers
        (N, M, 3) moving discs at the end of each ``dt``, the last ones staying; the robot's own motion must
        not bring it nearer to one that is within ``movers_margin`` and ``margin_s`` times the speed.
    margin, margin_s, movers_margin
        Clearance to keep, and how much more per m/s. Where there is less at the start, it must not shrink by
        more than a millimetre.

    Returns
    -------
    safe, least clearance on the way (at most ``margin`` + 0.1)
    """
    polygon, outer, discs = body.polygon, body.outer_m, body.discs
    hits, nearest, mean, unseen = ground.hits, ground.nearest, ground.mean, ground.unseen_m
    x0, y0 = ground.x0_m, ground.y0_m
    cell, per_cell, coarse, per_coarse = ground.cell_m, ground.per_cell, ground.coarse_m, ground.per_coarse
    least = margin + 0.1
    begin = sure_clearance(
        start[0],
        start[1],
        start[2],
        polygon,
        outer,
        hits,
        nearest,
        mean,
        x0,
        y0,
        cell,
        per_cell,
        least,
    )
    c, s = math.cos(start[2]), math.sin(start[2])
    seen_before = seen_under(start[0], start[1], c, s, outer, discs, unseen, x0, y0, coarse, per_coarse)
    for model in range(2):
        limits = drive if model == 0 else worse
        x, y, theta, v, w = start[0], start[1], start[2], start[3], start[4]
        held = math.ceil(hold / dt - 1e-9)
        curvature = 0.0
        for k in range(400):
            before = x, y, theta
            if k < held:
                x, y, theta, v, w = advance(x, y, theta, v, w, cv, cw, dt, limits)
                curvature = w / v if abs(v) > 0.05 else 0.0
            else:
                # The turning stops with the driving: never faster than the braking lets it.
                slower = approach(v, 0.0, 0.0, limits.deceleration * dt)
                wanted = curvature * slower if keep_turning else 0.0
                x, y, theta, v, w = advance(x, y, theta, v, w, 0.0, wanted, dt, limits)
            here = sure_clearance(
                x, y, theta, polygon, outer, hits, nearest, mean, x0, y0, cell, per_cell, margin + 0.1
            )
            least = min(least, here)
            if here < min(margin + margin_s * abs(v), begin - 1e-3):
                return False, least
            c, s = math.cos(theta), math.sin(theta)
            if seen_before and not seen_under(x, y, c, s, outer, discs, unseen, x0, y0, coarse, per_coarse):
                return False, least
            if movers.shape[1] > 0 and (v != 0.0 or w != 0.0):
                at = min(k, movers.shape[0] - 1)
                keep = movers_margin + margin_s * abs(v)
                # Both where they are then and were before: who runs is past in between.
                if closes_in(before, (x, y, theta), polygon, outer, movers[at], keep):
                    return False, least
                if at > 0 and closes_in(before, (x, y, theta), polygon, outer, movers[at - 1], keep):
                    return False, least
            if k >= held and v == 0.0 and w == 0.0:
                break
    return True, least
