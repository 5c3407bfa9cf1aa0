"""The night-watch report's local planner: Dubins curves from the estimate to the next waypoint."""

from __future__ import annotations

import math

from pydantic import Field

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.rrt import local_path
from pilotage.maps.near_walls import NearWalls
from pilotage.sensors.sensor import NonNegative
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.planning.driving_space import usual_radius_m
from pilotage.stack.planning.local_planner import LOCAL_PLANNERS, LocalPath, RouteAhead

PLAN_TOLERANCE_M = 0.005
"""The plan is driven from the estimate, which lies beside it by about this much."""


class DubinsLocalConfig(Config):
    """Speed, turning radius, and when a waypoint is passed over.

    A curve longer than ``detour_ratio`` times the path along the plan plus ``detour_m`` is a loop: the
    waypoint lies beside or behind the robot, and the next one is taken instead.
    """

    speed_m_s: float = Field(default=0.5, ge=1e-3)
    turning_radius_m: float | None = Field(default=None, ge=1e-3, le=100.0)
    """None: 0.5 m, or where the motion needs more at this speed, a tenth more than that."""
    margin_m: NonNegative = 0.05
    """The local path keeps this, and the radius of the disc around the robot, from all on the robot's map."""
    look_ahead: int = Field(default=5, ge=1, le=100)
    """How many waypoints are tried."""
    detour_ratio: float = Field(default=1.3, ge=1.0, le=10.0)
    detour_m: NonNegative = 0.2
    on_plan_m: NonNegative = 0.15
    on_plan_rad: NonNegative = 0.3
    """This near to the plan, in position and heading, the plan itself may be followed."""


@LOCAL_PLANNERS.add("dubins", DubinsLocalConfig)
class DubinsLocalPlanner:
    """From the current estimate to the next waypoint, one point a control step at constant speed.

    Fails (None) where no curve to any of the next waypoints is free on the robot's map: the path is
    blocked, or the robot stands across it.
    """

    def __init__(self, config: DubinsLocalConfig, robot: RobotKnowledge) -> None:
        if config.speed_m_s > robot.motion.top_speed_m_s:
            raise InputError(
                f"stack.local_planner.speed_m_s: expected at most the top speed of '{robot.name}' by its "
                f"motion, {robot.motion.top_speed_m_s:g} m/s, found {config.speed_m_s:g}"
            )
        motion = robot.motion
        least_m, turn_rate = motion.least_turning_radius_m, motion.top_turn_rate_rad_s
        at_speed_m = config.speed_m_s / turn_rate
        radius_m = config.turning_radius_m or usual_radius_m(max(least_m, at_speed_m))
        if radius_m < least_m:
            raise InputError(
                f"stack.local_planner.turning_radius_m: expected at least the {least_m:g} m that the robot's "
                f"motion can turn in, found {radius_m:g}"
            )
        if radius_m < at_speed_m:
            raise InputError(
                f"stack.local_planner.turning_radius_m: expected at least speed over turn rate = "
                f"{at_speed_m:g} m, found {radius_m:g}"
            )
        self._radius_m = radius_m
        self._config = config
        self._step_m = config.speed_m_s * robot.dt_s
        self._clearance_m = robot.radius_m + config.margin_m

    def plan(
        self, pose: Pose2, route: RouteAhead, walls: NearWalls, circles_m: FloatArray
    ) -> LocalPath | None:
        """Try the next waypoints in turn; take the first whose curve is short and free, else the plan."""
        config = self._config
        last = route.waypoints.shape[0] - 1
        for index in range(min(config.look_ahead, last + 1)):
            x, y, theta = route.waypoints[index]
            states = local_path.stepped_curve(
                pose.x_m,
                pose.y_m,
                pose.theta_rad,
                x,
                y,
                theta,
                self._radius_m,
                self._step_m,
                index == last,
                config.detour_ratio * route.ahead_m[index] + config.detour_m,
            )
            if self._is_free(states, route, walls, circles_m):
                return LocalPath(states, config.speed_m_s)
        return self._along_the_plan(pose, route, walls, circles_m)

    def _along_the_plan(
        self, pose: Pose2, route: RouteAhead, walls: NearWalls, circles_m: FloatArray
    ) -> LocalPath | None:
        """The plan itself up to the next waypoint, where the robot is still on it.

        The shortest curve to a waypoint may cut a corner that the plan goes around.
        """
        if route.states.shape[0] < 2:
            return None
        x, y, theta = route.states[0]
        aside = math.hypot(x - pose.x_m, y - pose.y_m)
        turned = abs(wrap_to_pi(theta - pose.theta_rad))
        if aside > self._config.on_plan_m or turned > self._config.on_plan_rad:
            return None
        states = local_path.resampled(route.states, self._step_m, max(route.ahead_m[0], self._step_m))
        if self._is_free(states, route, walls, circles_m):
            return LocalPath(states, self._config.speed_m_s)
        return None

    def _is_free(
        self, states: FloatArray, route: RouteAhead, walls: NearWalls, circles_m: FloatArray
    ) -> bool:
        if states.shape[0] < 2:
            return False
        clearance = min(self._clearance_m, route.clearance_m - PLAN_TOLERANCE_M)
        (x0, y0), (x1, y1) = states[:, :2].min(axis=0), states[:, :2].max(axis=0)
        reach = 0.5 * math.hypot(x1 - x0, y1 - y0) + max(clearance, 0.0)
        near = walls.near(0.5 * (x0 + x1), 0.5 * (y0 + y1), reach)
        return bool(local_path.fits(states, clearance, near, circles_m))
