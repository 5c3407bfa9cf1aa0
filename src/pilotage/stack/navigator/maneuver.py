"""The navigator that follows its plan exactly, forwards and backwards: parking, tight turns."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.sensors.sensor import Positive
from pilotage.stack.control.controller import Controller
from pilotage.stack.control.give_way import GiveWay, GiveWayConfig
from pilotage.stack.control.kanayama import KanayamaConfig, KanayamaController
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.control.own_half import OwnHalf, OwnHalfConfig
from pilotage.stack.control.wander import WanderConfig
from pilotage.stack.interface import NAVIGATORS, Belief, BeliefStatus, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.global_plan import GlobalPlan
from pilotage.stack.navigator.navigator import (
    LocalizingNavigator,
    Parts,
    check_keeps_time,
    localizer_of,
    missing,
    only_goal,
    unexplained_of,
)
from pilotage.stack.navigator.own_map import OwnMap
from pilotage.stack.navigator.reference import STANDS, Ends, Reference
from pilotage.stack.navigator.timed_path import laid_out, with_turns
from pilotage.stack.navigator.trail import Trail
from pilotage.stack.navigator.wandering import Wandering
from pilotage.stack.navigator.yielding import Act, Yielding, YieldingConfig
from pilotage.stack.perception.moving_bodies import MovingBodies, MovingBodiesConfig
from pilotage.stack.planning.outline import car_of, ground_of
from pilotage.stack.planning.plan_status import PlanStatus
from pilotage.stack.planning.planner import Path, PlanResult

MOST_REPLANS, MOST_RESTS = 8, 3
"""How often it plans anew where it went astray, and for what a path that covers a floor left of it."""
SURE = 0.5
"""A place that is known better than to this share of what is astray: a standard deviation."""
LOOK_S = 2.0
"""A robot that believes to stand in a wall looks around for so long before it plans anew: once, or until it
knows its place."""
BESIDE_INNER_M = (0.25, 0.2, 0.15, 0.08, 0.04, 0.01)
"""What paths planned for the centre keep beside the outline's inner disc, where they can keep no more."""
HEADING_PER_S, NEARS_PER_S = 3.0, 3.0
"""A heading error dies out in so much of a second's inverse while it turns on the spot, and what is left of a
line where it stops at its end."""
TURN_ACCELERATION_SHARE = 0.8
"""Of the motion's, as turns on the spot begin and end: what is left is for mending errors."""
THERE_M, FACES_RAD, SETTLES_S = 0.005, 0.02, 1.5
"""It goes on at a corner where it is so near to a line's end, or faces the next line so well, or after so
long: an estimate may be vaguer than that."""
AROUND, BACKING = 0.6, 0.2
"""Shares of the gap that are kept where it drives around somebody, and where it backs out before him."""
WALL_M, LEAST_M = 0.02, 0.005
"""Kept from the walls of the map on a path for the outline, or half of what the path keeps; and at least."""
MOST_STOPS, STEP_BACK_M = 12, 0.5
"""How often it plans anew where its lasers show no room for its plan, and from how far before that."""
GOT_ON_M = 2.0
"""With so much less to go than when it was stopped first it has got on: a sweep meets many a nook."""
DOUBT_S = 10.0
"""Who is lost stands for so long, and drives about then."""
SEEN_M = 0.05
"""What is seen and on no map counts as discs of this radius where a path around it is planned."""


ARCS = KanayamaConfig(along_per_s=1.0, length_m=0.45)
"""Steered axles follow arcs softly."""
LINES = KanayamaConfig(along_per_s=3.0, length_m=0.2)
"""Lines begin at rest, after a turn that leads them astray by little, and may be no longer than this."""


