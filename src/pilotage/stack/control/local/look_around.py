"""A turn all around of a robot that stands: the ground ahead may be free and only unseen."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pilotage.core.types import Twist
from pilotage.kernels.geometry.motion import wrap
from pilotage.stack.control.local.command_check import is_safe
from pilotage.stack.control.local.role import LocalView
from pilotage.stack.control.local.rolling import Scene

STANDS_S, STANDS_M, STANDS_RAD = 3.0, 0.15, 0.5
"""Who has come no farther, and turned by no more, in that time looks around."""
TURN_RAD_S = 1.5
FULL_RAD = 2.0 * math.pi


@dataclass(slots=True)
class LookAround:
    """Where a robot stands since when, and how much of its turn is left.

    A laser that looks ahead does not see the ground beside the robot, which the robot's own width asks for a
    step later; after a turn it has seen all that is around. Where people are about it rather waits.
    """

    t_s: float = -math.inf
    x_m: float = math.inf
    y_m: float = math.inf
    theta_rad: float = 0.0
    left_rad: float = 0.0

    def step(self, view: LocalView, scene: Scene) -> Twist | None:
        """The next command of a turn; None where the robot need not, or may not."""
        x, y, theta = (float(value) for value in scene.pose)
        if self.left_rad > 0.0:
            self.left_rad -= wrap(theta - self.theta_rad)
            self.theta_rad = theta
            command = Twist(0.0, min(TURN_RAD_S, scene.drive.turn_rate))
            if self.left_rad > 0.0 and is_safe(scene, command):
                return command
            self.left_rad, self.t_s = 0.0, view.t_s
            return None
        people = view.people_about or math.isfinite(scene.movers.nearest_m(x, y))
        moved = math.hypot(x - self.x_m, y - self.y_m) > STANDS_M
        if moved or people or abs(wrap(theta - self.theta_rad)) > STANDS_RAD:
            self.t_s, self.x_m, self.y_m, self.theta_rad = view.t_s, x, y, theta
        elif view.t_s - self.t_s >= STANDS_S:
            self.left_rad, self.theta_rad = FULL_RAD, theta
        return None
