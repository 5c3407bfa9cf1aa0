"""A plan on the robot's own map that leads a local controller: made anew where what is seen blocks it."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.types import FloatArray, Goal, Pose2
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.mapping.mapper import Mapper
from pilotage.stack.navigator.detours import Detours
from pilotage.stack.navigator.global_plan import GlobalPlan
from pilotage.stack.navigator.own_map import OwnMap
from pilotage.stack.navigator.progress import StallWatch, patience_s
from pilotage.stack.perception.moving_bodies import MovingBodies
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import Planner, Smoother


class PlanAheadConfig(Config):
    """How far ahead the plan leads, and when it is made anew."""

    lead_m: Positive = 3.5
    """The local controller heads for the plan's point so far ahead."""
    watch_margin_m: NonNegative = 0.03
    """Anything newly mapped nearer to the plan ahead than the body's radius plus this makes a new one."""
    every_s: NonNegative = 0.5
    """No two new plans are made in less time."""
    fallback_margins_m: tuple[NonNegative, ...] = (0.10, 0.06, 0.02, 0.0)
    """Where there is no plan at the planner's clearance: the body's radius plus these."""
    detour_m: NonNegative = 1.0
    """Nor does it go a longer way around for the sake of a greater clearance."""
    tight_m: NonNegative = 0.08
    """Gaps that leave its body less than this to spare it squeezes through at a crawl."""
    squeezing_s: NonNegative = 5.0
    """It goes as much farther as it drives in this time not to."""
    hidden_m: NonNegative = 0.5
    """By anything up to this what was mapped reaches farther than it was seen to: a gap with less room to
    spare may prove closed. 0: whatever looks open is tried."""
    look_m: NonNegative = 1.5
    """So near to such a gap it drives up to it: it costs little more to know than to guess."""
    look_around_s: NonNegative = 2.0
    """So long it looks around where it believes to begin inside something: a start is not known to the cm."""
    most_tries: int = Field(default=30, ge=0)
    """So often it plans where it found itself and no plan begins, on its way to where one might."""
    stall_s: Positive = 10.0
    stall_progress_m: Positive = 0.5
    most_stalls: int = Field(default=6, ge=0)
    """So often it plans anew where it got no farther before it gives up."""


