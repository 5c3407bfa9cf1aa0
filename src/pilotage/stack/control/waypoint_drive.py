"""Along straight pieces by wheel speeds: turn on the spot where a piece begins, then drive."""

from __future__ import annotations

import math

from pilotage.core.types import STANDSTILL, WheelSpeeds
from pilotage.models.motion.wheel_drive import WheelDriveConfig
from pilotage.stack.control.wheel_pursuit import wheel_speeds

Point = tuple[float, float]

TURN_FIRST_RAD = 0.35
TURN_GAIN_PER_S, STEER_GAIN_PER_S = 3.0, 4.0
STEER_MOST_RAD_S = 0.8
SLOW_GAIN_PER_S = 4.0
CREEP_M_S = 0.02
REACHED_M, PASSED_M = 0.006, 0.010
"""How near the last and the other waypoints are come to."""
PROGRESS_M = 0.002
CAREFUL = 0.6
"""Share of its speed that it takes close to something."""


class WaypointDrive:
    """Follows waypoints and notices when it gets no nearer.

    Parameters
    ----------
    speed_share
        Of the wheels' greatest speed.
    stuck_s
        Without progress for so long it is stuck.
    """

    def __init__(
        self, drive: WheelDriveConfig, speed_share: float, turn_rate_rad_s: float, stuck_s: float
    ) -> None:
        self._drive, self._turn_rate, self._stuck_s = drive, turn_rate_rad_s, stuck_s
        self._speed = speed_share * drive.max_wheel_speed_rad_s * drive.wheel_radius_m
        self.waypoints: list[Point] = []
        self._reversed_last = False
        self._slow_at_end = True
        self._nearest, self._since_s = math.inf, 0.0
        self.moves_ahead = False
        self.is_careful = False

    def follow(self, waypoints: list[Point], t_s: float, slow_at_end: bool, back: bool = False) -> None:
        """Take new waypoints; ``back``: the last piece is driven backwards."""
        self.waypoints = waypoints
        self._slow_at_end, self._reversed_last = slow_at_end, back
        self._nearest, self._since_s = math.inf, t_s

    def stop(self) -> None:
        """Forget the waypoints."""
        self.waypoints = []
        self.moves_ahead = False

    def is_stuck(self, t_s: float) -> bool:
        """Whether it has come no nearer to the next waypoint for too long."""
        return bool(self.waypoints) and t_s - self._since_s > self._stuck_s

    def step(self, pose: tuple[float, float, float], t_s: float) -> WheelSpeeds:
        """The command from a pose; a standstill once no waypoint is left."""
        x, y, theta = pose
        while self.waypoints:
            to_x, to_y = self.waypoints[0]
            away = math.hypot(to_x - x, to_y - y)
            last = len(self.waypoints) == 1
            if away >= (REACHED_M if last else PASSED_M):
                break
            self.waypoints.pop(0)
            self._nearest, self._since_s = math.inf, t_s
        if not self.waypoints:
            self.moves_ahead = False
            return STANDSTILL
        if away < self._nearest - PROGRESS_M:
            self._nearest, self._since_s = away, t_s
        backwards = last and self._reversed_last
        off = math.atan2(to_y - y, to_x - x) - theta + (math.pi if backwards else 0.0)
        off = math.remainder(off, 2.0 * math.pi)
        # So near to a point its direction says little.
        if abs(off) > (TURN_FIRST_RAD if away > 0.02 else 1.4 * TURN_FIRST_RAD):
            self.moves_ahead = False
            w = min(max(TURN_GAIN_PER_S * off, -self._turn_rate), self._turn_rate)
            return wheel_speeds(0.0, math.copysign(max(abs(w), 0.25), w), self._drive)
        v = self._speed * (CAREFUL if self.is_careful else 1.0)
        if not last or self._slow_at_end:
            v = min(v, max(CREEP_M_S, SLOW_GAIN_PER_S * away))
        v *= max(0.2, 1.0 - 2.0 * abs(off))
        w = min(max(STEER_GAIN_PER_S * off, -STEER_MOST_RAD_S), STEER_MOST_RAD_S)
        self.moves_ahead = not backwards
        return wheel_speeds(-v if backwards else v, w, self._drive)
