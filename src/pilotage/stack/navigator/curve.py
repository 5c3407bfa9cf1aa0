"""The navigator that plans over a grid's cells and follows a smooth curve along the path."""

from __future__ import annotations

import math
from typing import cast

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import Positive
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.interface import NAVIGATORS, Belief, PlannedPath, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.cells import CellRoute, CostMapConfig, curve_along, grid_of, route_over_cells
from pilotage.stack.navigator.navigator import (
    AROUND,
    DISC_HINT,
    Parts,
    arrival_within_m,
    check_keeps_time,
    missing,
    only_goal,
    turn_at_goal_rad,
    turned_by,
)
from pilotage.stack.navigator.timed_path import laid_out
from pilotage.stack.planning.grid_planner import GridPlanner
from pilotage.stack.planning.quintic_spline import QuinticSpline

NAME = "navigator 'curve'"
MOST_REFERENCES = 1_000_000
"""Along a curve at a constant speed, one a step."""
MOST_OFF_RAD = 0.35
"""A robot that cannot turn on the spot gets onto a curve that begins so far off its heading."""
TURNS_FROM_RAD, TURN_SHARE, HEADING_PER_S = 0.1, 0.5, 3.0
"""Who can turns to a curve that begins farther off, at this share of its turn rate; an error dies out."""
ACCELERATION_SHARE, AT_ONCE_M_S2 = 0.4, 2.0
"""Of the motion's braking; and what stands for that of a motion that stops at once."""
SAMPLES_M, MOST_SAMPLES = 0.02, 20_000
"""Between samples of a curve whose speed follows its bends, and how many there are at most."""
CATCHES_UP_S = 5.0
"""So long it goes on towards the curve's end when the reference is there and it is not."""


class SplineConfig(Config):
    """The curve along a planned path (section 5 of the rover report)."""

    clear: bool = True
    """Whether knots are added until the curve keeps clear of hazards; the report's curve is not checked."""


class CurveConfig(Config):
    """How cells are priced, and the curve; without one nobody can drive: the path is only planned."""

    cost_map: CostMapConfig = CostMapConfig()
    spline: SplineConfig | None = SplineConfig()
    speed_m_s: float | None = Field(default=None, gt=0.0)
    """Along the curve; None: as fast as the robot can take its bends."""
    patience_s: Positive = 20.0
    """The reference waits for so long while the lasers show something where the robot would drive."""