class PlanAhead:
    """Keeps a plan to one goal and says where on it to head for.

    The plan holds whatever the map and the mapper have; what only the controller sees it does not know of.
    Where no plan is found the last one leads on: the way may open, or the controller find it.
    """

    def __init__(
        self,
        config: PlanAheadConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        goal: Goal,
        planner: Planner,
        smoother: Smoother | None,
        mapper: Mapper | None,
        bodies: MovingBodies,
        initial: Belief,
        journal: Journal,
    ) -> None:
        self._config, self._goal, self._mapper, self._journal = config, goal, mapper, journal
        self._bodies = bodies
        self._radius_m = robot.radius_m
        self._own_map = own_map = OwnMap(chart, mapper)
        rng = robot.streams.stream("planner")
        turns = robot.motion.least_turning_radius_m == 0.0
        self._plan = GlobalPlan(planner, smoother, chart, rng, journal, robot.radius_m, robot, turns)
        progress_m = config.stall_progress_m
        self._stall = StallWatch(
            progress_m, patience_s(config.stall_s, progress_m, robot.motion.top_speed_m_s)
        )
        squeezing_m = config.squeezing_s * robot.motion.top_speed_m_s
        self._detours = Detours(config.detour_m, config.tight_m, squeezing_m, config.hidden_m, config.look_m)
        self._stalls, self._planned_s = 0, -math.inf
        self._path: FloatArray = np.zeros((0, 2))
        self.to_go_m = math.inf
        self.failure, self._why, self._found_no_path = "", "", ""
        self._status: PlanStatus | None = None
        self._tries_left = config.most_tries if initial.status is BeliefStatus.LOST else 0
        self._room_m: FloatArray | None = None
        journal.result("mapped_circles_m", lambda: own_map.found_circles_m)
        journal.counts["replans"] = 0
        if initial.status is not BeliefStatus.LOST:
            self._make(0.0, initial.pose, "plan")

    def lead(self, readings: Readings, belief: Belief) -> tuple[float, float]:
        """The point to head for, by the plan as it is now; ``failure`` says why it gave up."""
        pose, t_s = belief.pose, readings.t_s
        readings = self._bodies.step(readings, belief)
        if self._mapper is not None:
            self._mapper.step(readings, belief)
        if self._plan.progress is None:
            self._begin(t_s, belief)
        else:
            self.to_go_m = self._plan.progress.update(pose)
            if self._stall.stalled(self.to_go_m, t_s):
                self._stalls += not self._bodies.about
                if self._stalls > self._config.most_stalls:
                    found = f"; planning found {self._found_no_path}" if self._found_no_path else ""
                    self.failure = f"stuck: no progress on {self._stalls} plans{found}"
                self._make(t_s, pose, f"no progress for {self._stall.patience_s:.3g} s")
            elif t_s - self._planned_s >= self._config.every_s and self._is_blocked():
                self._make(t_s, pose, "a mapped obstacle stands on the plan")
        if self._plan.progress is not None:
            return self._point_ahead()
        x_m, y_m = pose.as_array()[:2] if self._room_m is None else self._room_m
        return float(x_m), float(y_m)

    def _begin(self, t_s: float, belief: Belief) -> None:
        """Make the first plan, or make for where one begins; say why there is none."""
        config = self._config
        blocked = self._status is PlanStatus.START_BLOCKED
        if blocked and t_s - self._planned_s < config.every_s:
            return
        self._make(t_s, belief.pose, "plan")
        if self._plan.progress is not None:
            return
        if self._status is PlanStatus.START_BLOCKED and t_s < config.look_around_s:
            return
        if self._status is PlanStatus.START_BLOCKED and self._tries_left > 0:
            self._tries_left -= 1
            self._room_m = self._own_map.nearest_room_m(belief.pose, self._plan.clearance_m)
            return
        self.failure = f"no plan leads to the goal: {self._why}"

    @property
    def mapped_m(self) -> FloatArray:
        """(M, 3) discs that the robot put on its map itself."""
        return self._own_map.found_circles_m

    def _is_blocked(self) -> bool:
        least_m = self._radius_m + self._config.watch_margin_m
        return self._plan.is_blocked(self._own_map.found_circles_m, least_m)

    def _make(self, t_s: float, pose: Pose2, why: str) -> None:
        """Plan from here, at the planner's own clearance or at less."""
        own = self._plan.clearance_m
        asked = [own, *(self._radius_m + m for m in self._config.fallback_margins_m)]
        found = self._own_map.found_circles_m
        first = self._plan.progress is None
        clearances_m = sorted({c for c in asked if c <= own}, reverse=True)
        result = self._plan.make(t_s, pose, self._goal, found, clearances_m, self._detours)
        self._planned_s, self._status = t_s, result.status
        if not first:
            self._journal.count("replans")
        if result.path is None:
            self._why, self._found_no_path = result.reason, f"{result.status} ({result.reason})"
            self._journal.say(t_s, "no-plan", f"{why}: {result.status}, {result.reason}")
            return
        self._found_no_path = ""
        assert self._plan.path is not None
        self._path = np.ascontiguousarray(self._plan.path.states[:, :2])
        self._stall.restart(t_s)
        self.to_go_m = self._plan.path.length_m
        to_go = f"{self.to_go_m:.2f} m to go"
        self._journal.say(t_s, "plan" if first else "replan", to_go if first else f"{why}: {to_go}")

    def _index(self, ahead_m: float = 0.0) -> int:
        """Of the path's state so far ahead of the robot."""
        assert self._plan.progress is not None
        return self._plan.progress.index(ahead_m)

    def _point_ahead(self) -> tuple[float, float]:
        if self.to_go_m <= self._config.lead_m:
            return self._goal.x_m, self._goal.y_m
        x, y = self._path[self._index(self._config.lead_m)]
        return float(x), float(y)
