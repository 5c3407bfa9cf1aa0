"""What all states of the maneuver navigator share: the parts, the map, the plan and what is heeded on it."""

from __future__ import annotations

import numpy as np

from pilotage.core.types import FloatArray, Goal, Pose2, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.stack.control.give_way import GiveWay
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.control.own_half import OwnHalf
from pilotage.stack.control.step_clear import StepClear
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.global_plan import GlobalPlan
from pilotage.stack.navigator.maneuver.config import ManeuverConfig
from pilotage.stack.navigator.maneuver.stops import Stops
from pilotage.stack.navigator.maneuver.tracking import Tracking
from pilotage.stack.navigator.navigator import Parts, localizer_of, unexplained_of
from pilotage.stack.navigator.own_map import OwnMap
from pilotage.stack.navigator.reference import STANDS
from pilotage.stack.navigator.state import Standing
from pilotage.stack.navigator.trail import Trail
from pilotage.stack.navigator.wandering import Wandering
from pilotage.stack.navigator.yielding import Yielding
from pilotage.stack.perception.moving_bodies import MovingBodies
from pilotage.stack.planning.outline import car_of, ground_of
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import Path, Planner, PlanResult

BESIDE_INNER_M = (0.25, 0.2, 0.15, 0.08, 0.04, 0.01)
"""What paths planned for the centre keep beside the outline's inner disc, where they can keep no more."""
WALL_M, LEAST_M = 0.02, 0.005
"""Kept from the walls of the map on a path for the outline, or half of what the path keeps; and at least."""
SEEN_M = 0.05
"""What is seen and on no map counts as discs of this radius where a path around it is planned."""
SURE = 0.5
"""A place that is known better than to this share of what is astray: a standard deviation."""
COLUMNS = {"ref_x_m": "m", "ref_y_m": "m", "ref_theta_rad": "rad", "distance_to_go_m": "m"}
"""Where the reference is, and how much of the path is left."""