class ManeuverConfig(Config):
    """How fast, and when a maneuver has gone wrong."""

    speed_m_s: Positive = 0.5
    acceleration_share: float = Field(default=0.4, gt=0.0, le=1.0)
    """Of the motion's braking, in the speed profile."""
    turn_share: float = Field(default=0.5, gt=0.0, le=1.0)
    """Of the top turn rate, for turns on the spot at a path's corners."""
    pause_s: float = Field(default=0.8, ge=0.0)
    """At each change of direction: the wheels turn meanwhile."""
    astray_m: Positive = 0.25
    """Farther from its reference than this it stops and plans anew."""
    tracking: KanayamaConfig | None = None
    """Of the tracking law, where the stack names no controller; None: along 1.0 / s within 0.45 m, and on
    lines with turns on the spot at their corners along 3.0 / s within 0.2 m."""
    own_half: OwnHalfConfig = OwnHalfConfig()
    """How near it comes to what its laser sees and its map does not explain."""
    yielding: YieldingConfig = YieldingConfig()
    """What it does where that stays in its way."""
    moving_bodies: MovingBodiesConfig = MovingBodiesConfig()
    wander: WanderConfig = WanderConfig()
    """How it drives about while it is lost."""
    give_way: GiveWayConfig = GiveWayConfig()
    """Alone on its floor it gives way to who walks; mates each stop in their own half."""