@NAVIGATORS.add("curve", CurveConfig)
class CurveNavigator:
    """Plans over the cells with the mission's planner, puts a quintic spline along the path, and tracks it.

    The reference moves along the curve, at constant speed where one is set (equations 5.1 to 5.6);
    the controller follows it from the believed pose. Arrives when the reference does, or up to 5 s later
    where the robot is not within half the goal's tolerance yet, but for one that is not within it even then.
    Fails at once where a car's curve is none that it can drive. Before what its lasers show in its way it
    stands and its reference waits: whoever walks goes on; it plans nothing anew, and fails where that stays.
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
        goal = only_goal(task, "curve")
        check_keeps_time(parts, "curve")
        planner = parts.planner
        if goal is None or not hasattr(planner, "search"):
            absent = missing({"world.goal": goal, "stack.planner": planner})
            raise InputError(
                f"{NAME}: expected world.goal and a stack.planner over cells (astar, dijkstra, theta-star), "
                f"found {absent or 'a planner that does not search cells'}"
            )
        self._localizer, self._controller, self._journal = parts.localizer, parts.controller, journal
        self._initial, self._task = task.initial, task
        self._index, self._dt_s, self._motion = 0, robot.dt_s, robot.motion
        asked_m_s = config.speed_m_s
        self._speed_m_s = None if asked_m_s is None else min(asked_m_s, robot.motion.top_speed_m_s)
        self._outline = robot.footprint
        self._last_word, self._patience_s = LastWord(robot), config.patience_s
        self._tolerance_m, self._waited_s = task.goal_tolerance_m, 0.0
        self._arrival_m = arrival_within_m(None, task.goal_tolerance_m)
        self._status, self._reason = StackStatus.RUNNING, ""
        self._references: FloatArray = np.zeros((0, 5))
        start, cells = self.belief.pose, cast(GridPlanner, planner)
        route = route_over_cells(chart, cells, config.cost_map, robot.radius_m, start, goal, NAME)
        journal.planning_time_s += route.result.planning_time_s
        journal.result("route", lambda: route)
        path = route.result.path
        if path is not None:
            journal.result("looked_at", lambda: path.looked_at)
        if path is None or config.spline is None:
            self._planned_only(route)
            return
        if parts.localizer is None or parts.controller is None:
            absent = missing({"stack.localizer": parts.localizer, "stack.controller": parts.controller})
            raise InputError(f"{NAME}: expected stack.localizer and stack.controller, found {absent}")
        grid = grid_of(chart, NAME)
        curve, self._reason = curve_along(route, grid, config.spline.clear)
        why = self._reason if curve is None else self._cannot_drive(curve, grid.resolution_m)
        if curve is None or why:
            self._status, self._reason = StackStatus.FAILED, why
            journal.say(0.0, "failed", why)
            return
        self._follow(curve, route)
        self._channel = journal.channel(
            {"ref_x_m": "m", "ref_y_m": "m", "ref_theta_rad": "rad", "distance_to_go_m": "m"}
        )

    def _planned_only(self, route: CellRoute) -> None:
        found = route.result.path is not None
        self._status = StackStatus.ARRIVED if found else StackStatus.FAILED
        self._reason = f"{route.result.status}: {route.result.reason}"
        if not found and not self._outline.is_disc:
            self._reason += DISC_HINT
        self._journal.say(0.0, "plan" if found else "failed", route.result.reason)
        if found:
            self._adopt(np.column_stack([route.path_xy_m, np.zeros(len(route.path_xy_m))]), route)

    def _cannot_drive(self, curve: QuinticSpline, cell_m: float) -> str:
        """Why the robot cannot keep to a curve; nothing where it can, or turns within a cell."""
        least_m = self._motion.least_turning_radius_m
        if least_m <= 0.5 * cell_m:
            return ""
        samples = curve.at(np.linspace(0.0, curve.length_m, max(2, math.ceil(curve.length_m / cell_m) + 1)))
        bends_m = 1.0 / max(float(np.abs(samples.curvature_per_m).max()), 1e-9)
        off_rad = wrap_to_pi(float(samples.heading_rad[0]) - self.belief.pose.theta_rad)
        if bends_m >= least_m and abs(off_rad) <= MOST_OFF_RAD:
            return ""
        bends = f"bends to {bends_m:.2f} m" if bends_m < curve.length_m else "is all but straight"
        return (
            f"the curve begins {math.degrees(off_rad):.0f} degrees off the robot's heading and {bends}, it "
            f"turns in {least_m:.2f} m at least: take navigator maneuver and planner hybrid-astar"
        )

    def _follow(self, curve: QuinticSpline, route: CellRoute) -> None:
        """Lay out the reference, one pose a step; who can turns to it first."""
        if self._speed_m_s is None:
            references = self._as_fast_as_it_can(curve)
        else:
            step_m = self._speed_m_s * self._dt_s
            if curve.length_m > MOST_REFERENCES * step_m:
                raise InputError(
                    f"stack.navigator.speed_m_s: expected at most {MOST_REFERENCES} steps along the curve of "
                    f"{curve.length_m:.1f} m, found {self._speed_m_s:g} m/s; take more than "
                    f"{curve.length_m / MOST_REFERENCES / self._dt_s:.2g}"
                )
            count = max(2, math.ceil(curve.length_m / step_m) + 1)
            s_m = np.minimum(np.arange(count) * step_m, curve.length_m)
            samples = curve.at(s_m)
            rows = [samples.points_xy_m, samples.heading_rad, samples.curvature_per_m, curve.length_m - s_m]
            references = np.column_stack(rows)
        self._adopt(references[:, :3], route)
        self._references = np.vstack([self._turn_to(references[0]), references])
        self._journal.say(0.0, "plan", f"{route.result.reason}; {self._reason}")

    def _as_fast_as_it_can(self, curve: QuinticSpline) -> FloatArray:
        """References (N, 5) that are slow in bends, and gather speed and brake as the motion can."""
        motion = self._motion
        count = min(MOST_SAMPLES, max(2, math.ceil(curve.length_m / SAMPLES_M) + 1))
        samples = curve.at(np.linspace(0.0, curve.length_m, count))
        states = np.column_stack([samples.points_xy_m, samples.heading_rad])
        braking = motion.braking_m_s2 if math.isfinite(motion.braking_m_s2) else AT_ONCE_M_S2
        acceleration, turn_rate = ACCELERATION_SHARE * braking, TURN_SHARE * motion.top_turn_rate_rad_s
        rows = laid_out(states, motion.top_speed_m_s, acceleration, math.inf, 0.0, self._dt_s, turn_rate)
        to_go_m = np.maximum(curve.length_m - np.cumsum(rows[:, 3]) * self._dt_s, 0.0)
        ahead = np.column_stack([rows[:, :3], np.ones(len(rows)), to_go_m])
        return np.vstack([[*states[0], 0.0, curve.length_m], ahead])

    def _turn_to(self, first: FloatArray) -> FloatArray:
        """References (N, 5) of a turn on the spot to the curve's heading; none where the robot cannot."""
        off_rad = wrap_to_pi(float(first[2]) - self.belief.pose.theta_rad)
        if self._motion.least_turning_radius_m > 0.0 or abs(off_rad) <= TURNS_FROM_RAD:
            return np.zeros((0, 5))
        rate = TURN_SHARE * self._motion.top_turn_rate_rad_s * self._dt_s
        rows = np.tile(first, (math.ceil(abs(off_rad) / rate) + math.ceil(1.0 / self._dt_s), 1))
        left_rad = np.maximum(abs(off_rad) - np.arange(len(rows)) * rate, 0.0)
        rows[:, 2] -= math.copysign(1.0, off_rad) * left_rad
        return rows

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
        """Arrived where the reference has come to the curve's end, and the robot with it."""
        return self._status, self._reason

    def step(self, readings: Readings) -> Twist:
        """Localize, move the reference on where the lasers leave room for it, and follow it."""
        assert self._localizer is not None
        pose = self._localizer.step(readings).pose
        self._last_word.take_in(readings)
        return self._last_word.leaving(self._command(readings, pose))

    def _command(self, readings: Readings, pose: Pose2) -> Twist:
        if self._status is not StackStatus.RUNNING:
            return STOP
        at_end = self._index >= len(self._references) - 1
        command = self._at_end(readings.t_s, pose) if at_end else self._along(pose)
        if self._last_word.allows(command):
            self._index += not at_end
            return command
        self._waited_s -= self._dt_s * at_end
        if self._last_word.held_s >= self._patience_s:
            self._end(readings.t_s, StackStatus.FAILED, f"stuck: {self._last_word.why}{AROUND}")
        return STOP

    def _along(self, pose: Pose2) -> Twist:
        """The command to the next reference."""
        assert self._controller is not None
        x, y, theta, curvature, to_go_m = self._references[self._index + 1].tolist()
        here = self._references[self._index]
        reference = Pose2(x, y, wrap_to_pi(theta))
        speed = (float(here[4]) - to_go_m) / self._dt_s
        turned = wrap_to_pi(theta - float(here[2])) / self._dt_s
        self._channel.tell(x, y, reference.theta_rad, to_go_m)
        if speed == 0.0:
            return Twist(0.0, turned + HEADING_PER_S * wrap_to_pi(theta - pose.theta_rad))
        return self._controller.step(pose, reference, Twist(speed, turned if curvature else 0.0)).twist

    def _at_end(self, t_s: float, pose: Pose2) -> Twist:
        """On towards the end where the reference is and the robot is not, then to the goal's heading."""
        assert self._controller is not None
        x, y, *_ = self._references[-1].tolist()
        self._waited_s += self._dt_s
        away_m = math.hypot(x - pose.x_m, y - pose.y_m)
        if away_m > self._arrival_m and self._waited_s <= CATCHES_UP_S:
            return self._controller.step(pose, Pose2(x, y, pose.theta_rad), STOP).twist
        if away_m > self._tolerance_m:
            why = f"the reference is at the curve's end, the robot {away_m:.2f} m from it"
            self._end(t_s, StackStatus.FAILED, why)
            return STOP
        turns = self._motion.least_turning_radius_m == 0.0
        off_rad = turn_at_goal_rad(self._task, pose) if turns else 0.0
        if off_rad:
            return turned_by(off_rad, self._motion.top_turn_rate_rad_s)
        why = f"driven to the curve's end, by its own estimate {away_m:.2f} m from it"
        self._end(t_s, StackStatus.ARRIVED, why)
        return STOP

    def _end(self, t_s: float, status: StackStatus, why: str) -> None:
        self._status, self._reason = status, why
        self._journal.say(t_s, str(status), why)