class Context(Standing):
    """The parts that the states drive with, and the questions that they ask.

    Attributes
    ----------
    yielding, stops, holds
        What came of waiting, of walls where none should be, and of what stands in its way, since nothing led
        back to where it was.
    trail
        Where it has been, on a path that covers a floor.
    replans, jumps, rests
        How often it went astray though it knew its place, and as its estimate jumped, and set out for what
        was left.
    has_planned
        Whether it has tried to, ever.
    """

    def __init__(
        self,
        config: ManeuverConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: Parts,
        goal: Goal,
        planner: Planner,
        journal: Journal,
    ) -> None:
        super().__init__(journal)
        self._channel = journal.channel(COLUMNS, first=True)
        self.config, self._robot, self._goal = config, robot, goal
        self.dt_s, self.radius_m = robot.dt_s, robot.radius_m
        self._mapper, self._has_mates = parts.mapper, task.mates > 0
        self.own_map = OwnMap(chart, parts.mapper)
        car = car_of(robot.footprint, WALL_M, 1.0)
        walls = car, ground_of(chart.field, car)
        self.own_half = OwnHalf(config.own_half, robot, chart, unexplained_of(parts), walls)
        self._bodies = MovingBodies(
            config.moving_bodies, robot, chart, minds=not task.mates, unexplained=self.own_half.unexplained
        )
        self._gives_way = GiveWay(config.give_way, robot, self._bodies)
        self.tracking = Tracking(config, robot, parts.controller)
        self.begin_anew()
        rng = robot.streams.stream("planner")
        self.plan = GlobalPlan(planner, parts.smoother, chart, rng, journal, robot=robot, as_planned=True)
        self.last_word = LastWord(robot)
        self.step_clear = StepClear(robot, self.last_word)
        self.wandering = Wandering(config.wander, robot, localizer_of(parts, "maneuver"), self.last_word)
        self.trail: Trail | None = None
        self.replans, self.jumps, self.rests, self.has_planned = 0, 0, 0, False
        self._to_walls_m, self._held_by_m = 0.0, np.zeros((0, 2))

    def begin_anew(self) -> None:
        """Nothing leads back to where it was."""
        robot = self._robot
        self.yielding = Yielding(self.config.yielding, self.dt_s, robot.streams.stream("yielding"))
        self.stops, self.holds = Stops(), Stops(self.config.yielding.most_tries)

    def is_sure(self, belief: Belief) -> bool:
        """Whether a place that it should not be at is where it is, not what its estimate jumped to."""
        return belief.std_m < SURE * self.config.astray_m

    def planned(self, t_s: float, belief: Belief, *, rest: bool = False) -> PlanResult:
        """What was found from where it is, around what it found on its way, if it can."""
        found, clearances_m = self.own_map.found_circles_m, self._clearances_m()
        result = self._made(t_s, belief, found, clearances_m, rest=rest)
        if result.path is not None or rest or not len(found):
            return result
        # What it mapped may have gone by the time that it is there: it stops before what has not.
        return self._made(t_s, belief, found[:0], clearances_m)

    def planned_around(self, t_s: float, belief: Belief) -> PlanResult:
        """What was found from where it is around all that it sees, or not at all.

        Around what it saw where it was held up, too, if it can: from one side of a thing it does not see the
        other.
        """
        seen_m = self.own_half.seen_m
        if len(self._held_by_m):
            result = self._made_around(t_s, belief, np.vstack([self._held_by_m, seen_m]))
            if result.path is not None:
                return result
        return self._made_around(t_s, belief, seen_m)

    def _made_around(self, t_s: float, belief: Belief, seen_m: FloatArray) -> PlanResult:
        cells = np.round(seen_m / SEEN_M).astype(np.int64)
        seen = seen_m[np.unique(cells, axis=0, return_index=True)[1]]
        found = np.vstack([self.own_map.found_circles_m, np.column_stack([seen, np.full(len(seen), SEEN_M)])])
        clearances_m = self._clearances_m()
        # Who can wait as well does not squeeze through where nothing is left beside its outline.
        some_m = [clearances_m[0], *clearances_m[1:-1][-1:]]
        result = self._made(t_s, belief, found, some_m)
        if result.status is PlanStatus.START_BLOCKED:
            result = self._made(t_s, belief, found, clearances_m)
        return result

    def _made(
        self, t_s: float, belief: Belief, found: FloatArray, clearances_m: list[float], *, rest: bool = False
    ) -> PlanResult:
        trail = None if self.trail is None else self.trail.rows
        unsure_m = belief.least_std_m
        return self.plan.make(
            t_s, belief.pose, self._goal, found, clearances_m, trail=trail, rest=rest, unsure_m=unsure_m
        )

    def _clearances_m(self) -> list[float]:
        """Clearances to try in turn: the planner's own, and less.

        A path that is planned for the centre has to keep at least what the outline's inner disc needs, and
        where its corners need more than that and than the planner's own, the disc around it; one that is
        planned for the outline keeps its clearance beside it.
        """
        plan, outline = self.plan, self._robot.footprint
        full, inner_m = plan.clearance_m, outline.inner_radius_m
        if plan.turns_on_the_spot:
            return sorted({full, outline.radius_m}, reverse=True)
        tried, wider = [0.6 * full, 0.3 * full, 0.0], []
        if not plan.beside_outline:
            tried = [outline.radius_m, *(inner_m + margin for margin in BESIDE_INNER_M)]
            wider = [outline.radius_m] if outline.radius_m > full else []
        less = sorted({clearance for clearance in tried if clearance < full}, reverse=True)
        return [full, *wider, *less]

    def lay_out(self, path: Path, heading_rad: float) -> None:
        """Follow a path from its first row on."""
        self.tracking.lay_out(path.states, path.turning_radius_m, heading_rad)
        kept_m = self.journal.plans[-1].clearance_m
        self._to_walls_m = min(WALL_M, max(0.5 * kept_m, LEAST_M)) if self.plan.beside_outline else 0.0

    def lay_out_back(self, back: FloatArray, heading_rad: float) -> None:
        """Follow (N, 3) states that it came along, backwards."""
        self.tracking.lay_out(back, self._robot.motion.least_turning_radius_m or 1.0, heading_rad)

    def tell(self, row: FloatArray) -> None:
        """Record a row (6,) of the reference."""
        x, y, theta, _, _, to_go_m = row.tolist()
        self._channel.tell(x, y, theta, to_go_m)

    def may_drive(self, command: Twist, pose: Pose2) -> bool:
        """Whether nobody walks where the command leads."""
        return self._gives_way.allows(command, pose, self.own_map.mapped_circles_m)

    def may_leave(self, command: Twist, pose: Pose2) -> bool:
        """Whether moreover the lasers show room for it."""
        return self.may_drive(command, pose) and self.last_word.allows(command)

    def held_up(self, to_go_m: float) -> None:
        """Count it, and keep what it sees, where that only stands: it will not go."""
        if self._has_mates or self._bodies.about:
            return
        self.holds.again(to_go_m)
        before_m = self._held_by_m[: 0 if self.holds.count == 1 else None]
        self._held_by_m = np.vstack([before_m, self.own_half.seen_m])

    def look(self, readings: Readings, belief: Belief) -> None:
        """Take in what the sensors show of what is on no map."""
        for_map = self._bodies.step(readings, belief)
        if self._mapper is not None:
            self._mapper.step(for_map, belief)
        # What it was shown stands: it leaves it no half of the way.
        self.own_half.look(readings, belief, self.own_map.mapped_circles_m)

    def slow_down(self, readings: Readings, pose: Pose2, share: float, *, by_map: bool) -> None:
        """Let the reference's clock run as fast as what the laser sees leaves room for.

        A ``share`` of the gap is kept before it; ``by_map`` also what the path keeps from the map's walls.
        """
        half, reference = self.own_half, self.tracking.reference
        speed_m_s = abs(reference.speed_m_s)
        within_m = half.stops_within_m(max(speed_m_s, self.config.speed_m_s))
        ahead = reference.ahead(within_m, half.reacts_s)
        fastest_m_s = half.fastest_m_s(pose, ahead, share, self._to_walls_m, by_map=by_map)
        if speed_m_s == 0.0:
            reference.rate = 1.0 if fastest_m_s > 0.0 else 0.0
            return
        slower = self._robot.motion.braking_m_s2 * self.dt_s / speed_m_s
        rate = min(max(fastest_m_s / speed_m_s, reference.rate - slower), reference.rate + slower, 1.0)
        if rate < STANDS:
            rate = 0.0
        if rate == 0.0 and not self.yielding.is_held:
            self.journal.count("waits")
            self.journal.say(readings.t_s, "wait", "somebody or something stands in its way")
        reference.rate = rate
