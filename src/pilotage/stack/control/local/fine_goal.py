"""The last stretch to a goal that has to be met finer than the grids are: straight, ending at rest."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pilotage.core.types import Twist
from pilotage.kernels.control.band import path_distances
from pilotage.kernels.geometry.motion import wrap
from pilotage.stack.control.local.command_check import BRAKE_TRUST, is_safe
from pilotage.stack.control.local.rolling import Scene

AIM = 0.3
"""Of a tolerance finer than the grid the robot has to come to rest within: its belief is off as well."""
NEAR_M = 0.3
"""From so far on, and sooner where braking takes longer."""
GOAL_TRUST = 0.9
"""Share of the likely braking with which it comes to a goal that the grid resolves: who is a little too fast
passes it by a little, and hits nothing, for that is checked as ever. With 0.65 BARN's robot with brakes of
1 m/s^2 lost 0.3 s, though its run is over once it is within 1 m."""
TURN_GAIN_PER_S = 3.0
TURN_IN_PLACE_RAD = 0.35
"""Farther off than this it turns before it drives."""
STRAIGHT_RAD = 0.03
"""Turned for it by so much, there is no more to be had from turning."""
BACKS_M_S = 0.3
"""Speed at which it is asked whether there is room to back."""
LEAST_SPEED_M_S = 0.01
LEAST_TURN_RAD_S = 0.1


def is_fine(scene: Scene, tolerance_m: float) -> bool:
    """Whether the cell of the time to go that holds the goal may have its middle outside the tolerance."""
    return bool(tolerance_m < math.sqrt(2.0) * scene.ground.coarse_m)


def is_led(scene: Scene, tolerance_m: float) -> bool:
    """Whether the last stretch is driven here: to a fine goal, or one that full speed slides through."""
    slide_m = scene.sheet.speed**2 / (2.0 * BRAKE_TRUST * scene.sheet.deceleration)
    return is_fine(scene, tolerance_m) or bool(slide_m > tolerance_m)


def rests_within(scene: Scene, tolerance_m: float) -> bool:
    """Whether the robot is at the goal, and would still be if it stopped now."""
    x, y, theta, v, _ = scene.start
    slide = v * abs(v) / (2.0 * BRAKE_TRUST * scene.sheet.deceleration)
    there = math.hypot(
        x + slide * math.cos(theta) - scene.goal[0], y + slide * math.sin(theta) - scene.goal[1]
    )
    share = AIM if is_fine(scene, tolerance_m) else 1.0
    return max(scene.distance_m, there) < share * tolerance_m


def approach(scene: Scene, tolerance_m: float) -> Twist | None:
    """The command straight to the goal; None where it is far, not to be seen from here, or not safe.

    It turns on the spot, then follows the arc through the goal, backwards where that is nearer and the ground
    there was seen, at the speed from which it can stop there. Fails where the goal is nearer to an obstacle
    than the footprint allows, and for robots that neither back nor may turn where they are.
    """
    x, y, theta, v, _ = (float(value) for value in scene.start)
    drive, body, goal = scene.drive, scene.body, scene.goal
    braking = (BRAKE_TRUST if is_fine(scene, tolerance_m) else GOAL_TRUST) * drive.deceleration
    dx, dy = float(goal[0]) - x, float(goal[1]) - y
    away = math.hypot(dx, dy)
    if drive.least_radius > 0.0 or away > NEAR_M + v * v / (2.0 * braking) + abs(v) * scene.dt_s:
        return None
    line = np.linspace([x, y], goal, max(2, math.ceil(away / scene.ground.cell_m)))
    if path_distances(line, scene.ground).min() < body.inner_m:
        return None
    bearing = wrap(math.atan2(dy, dx) - theta)
    backwards = abs(bearing) > 0.5 * math.pi and drive.reverse > 0.0 and _can_back(scene, theta + bearing)
    off = wrap(bearing - math.pi) if backwards else bearing
    if away < 0.5 * AIM * tolerance_m:
        return Twist(0.0, 0.0) if is_safe(scene, Twist(0.0, 0.0)) else None
    turn = max(TURN_GAIN_PER_S * abs(off), LEAST_TURN_RAD_S)
    turned = Twist(0.0, math.copysign(min(turn, drive.turn_rate), off))
    if abs(off) <= TURN_IN_PLACE_RAD:
        # One step is driven at this speed before it can fall.
        lag = braking * scene.dt_s
        speed = min(math.sqrt(lag * lag + 2.0 * braking * away) - lag, away / scene.dt_s)
        speed = max(min(speed, drive.reverse if backwards else drive.speed), LEAST_SPEED_M_S)
        turn = 2.0 * speed * math.sin(off) / away
        along = Twist(-speed if backwards else speed, min(max(turn, -drive.turn_rate), drive.turn_rate))
        if is_safe(scene, along):
            return along
    # Where the arc leads over what it has not seen, or past a corner, the straight line may not.
    return turned if abs(off) > STRAIGHT_RAD and is_safe(scene, turned) else None


def _can_back(scene: Scene, course_rad: float) -> bool:
    """Whether it could begin to back in a direction, turned for it.

    Else it would turn its back on a goal on unseen ground, could not back, and be turned to face it by what
    decides then: to and fro for ever.
    """
    x, y = float(scene.start[0]), float(scene.start[1])
    turned = np.array([x, y, wrap(course_rad + math.pi), 0.0, 0.0])
    return is_safe(replace(scene, start=turned), Twist(-min(scene.drive.reverse, BACKS_M_S), 0.0))