@NAVIGATORS.add("maneuver", ManeuverConfig)
class ManeuverNavigator(LocalizingNavigator):
    """Follows a plan with its changes of direction by a speed profile; the plan is made on the true outline.

    A robot that turns on the spot does so at the path's corners, so that it drives the very lines of a sweep.

    It drives no faster than lets it stop, along its path and with its outline, on its own half of the way to
    whatever its laser sees that is on no map: team mates, people, things. Without mates on its floor it gives
    way to who walks, who comes farther than his half. Where that stays in the way it
    plans around it, or backs out of the way that it came. Where it cannot keep up with the plan it plans
    anew; what a path that covers a floor left of it, as far as the robot knows, is driven in the end. Lost,
    it stands, and drives about after a while, a car ahead and back in turn; told nothing of its start it does
    so at once, and plans from where it finds itself.
    """

    def __init__(
        self,
        config: ManeuverConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: Parts,
        journal: Journal,
    ) -> None:
        goal = only_goal(task, "maneuver")
        if goal is None or parts.planner is None:
            absent = missing({"world.goal": goal, "stack.planner": parts.planner})
            raise InputError(f"navigator 'maneuver': expected world.goal and stack.planner, found {absent}")
        super().__init__(localizer_of(parts, "maneuver"), journal)
        self._channel = journal.channel(
            {"ref_x_m": "m", "ref_y_m": "m", "ref_theta_rad": "rad", "distance_to_go_m": "m"}, first=True
        )
        self._config, self._robot, self._goal = config, robot, goal
        check_keeps_time(parts, "maneuver")
        self._controller: Controller = parts.controller or KanayamaController(config.tracking or ARCS, robot)
        sharper = parts.controller is None and config.tracking is None
        self._on_lines = KanayamaController(LINES, robot) if sharper else self._controller
        self._mapper, self._mates = parts.mapper, task.mates
        self._own_map = OwnMap(chart, parts.mapper)
        car = car_of(robot.footprint, WALL_M, 1.0)
        walls = car, ground_of(chart.field, car)
        self._own_half = OwnHalf(config.own_half, robot, chart, unexplained_of(parts), walls)
        self._bodies = MovingBodies(
            config.moving_bodies, robot, chart, minds=not task.mates, unexplained=self._own_half.unexplained
        )
        self._gives_way = GiveWay(config.give_way, robot, self._bodies)
        self._begin_anew()
        rng = robot.streams.stream("planner")
        self._plan = GlobalPlan(
            parts.planner, parts.smoother, chart, rng, journal, robot=robot, as_planned=True
        )
        self._reference = Reference(np.zeros((0, 5)), robot.dt_s)
        self._last_word = LastWord(robot)
        self._wandering = Wandering(config.wander, robot, self._localizer, self._last_word)
        self._lost_s, self._wandered = math.inf, False
        self._replans, self._rests = 0, 0
        self._backs = False
        self._law, self._has_corners, self._settles_s = self._controller, False, 0.0
        self._to_walls_m = 0.0
        self._trail: Trail | None = None
        self._think_at_s = 0.0
        if self.belief.status is BeliefStatus.LOST:
            self._lost_s = -DOUBT_S
            return
        self._think(0.0)
        if self._plan.hopeless and self._plan.too_tight:
            raise InputError(
                f"navigator 'maneuver': {self._reason}; or take rrt-star-dubins, or stack.smoother: shortcut"
            )

    def _think(self, t_s: float) -> None:
        """Plan from where it believes to be, and lay out the reference, one row a step."""
        plan = self._plan
        result = self._planned(t_s)
        looked, self._think_at_s = self._think_at_s > 0.0, math.inf
        if result.status is PlanStatus.START_BLOCKED and not (looked and self._is_sure):
            self._think_at_s = t_s + LOOK_S
            return
        if result.path is None or plan.path is None:
            self._end(t_s, StackStatus.FAILED, f"{result.status}: {result.reason}")
            return
        if result.covers and self._trail is None:
            self._trail = Trail()
        self._lay_out(plan.path)
        self._journal.say(t_s, "plan" if t_s == 0.0 else "replan", result.reason)

    def _planned(self, t_s: float, *, rest: bool = False, around: bool = False) -> PlanResult:
        """What was found from where it believes to be; ``around`` all that it sees, or not at all."""
        trail = None if self._trail is None else self._trail.rows
        found = self._own_map.found_circles_m
        if around:
            cells = np.round(self._own_half.seen_m / SEEN_M).astype(np.int64)
            seen = self._own_half.seen_m[np.unique(cells, axis=0, return_index=True)[1]]
            found = np.vstack([found, np.column_stack([seen, np.full(len(seen), SEEN_M)])])
        clearances_m, pose = self._clearances_m(), self.belief.pose
        if around:
            # Who can wait as well does not squeeze through where nothing is left beside its outline.
            some_m = [clearances_m[0], *clearances_m[1:-1][-1:]]
            result = self._plan.make(t_s, pose, self._goal, found, some_m, trail=trail)
            if result.status is not PlanStatus.START_BLOCKED:
                return result
        result = self._plan.make(t_s, pose, self._goal, found, clearances_m, trail=trail, rest=rest)
        if result.path is not None or around or rest or not len(found):
            return result
        # What it mapped may have gone by the time that it is there: it stops before what has not.
        return self._plan.make(t_s, pose, self._goal, found[:0], clearances_m, trail=trail)

    def _lay_out(self, path: Path) -> None:
        """The reference along a path, from its first row on."""
        self._lay_out_states(path.states, path.turning_radius_m)
        kept_m = self._journal.plans[-1].clearance_m
        self._to_walls_m = min(WALL_M, max(0.5 * kept_m, LEAST_M)) if self._plan.beside_outline else 0.0

    def _lay_out_states(self, states: FloatArray, turning_radius_m: float) -> None:
        braking = self._robot.motion.braking_m_s2
        acceleration = self._config.acceleration_share * (braking if math.isfinite(braking) else 2.0)
        speed = min(self._config.speed_m_s, self._robot.motion.top_speed_m_s)
        dt_s, motion = self._robot.dt_s, self._robot.motion
        turns = motion.least_turning_radius_m == 0.0
        rate = (self._config.turn_share if turns else 1.0) * motion.top_turn_rate_rad_s
        if turning_radius_m == 0.0:
            heading = self.belief.pose.theta_rad
            turning = TURN_ACCELERATION_SHARE * motion.turn_acceleration_rad_s2
            rows = with_turns(states, heading, rate, speed, acceleration, dt_s, turning)
        else:
            wheels, pause_s = motion.curvature_rate_per_m_s, 0.0 if turns else self._config.pause_s
            rows = laid_out(states, speed, acceleration, wheels, pause_s, dt_s, rate)
        self._reference, self._backs = Reference(rows, dt_s), False
        self._has_corners, self._settles_s = turning_radius_m == 0.0, 0.0
        self._law = self._on_lines if self._has_corners else self._controller
        self._law.reset()

    def _clearances_m(self) -> list[float]:
        """Clearances to try in turn: the planner's own, and less.

        A path that is planned for the centre has to keep at least what the outline's inner disc needs, and
        where its corners need more than that and than the planner's own, the disc around it; one that is
        planned for the outline keeps its clearance beside it.
        """
        plan, outline = self._plan, self._robot.footprint
        full, inner_m = plan.clearance_m, outline.inner_radius_m
        if plan.turns_on_the_spot:
            return sorted({full, outline.radius_m}, reverse=True)
        tried, wider = [0.6 * full, 0.3 * full, 0.0], []
        if not plan.beside_outline:
            tried = [outline.radius_m, *(inner_m + margin for margin in BESIDE_INNER_M)]
            wider = [outline.radius_m] if outline.radius_m > full else []
        less = sorted({clearance for clearance in tried if clearance < full}, reverse=True)
        return [full, *wider, *less]

    def step(self, readings: Readings) -> Twist:
        """Localize, move the reference on, and follow it."""
        belief = self._localizer.step(readings)
        self._last_word.take_in(readings)
        return self._last_word.leaving(self._command(readings, belief))

    def _command(self, readings: Readings, belief: Belief) -> Twist:
        if self._status is not StackStatus.RUNNING:
            return STOP
        if belief.status is BeliefStatus.LOST:
            return self._looks_around(readings)
        self._lost_s = math.inf
        if self._wandered:
            self._wandered = False
            self._journal.say(readings.t_s, "found", "the robot knows where it is and plans from there")
            self._begin_anew()
            self._think(readings.t_s)
        if readings.t_s >= self._think_at_s:
            self._think(readings.t_s)
        if self._think_at_s < math.inf or self._status is not StackStatus.RUNNING:
            return STOP
        pose = belief.pose
        if self._trail is not None:
            self._trail.add(self.belief)
        settles = self._settles(pose)
        if self._reference.done and not settles:
            self._ends(readings.t_s)
            return STOP
        self._heed(readings, belief)
        # By where the reference is now: a step leads some way on, farther than astray in a long one.
        there, speed_m_s = self._reference.pose(), self._reference.speed_m_s
        row = self._reference.hold() if settles else self._reference.step()
        x, y, theta, v, w, to_go_m = row.tolist()
        self._channel.tell(x, y, theta, to_go_m)
        if math.hypot(there[0] - pose.x_m, there[1] - pose.y_m) > self._config.astray_m:
            return self._astray(readings.t_s)
        rate = self._reference.rate
        command = STOP if rate == 0.0 else self._toward(pose, Pose2(x, y, theta), Twist(v, w))
        if settles and rate > 0.0 and self._reference.ends is Ends.LINE:
            command = Twist(NEARS_PER_S * self._short_m(pose), 0.0)
        waits = not self._gives_way.allows(command, pose, self._own_map.mapped_circles_m)
        if not waits and not self._last_word.allows(command):
            shown_m = pose.placed(self._last_word.shown_m)
            # What no map explains may go by itself: as before all that it heeds it waits.
            waits = self._own_half.sees(shown_m)
            if not waits:
                return self._stops_short(readings.t_s, shown_m, to_go_m)
        if waits:
            self._reference.stay()
            (x, y, theta), rate, command = there.tolist(), 0.0, STOP
        act = self._yielding.step(rate, rate * abs(speed_m_s) * self._robot.dt_s, backs=self._backs)
        self._yielding.drove(np.array([x, y, theta]), backs=self._backs)
        if act is not Act.NOTHING:
            return self._yields(readings.t_s, act)
        return command

    def _short_m(self, pose: Pose2) -> float:
        """How much of a line is left before its end; negative behind it."""
        x, y, theta = self._reference.pose().tolist()
        return float(math.cos(theta) * (x - pose.x_m) + math.sin(theta) * (y - pose.y_m))

    def _settles(self, pose: Pose2) -> bool:
        """Whether it is at a corner, and not yet where a line ends or where the next one leads.

        What it turns away short of a line's end it does not sweep, and is beside the next line; as is who
        sets out on that askew. No line is long enough to make up for it.
        """
        ends = self._reference.ends
        if not self._has_corners or ends is Ends.NEITHER:
            self._settles_s = 0.0
            return False
        if ends is Ends.LINE:
            off = self._short_m(pose) > THERE_M
        else:
            off = abs(wrap_to_pi(float(self._reference.pose()[2]) - pose.theta_rad)) > FACES_RAD
        self._settles_s = self._settles_s + self._robot.dt_s if off else 0.0
        return off and self._settles_s <= SETTLES_S

    def _looks_around(self, readings: Readings) -> Twist:
        """Lost: it waits, as doubts pass, and drives about then, for who stands sees nothing new."""
        self._lost_s = min(self._lost_s, readings.t_s)
        if readings.t_s - self._lost_s < DOUBT_S:
            return STOP
        if not self._wandered:
            self._wandered = True
            self._journal.say(readings.t_s, "lost", "the robot does not know where it is: drives about")
        return self._wandering.step(readings)

    def _begin_anew(self) -> None:
        """Nothing leads back to where it was."""
        self._yielding = Yielding(
            self._config.yielding, self._robot.dt_s, self._robot.streams.stream("yielding")
        )
        self._stops, self._stopped_to_go_m = 0, math.inf

    def _toward(self, pose: Pose2, there: Pose2, feedforward: Twist) -> Twist:
        """The command that follows the reference."""
        v, w = feedforward.v_m_s, feedforward.w_rad_s
        if v == 0.0:
            turns = self._robot.motion.least_turning_radius_m == 0.0
            # As in the tracking law the reference is meant for the step's end.
            off_rad = wrap_to_pi(there.theta_rad - pose.theta_rad - w * self._robot.dt_s)
            return Twist(0.0, w + HEADING_PER_S * off_rad if turns else w)
        twist = self._law.step(pose, there, feedforward).twist
        # The way back along the path is the other direction's: a piece is driven in its own only.
        return Twist(max(twist.v_m_s, 0.0) if v > 0.0 else min(twist.v_m_s, 0.0), twist.w_rad_s)

    def _stops_short(self, t_s: float, shown_m: FloatArray, to_go_m: float) -> Twist:
        """A laser shows a wall where the plan leads: with (K, 2) of it on its own map it plans anew.

        From some way back, where it can: beside what it almost touches there is no room for a plan. It gives
        up where it gets no farther along its plans.
        """
        if not self._backs and to_go_m < self._stopped_to_go_m - GOT_ON_M:
            self._stops, self._stopped_to_go_m = 0, to_go_m
        self._stops += 1
        if self._stops > MOST_STOPS:
            self._end(t_s, StackStatus.FAILED, "stuck: its lasers show no room where its plans lead")
            return STOP
        self._own_map.show(shown_m)
        self._journal.count("replans")
        back = np.zeros((0, 3)) if self._backs else self._yielding.way_back(STEP_BACK_M)
        if len(back):
            self._lay_out_states(back, self._robot.motion.least_turning_radius_m or 1.0)
            self._backs = True
            self._journal.say(t_s, "back-out", "its lasers show no room where its plan leads: backs out")
        else:
            self._backs = False
            self._think(t_s)
        return STOP

    def _heed(self, readings: Readings, belief: Belief) -> None:
        """Let the reference's clock run as fast as what the laser sees leaves room for."""
        for_map = self._bodies.step(readings, belief)
        if self._mapper is not None:
            self._mapper.step(for_map, belief)
        half, reference = self._own_half, self._reference
        # What it was shown stands: it leaves it no half of the way.
        half.look(readings, belief, self._own_map.mapped_circles_m)
        speed_m_s = abs(reference.speed_m_s)
        within_m = half.stops_within_m(max(speed_m_s, self._config.speed_m_s))
        share = BACKING if self._backs else AROUND if self._yielding.tries else 1.0
        ahead = reference.ahead(within_m, half.reacts_s)
        # Where a wall was not where its map has it what it backs out by is what its lasers show.
        by_map = not (self._backs and self._stops)
        fastest_m_s = half.fastest_m_s(belief.pose, ahead, share, self._to_walls_m, by_map=by_map)
        if speed_m_s == 0.0:
            reference.rate = 1.0 if fastest_m_s > 0.0 else 0.0
            return
        motion, dt_s = self._robot.motion, self._robot.dt_s
        slower = motion.braking_m_s2 * dt_s / speed_m_s
        rate = min(max(fastest_m_s / speed_m_s, reference.rate - slower), reference.rate + slower, 1.0)
        if rate < STANDS:
            rate = 0.0
        if rate == 0.0 and not self._yielding.is_held:
            self._journal.count("waits")
            self._journal.say(readings.t_s, "wait", "somebody or something stands in its way")
        reference.rate = rate

    def _yields(self, t_s: float, act: Act) -> Twist:
        """Having been held up for long: around what it sees, or back the way that it came."""
        if self._yielding.gives_up and not self._mates:
            self._end(t_s, StackStatus.FAILED, "stuck: something stands in its way, and nothing leads around")
            return STOP
        back = self._yielding.way_back() if act is Act.BACK else np.zeros((0, 3))
        if len(back):
            self._lay_out_states(back, self._robot.motion.least_turning_radius_m or 1.0)
            self._backs = True
            self._journal.say(t_s, "back-out", "backs out the way that it came")
        elif not self._goes_around(t_s) and self._backs and self._stops:
            self._backs = False
            self._think(t_s)
        return STOP

    def _goes_around(self, t_s: float) -> bool:
        """Whether there is a path around all that it sees; then it is taken."""
        result = self._planned(t_s, around=True)
        if result.path is None or self._plan.path is None:
            return False
        self._lay_out(self._plan.path)
        self._journal.count("replans")
        self._journal.say(t_s, "replan", f"around what stands in its way: {result.reason}")
        return True

    def _ends(self, t_s: float) -> None:
        """At the path's end: there, or with something left, or where it backed out to."""
        if self._backs:
            self._backs = False
            if not self._goes_around(t_s):
                self._think(t_s)
        elif not self._goes_for_the_rest(t_s):
            self._status = StackStatus.ARRIVED
            self._journal.say(t_s, "arrived", "the plan was driven to its end")

    def _goes_for_the_rest(self, t_s: float) -> bool:
        """Whether what it drove along left something, and there is a path to that.

        Where there is none beside what its lasers showed where it stopped, as if it had not been shown
        that: a doubtful place shuts a passage for as long as it takes to sweep all else, not for good.
        """
        if self._trail is None or self._rests == MOST_RESTS:
            return False
        self._rests += 1
        result = self._planned(t_s, rest=True)
        if not result.covers and self._own_map.forgets():
            result = self._planned(t_s, rest=True)
        if result.path is None or not result.covers:
            return False
        self._lay_out(result.path)
        self._journal.say(t_s, "rest", f"what was driven left some of it: {result.reason}")
        return True

    @property
    def _is_sure(self) -> bool:
        """Whether a place that it should not be at is where it is, not what its estimate jumped to."""
        return self.belief.std_m < SURE * self._config.astray_m

    def _astray(self, t_s: float) -> Twist:
        """Plan anew; what a vague estimate's jumps ask for does not count against it."""
        self._yielding.forget()
        self._replans += self._is_sure
        if self._replans > MOST_REPLANS:
            self._end(t_s, StackStatus.FAILED, "stuck: it cannot keep to its plans")
        else:
            self._journal.count("replans")
            self._think(t_s)
        return STOP
