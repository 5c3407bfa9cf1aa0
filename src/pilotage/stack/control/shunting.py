"""How a car turns about where it has no room for an arc: ahead and back in turn, the wheels turned over."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from pilotage.core.types import STOP, Twist
from pilotage.sensors.lidar import LidarConfig
from pilotage.stack.knowledge import RobotKnowledge

SPEED_M_S = 0.3
LEG_M = 1.5
"""Of one leg at most: backing on it would come where it knows no more than here."""
BEHIND_RAD = 0.5
"""Who looks so far to either side of straight back sees what it backs into."""


class Shunting:
    """Turns a car in one sense by legs, ahead on the tightest arc and back on the other one.

    A leg ends where it is not allowed any more, or after ``LEG_M``. Where the tightest arc is not allowed it
    tries wider ones and then those of the other side. Backs only where some laser looks.

    Parameters
    ----------
    allows
        Whether a command leaves the robot room; asked about several in a step.
    """

    def __init__(self, robot: RobotKnowledge, allows: Callable[[Twist], bool]) -> None:
        self._allows, self._dt_s = allows, robot.dt_s
        self._speed_m_s = min(SPEED_M_S, robot.motion.top_speed_m_s)
        self._per_m = 1.0 / robot.motion.least_turning_radius_m
        self._sees_behind = any(looks_back(sheet) for sheet in robot.sensors_of(LidarConfig).values())
        self._ahead, self._leg_m = True, 0.0

    def begin(self) -> None:
        """What is ahead is in the way: begin by backing."""
        self._ahead, self._leg_m = not self._sees_behind, 0.0

    def step(self, sense: float) -> Twist:
        """The next command of a turn to the left (positive) or to the right; a stop where nothing is free."""
        if self._leg_m > LEG_M:
            self._turn_over()
        for _ in range(2):
            for share in (1.0, 0.5, 0.0, -0.5, -1.0):
                command = self._leg(math.copysign(1.0, sense) * share)
                if self._allows(command):
                    self._leg_m += self._speed_m_s * self._dt_s
                    return command
            self._turn_over()
        return STOP

    def _leg(self, share: float) -> Twist:
        """On with the leg, turned by a share of what the wheels can."""
        v_m_s = self._speed_m_s if self._ahead else -self._speed_m_s
        return Twist(v_m_s, share * self._per_m * self._speed_m_s)

    def _turn_over(self) -> None:
        self._ahead, self._leg_m = self._ahead != self._sees_behind, 0.0


def looks_back(sheet: LidarConfig) -> bool:
    """Whether its beams cover what is straight behind the robot."""
    angles_rad = np.sort(np.mod(sheet.mount.theta_rad + sheet.beam_angles_rad(), 2.0 * math.pi))
    behind = angles_rad[np.abs(angles_rad - math.pi) <= BEHIND_RAD]
    edges = np.concatenate([[math.pi - BEHIND_RAD], behind, [math.pi + BEHIND_RAD]])
    return bool(np.diff(edges).max() <= 0.5 * BEHIND_RAD)
