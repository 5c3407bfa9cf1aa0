"""The navigator that plans over a grid's cells and follows a smooth curve along the path."""

from __future__ import annotations

import math
from typing import cast

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import STOP, FloatArray, Goal, Pose2, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import NAVIGATORS, Belief, PlannedPath, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.cells import CellRoute, CostMapConfig, curve_along, grid_of, route_over_cells
from pilotage.stack.navigator.navigator import Parts
from pilotage.stack.planning.grid_planner import GridPlanner
from pilotage.stack.planning.quintic_spline import QuinticSpline

NAME = "navigator 'curve'"


class SplineConfig(Config):
    """The curve along a planned path (section 5 of the rover report)."""

    clear: bool = True
    """Whether knots are added until the curve keeps clear of hazards; the report's curve is not checked."""


class CurveConfig(Config):
    """How cells are priced, and the curve; without one nobody can drive: the path is only planned."""

    cost_map: CostMapConfig = CostMapConfig()
    spline: SplineConfig | None = SplineConfig()
    speed_m_s: float | None = Field(default=None, gt=0.0)
    """Along the curve; None: as fast as the robot can."""


@NAVIGATORS.add("curve", CurveConfig)
class CurveNavigator:
    """Plans over the cells with the mission's planner, puts a quintic spline along the path, and tracks it.

    The reference moves along the curve at constant speed (equations 5.1 to 5.6), whatever the robot does;
    the controller follows it from the believed pose. Arrives when the reference does.
    """

    def __init__(
        self,
        config: CurveConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: Parts,
        journal: Journal,
    ) -> None:
        goal = task.goal
        if goal is None or not hasattr(parts.planner, "search"):
            raise InputError(
                f"{NAME}: expected world.goal and a stack.planner over cells (astar, dijkstra, theta-star), "
                "found one missing"
            )
        self._localizer, self._controller, self._journal = parts.localizer, parts.controller, journal
        self._initial = task.initial
        self._t_s, self._index, self._dt_s = 0.0, 0, robot.dt_s
        self._speed_m_s = min(config.speed_m_s or math.inf, robot.motion.top_speed_m_s)
        self._status, self._reason = StackStatus.RUNNING, ""
        self._references: FloatArray = np.zeros((0, 4))
        planner = cast(GridPlanner, parts.planner)
        route = route_over_cells(chart, planner, config.cost_map, self.belief.pose, goal, NAME)
        journal.planning_time_s += route.result.planning_time_s
        journal.result("route", lambda: route)
        path = route.result.path
        if path is not None:
            journal.result("looked_at", lambda: path.looked_at)
        if path is None or config.spline is None:
            self._planned_only(route)
            return
        if parts.localizer is None or parts.controller is None:
            raise InputError(f"{NAME}: expected stack.localizer and stack.controller, found one missing")
        curve, self._reason = curve_along(route, grid_of(chart, NAME), config.spline.clear)
        if curve is None:
            self._status = StackStatus.FAILED
            journal.say(0.0, "failed", self._reason)
            return
        self._follow(curve, route, goal)
        self._channel = journal.channel(
            {"ref_x_m": "m", "ref_y_m": "m", "ref_theta_rad": "rad", "distance_to_go_m": "m"}
        )

    def _planned_only(self, route: CellRoute) -> None:
        found = route.result.path is not None
        self._status = StackStatus.ARRIVED if found else StackStatus.FAILED
        self._reason = f"{route.result.status}: {route.result.reason}"
        self._journal.say(0.0, "plan" if found else "failed", route.result.reason)
        if found:
            self._adopt(np.column_stack([route.path_xy_m, np.zeros(len(route.path_xy_m))]), route)

    def _follow(self, curve: QuinticSpline, route: CellRoute, goal: Goal) -> None:
        """Lay out the reference, one pose a step."""
        del goal
        count = max(2, math.ceil(curve.length_m / (self._speed_m_s * self._dt_s)) + 1)
        samples = curve.at(np.minimum(np.arange(count) * self._speed_m_s * self._dt_s, curve.length_m))
        self._length_m = curve.length_m
        self._references = np.column_stack(
            [samples.points_xy_m, samples.heading_rad, samples.curvature_per_m]
        )
        self._adopt(self._references[:, :3], route)
        self._journal.say(0.0, "plan", f"{route.result.reason}; {self._reason}")

    def _adopt(self, states: FloatArray, route: CellRoute) -> None:
        length_m = float(np.hypot(*np.diff(states[:, :2], axis=0).T).sum())
        took_s = route.result.planning_time_s
        nothing = np.zeros((0, 4))
        self._journal.plans.append(
            PlannedPath(0.0, states, states[[0, -1]], nothing, length_m, 0.0, False, took_s, took_s)
        )

    @property
    def belief(self) -> Belief:
        """The localizer's belief."""
        return self._initial if self._localizer is None else self._localizer.belief

    @property
    def status(self) -> tuple[StackStatus, str]:
        """Arrived where the reference has come to the curve's end."""
        return self._status, self._reason

    def step(self, readings: Readings) -> Twist:
        """Localize, move the reference on, and follow it."""
        assert self._localizer is not None
        assert self._controller is not None
        pose = self._localizer.step(readings).pose
        if self._status is not StackStatus.RUNNING:
            return STOP
        last = len(self._references) - 1
        if self._index >= last:
            self._status = StackStatus.ARRIVED
            self._journal.say(readings.t_s, "arrived", self._reason)
            return STOP
        x, y, theta, curvature = self._references[self._index + 1].tolist()
        here = self._references[self._index]
        advanced = min(
            self._speed_m_s * self._dt_s, self._length_m - self._index * self._speed_m_s * self._dt_s
        )
        self._index += 1
        reference = Pose2(x, y, wrap_to_pi(theta))
        speed = advanced / self._dt_s
        turned = wrap_to_pi(theta - float(here[2])) / self._dt_s
        control = self._controller.step(pose, reference, Twist(speed, turned if curvature else 0.0))
        self._channel.tell(
            x, y, reference.theta_rad, self._length_m - self._index * self._speed_m_s * self._dt_s
        )
        return control.twist
