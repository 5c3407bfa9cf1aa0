"""What all states of the patrol navigator share: senses, the field to follow, what is known of the patrol."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.kernels.control import eikonal, voronoi_window
from pilotage.kernels.lines import clustering
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.radio import RadioConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, RadioMessages, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.navigator.patrol.battery import DOCK_M, Battery
from pilotage.stack.navigator.patrol.config import Mode, PatrolNavigatorConfig
from pilotage.stack.navigator.patrol.headway import Headway
from pilotage.stack.navigator.patrol.passage import CLAIM_M, Pursuit
from pilotage.stack.navigator.patrol.still import StillWatch
from pilotage.stack.patrol.messages import PatrolMemory
from pilotage.stack.patrol.roadmap import roadmap_of
from pilotage.stack.patrol.strategy import following
from pilotage.stack.patrol.task import PatrolTask
from pilotage.stack.patrol.watch import IntruderWatch
from pilotage.stack.patrol.word import Claim, Clearing, TeamWord

NO_FIELD: FloatArray = np.zeros((1, 1))
NO_POINTS: FloatArray = np.zeros((0, 2))
NO_DISCS: FloatArray = np.zeros((0, 3))
NO_GATE: voronoi_window.Gate = (np.zeros((2, 2)), 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0)
SECTORS = 72
NEAR_M = 1.6
"""Returns beyond this distance from the axle are out of the way of one decision."""
LATENCY_S = 0.05
SIGMAS = 3.0
DETOUR_SLACK_S = 1.0
NO_DETOUR_S = 6.0
"""A detour that takes longer than this is none: it waits instead."""
THERE_RATIO = 1.0
"""Where somebody stands on the place to visit, so much of ``visit_m`` away is as good, in time to go."""
LANE_AHEAD_M, MERGE_S = 2.0, 1.0
"""A passage is as wide as its narrowest place so far ahead; the last part of a way leads to the middle."""
HEARD_PERIODS = 4.0
"""Who said nothing for so many of its messages is silent."""
THROUGH_RATIO, THROUGH_RAD = 0.5, 1.75
"""It drives through a place, within so much of ``visit_m``, where it turns by no more than this."""
PEOPLE_M_S = 1.4
"""Who is no mate may come on at a walk, and gives way to nobody."""
SPEED_SHARE = 0.2
"""Weight of the newest edge in the speed made good."""


class Context:
    """The parts that the states drive with, and what the record wants to know.

    Attributes
    ----------
    t_s, pose
        Of this step.
    hop, target, came_from
        The vertex that it drives to now, the one that the strategy named, and the one that it was at last;
        the first two are the number of its charging station in the roadmap while it is on its way there.
    near, strange
        (K, 2) and (M, 2) returns of the last scan, base frame: what is near, and what is on no map.
    people
        (P, 2) those of ``strange`` that are of no mate.
    alarm
        When and where it last saw an intruder; NaN before.
    mates
        The last word of each team mate that was heard, by number, and when it was sent.
    taken
        Whether somebody who does not go stands where it drives to.
    claim
        Of the passage for one that it is in or about to enter.
    clearing
        What it tells others to do while it goes first.
    pursuit, headway
        Of the one ahead in the passage; its own towards its hop.
    battery
        What it reckons of its own; None where it never has to charge.
    """

    def __init__(
        self,
        config: PatrolNavigatorConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: PatrolTask,
        start: Pose2,
        journal: Journal,
    ) -> None:
        self.config, self.task, self.journal = config, task, journal
        self.name, self.dt_s = robot.name, robot.dt_s
        self._lidar, lidar = robot.one_sensor(LidarConfig, "navigator 'patrol'")
        self._odometry, _ = robot.one_sensor(WheelOdometryConfig, "navigator 'patrol'")
        self._radio = next(iter(robot.sensors_of(RadioConfig)), None)
        self._directions = clustering.beam_directions(
            float(lidar.beam_angles_rad()[0]), lidar.beam_step_rad, lidar.beams
        )
        self._mount = np.array([lidar.mount.x_m, lidar.mount.y_m, lidar.mount.theta_rad])
        self._known = chart.wall_field
        motion, radius = robot.motion, robot.radius_m
        period_s = max(1.0 / lidar.rate_hz, robot.dt_s)
        speed = motion.top_speed_m_s
        braking = min(motion.braking_m_s2, speed / robot.dt_s)
        turn_rate = motion.top_turn_rate_rad_s
        turning = min(motion.turn_acceleration_rad_s2, turn_rate / robot.dt_s)
        self._limits = np.array([speed, braking, braking, turn_rate, turning, period_s])
        self._safety = np.array([period_s + LATENCY_S, radius, config.margin_m, config.gap_m, PEOPLE_M_S])
        window = config.window
        costs = window.heading_s_per_rad, window.near_cost_s, window.soft_m
        self._window = window.horizon_s, *costs, window.speeds, window.turns
        self._clearance_m = radius + config.plan_margin_m
        self.radius_m, self.speed_m_s = radius, speed
        # Half the width of what has room for two.
        self._pass_m = 2.0 * radius + config.plan_margin_m + 0.5 * config.gap_m
        self.claim: Claim | None = None
        self.clearing: Clearing | None = None
        self._has_news, self.pursuit, self.headway = False, Pursuit(), Headway()
        self.roadmap = roadmap_of(
            chart,
            task.graph.vertices_xy_m,
            NO_POINTS if task.supply is None else task.supply.stations_xy_m,
            self._clearance_m,
            speed,
            config.spacing_m,
            0.5 * task.visit_m,
            config.lane_m,
        )
        self.battery: Battery | None = None
        if task.supply is not None:
            station = len(task.graph) + task.robot
            self.battery = Battery(task.supply, self.roadmap, station, speed)
        self.rng = robot.streams.stream("patrol")
        at = self.roadmap.nearest(start.x_m, start.y_m)
        self.memory = PatrolMemory(len(task.graph), task.robot, len(task.starts), at, speed)
        self.hop = self.target = self.came_from = at
        self._then = -1
        self._left_s, self._kept_out_s = 0.0, math.inf
        self.t_s, self.pose, self._spread_m = 0.0, start, 0.0
        self.near = self.strange = self.people = NO_POINTS
        self.fresh = False
        self._room: tuple[FloatArray, Pose2, tuple[float, float]] | None = None
        self._twist, self._command = STOP, STOP
        self.mates: dict[int, tuple[float, TeamWord]] = {}
        self.mode, self.to_go_s = Mode.DRIVE, math.nan
        self.blocked = self.taken = False
        self._watch, self._still = IntruderWatch(config.watch), StillWatch()
        self.alarm = (math.nan, math.nan, math.nan)
        self._next_word_s = float(self.rng.uniform(0.0, config.message_period_s))

    def sense(self, readings: Readings, belief: Belief, *, lost: bool) -> None:
        """Take in one step's readings."""
        self.t_s, self.pose, cov = readings.t_s, belief.pose, belief.cov
        self._spread_m = SIGMAS * math.sqrt(max(cov.item(0, 0), cov.item(1, 1)))
        odometry = readings.by_sensor.get(self._odometry)
        if isinstance(odometry, OdometryIncrement):
            self._twist = Twist(odometry.distance_m / self.dt_s, odometry.angle_rad / self.dt_s)
            if self.battery is not None:
                self.battery.spend(odometry.distance_m)
        said = None if self._radio is None else readings.by_sensor.get(self._radio)
        if isinstance(said, RadioMessages):
            for message in said.messages:
                if isinstance(message.content, TeamWord):
                    self.memory.receive(message.content.news)
                    self.mates[message.content.news.sender] = message.sent_s, message.content
        scan = readings.by_sensor.get(self._lidar)
        self.fresh = isinstance(scan, LidarScan)
        if isinstance(scan, LidarScan):
            self.near, self.strange = voronoi_window.scan_returns(
                scan.ranges_m,
                self._directions,
                self._mount,
                belief.pose.as_array(),
                NEAR_M,
                self.config.look_m,
                self.config.tolerance_m + self._spread_m,
                SIGMAS * math.sqrt(cov.item(2, 2)),
                self._field(lost=lost),
                SECTORS,
            )
            self.people = self._strangers()
            for x, y in self._watch.step(self._on_map(self.people)):
                self.journal.count("alarms")
                self.alarm = self.t_s, x, y
                text = f"somebody at ({x:.1f}, {y:.1f}) who is neither on the map nor of the team"
                self.say("intruder", text)

    def _strangers(self) -> FloatArray:
        """(P, 2) returns, base frame, that are of no mate; none while one is not heard: it may be it."""
        words = list(self.mates.values())
        if len(words) < len(self.task.starts) - 1 or not len(self.strange):
            return NO_POINTS
        there = self._on_map(self.strange)
        nobody = np.ones(len(there), dtype=np.bool_)
        for sent_s, word in words:
            away = np.hypot(there[:, 0] - word.x_m, there[:, 1] - word.y_m)
            # A mate that is lost may be anywhere, and is near to nothing that is NaN.
            nobody &= away > self.config.watch.mate_m + self.speed_m_s * (self.t_s - sent_s)
        return np.ascontiguousarray(self.strange[nobody])

    def _field(self, *, lost: bool) -> voronoi_window.Field:
        """Distances on its map, their origin and resolution; none where it does not know where it is."""
        x0, y0 = self._known.origin_xy_m
        return NO_FIELD if lost else self._known.distance_m, x0, y0, self._known.resolution_m

    def talk(self, *, lost: bool) -> None:
        """Broadcast, where it is time to."""
        due = self.t_s >= self._next_word_s
        if self._radio is None or not (due or self._has_news):
            return
        self._has_news = False
        if due:
            self._next_word_s += self.config.message_period_s
        x, y = (math.nan, math.nan) if lost else (self.pose.x_m, self.pose.y_m)
        self.memory.update(self.t_s, words=self.task.strategy.words(self.memory.knowledge(self.t_s)))
        news = self.memory.message(self.t_s)
        self.journal.outbox.append(TeamWord(x, y, self.blocked, self.claim, self.clearing, news))

    def away_m(self, place: int) -> float:
        """Distance from a vertex or its station as the crow flies."""
        return self.roadmap.away_m(place, self.pose.x_m, self.pose.y_m)

    @property
    def homeward(self) -> bool:
        """Whether it is on its way to its station."""
        return self.battery is not None and self.battery.low

    def arrived(self, *, blocked: bool) -> bool:
        """Whether it is near enough to where it drives to; what blocks a vertex may be there in its place."""
        if self.homeward:
            return self.away_m(self.hop) <= DOCK_M
        if blocked or self.taken:
            return self.away_m(self.hop) <= 0.9 * self.task.visit_m
        return self.away_m(self.hop) <= self._sure_m()

    def _sure_m(self) -> float:
        """How near it is to a place that it is at for sure."""
        visit_m = self.task.visit_m
        return max(min(self.task.near_m, 0.95 * visit_m - self._spread_m), 0.5 * visit_m)

    def runs_low(self) -> bool:
        """Whether it has to go to its station from now on; tells the others that its share is theirs."""
        if self.battery is None or self.battery.low or not self.battery.check(self.pose):
            return False
        self.memory.update(self.t_s, on_duty=False)
        self.say("battery", f"{self.battery.left_m:.0f} m are left: goes to its charging station")
        return True

    def charged(self) -> None:
        """On duty again."""
        assert self.battery is not None, "who has none does not charge"
        self.battery.fill()
        self.journal.count("charges")
        self.say("charged", "the battery is full: goes on with the patrol")
        self.memory.update(self.t_s, on_duty=True)
        self.came_from, self._left_s = self.roadmap.nearest(self.pose.x_m, self.pose.y_m), self.t_s

    def visit(self, vertex: int) -> None:
        """It is there."""
        edge_m = float(self.task.graph.edges_m[self.came_from, vertex])
        took_s = self.t_s - self._left_s
        if vertex != self.came_from and math.isfinite(edge_m) and took_s > 0.0:
            old = self.memory.own.speed_m_s
            new = (1.0 - SPEED_SHARE) * old + SPEED_SHARE * min(edge_m / took_s, self.speed_m_s)
            self.memory.update(self.t_s, speed_m_s=new)
        self.came_from, self._left_s, self._kept_out_s = vertex, self.t_s, math.inf
        self.memory.visit(vertex, self.t_s)

    def is_kept_out_for_long(self) -> bool:
        """Whether it has stood before passages, now and then, for ``hold_s`` since it was at a place."""
        self._kept_out_s = min(self._kept_out_s, self.t_s)
        return self.t_s - self._kept_out_s > self.config.hold_s

    def leave_to_mates(self, *, for_long: bool) -> bool:
        """Go on as if it had been where it is kept out of, if a mate stands there or has been there since.

        Who hears nobody takes it that who keeps it out ``for_long`` goes there.
        """
        if self.homeward:
            return False
        heard, (x, y) = self.heard(), self.roadmap.places_xy_m[self.hop]
        since_s = max(self._left_s, self.t_s - self.config.hold_s)
        left = self.memory.visited_s(self.hop) > since_s or any(
            math.hypot(word.x_m - x, word.y_m - y) <= self.task.visit_m for _, word in heard
        )
        if left or (for_long and not heard):
            self.came_from, self._left_s, self._kept_out_s = self.hop, self.t_s, math.inf
            self.memory.leave(self.hop, self.t_s)
            return True
        return False

    def ask(self) -> bool:
        """Let the strategy say where to go, or the battery; False where the strategy says to wait."""
        self._then = -1
        if self.battery is not None and (self.homeward or self.runs_low()):
            self.hop = self.target = self.battery.station
            return True
        graph, at = self.task.graph, self.came_from
        target = int(self.task.strategy.next_vertex(self.memory.knowledge(self.t_s)))
        self.target = target
        length_m = float(graph.shortest_m[at, target])
        self.memory.bound(target, self.t_s, self.t_s + length_m / max(self.memory.own.speed_m_s, 1e-3))
        if target == at:
            # It may have begun beside it, or made room for somebody.
            self.hop = at
            return self.away_m(at) > self.task.visit_m
        self.hop = int(graph.next_hop[at, target])
        after = target if self.hop != target else following(self.task.strategy)
        if after >= 0:
            self._then = int(graph.next_hop[self.hop, after])
        return True

    def lead(self, vertex: int, *, first: bool = False) -> Twist:
        """The command that leads to a vertex; ``first`` as below."""
        then = self._then if vertex == self.hop != self._then else -1
        at = self.roadmap.places_xy_m[vertex]
        return self.descend(self.roadmap.time_s(vertex), at, then=then, first=first)

    def room_ahead_m(self, time: FloatArray) -> tuple[float, float]:
        """Half the width of the narrowest place down a field, for claims and for lanes."""
        known, pose = self._room, self.pose
        if known is None or known[0] is not time or known[1] is not pose:
            room_m = self.roadmap.narrowest_m(pose.x_m, pose.y_m, time, CLAIM_M, LANE_AHEAD_M)
            self._room = known = time, pose, room_m
        return known[2]

    def descend(
        self, time: FloatArray, at: FloatArray | None = None, *, then: int = -1, first: bool = False
    ) -> Twist:
        """The command that leads down a field of the roadmap, to a place (2,) to visit if it leads to one.

        From there it is to go on to vertex ``then``; -1 where that is not known. Between two scans the last
        command stands. Who goes ``first`` drives on towards mates who talk.
        """
        roadmap, pose = self.roadmap, self.pose
        (x0, y0), spacing = roadmap.origin_xy_m, roadmap.spacing_m
        # Also between scans: the way to another vertex is not measured by what was left to the last one.
        self.to_go_s = eikonal.value_at(pose.x_m, pose.y_m, time, x0, y0, spacing, 0.0)
        if not self.fresh:
            return self._command
        room_m = self.room_ahead_m(time)[1]
        lane_m = min(self.config.lane_m, max(0.0, room_m - self._clearance_m)) if room_m < math.inf else 0.0
        lane_m *= min(1.0, self.to_go_s / MERGE_S)
        self.blocked = self.taken = False
        beside = self.strange
        if len(beside):
            beside = voronoi_window.within(beside, self.config.watch_m)
        around_m, body_m = self._clearance_m + 0.5 * self.config.gap_m, self._clearance_m + self.radius_m
        discs = _discs(self._on_map(beside), around_m) if len(beside) and not first else NO_DISCS
        still = self._still.step(self.t_s, self._mute(beside))
        if len(still):
            discs = np.concatenate([discs, _discs(still, body_m)])
            # Beside who stands where it wants to be it goes around him, on either side, and that will do.
            self.taken = at is not None and bool(np.hypot(*(still - at).T).min() < body_m)
            lane_m *= not self.taken
        if at is None or self.taken:
            then = -1
        v, w, held = self._choose(time, at, then, discs, lane_m)
        if held and lane_m > 0.0:
            # Beside a corner the lane may lead into it; the middle does not.
            v, w, held = self._choose(time, at, then, discs, 0.0)
        self._command = Twist(v, w)
        return self._command

    def _choose(
        self, time: FloatArray, at: FloatArray | None, then: int, discs: FloatArray, lane_m: float
    ) -> tuple[float, float, bool]:
        """Speed, turn rate, and whether it stays where it is: down a field, around discs (M, 3)."""
        pose = self.pose
        (x0, y0), spacing = self.roadmap.origin_xy_m, self.roadmap.spacing_m
        if len(discs):
            dx, dy = eikonal.descent(pose.x_m, pose.y_m, time, x0, y0, spacing)
            # Who follows the field is the point to the left of the robot: so must be what it goes around.
            discs = discs + lane_m * np.array([-dy, dx, 0.0])
        gate = self._gate(at, then, discs)
        if len(discs):
            time, x0, y0, around_s = self._detour(time, discs)
            self.blocked = not around_s < self.to_go_s + NO_DETOUR_S
        v, w, status = voronoi_window.choose(
            self._twist.v_m_s,
            self._twist.w_rad_s,
            pose.as_array(),
            self._limits,
            self._safety,
            (self.near, self.strange, self.people),
            (time, x0, y0, spacing),
            gate,
            self._field(lost=False),
            lane_m,
            self._window,
        )
        return v, w, status == voronoi_window.HELD

    def _detour(self, time: FloatArray, discs: FloatArray) -> tuple[FloatArray, float, float, float]:
        """A field around discs (M, 3), near by: the window, its origin, and the time at the robot."""
        (x0, y0), spacing = self.roadmap.origin_xy_m, self.roadmap.spacing_m
        x, y, reach_m = self.pose.x_m, self.pose.y_m, self.config.watch_m
        there_s = THERE_RATIO * self.task.visit_m / self.speed_m_s
        slow = self.roadmap.slowness
        return eikonal.detour(time, slow, x0, y0, spacing, x, y, reach_m, discs, DETOUR_SLACK_S, there_s)

    def _gate(self, at: FloatArray | None, then: int, discs: FloatArray) -> voronoi_window.Gate:
        """The place (2,) that it passes on its way to vertex ``then``, if it is near and no sharp turn."""
        near_m = min(self._sure_m(), THROUGH_RATIO * self.task.visit_m)
        origin, spacing = self.roadmap.origin_xy_m, self.roadmap.spacing_m
        reach_m = near_m + self._window[0] * self.speed_m_s
        if then < 0 or at is None:
            return NO_GATE
        x, y = at.tolist()
        if math.hypot(x - self.pose.x_m, y - self.pose.y_m) > reach_m:
            return NO_GATE
        on = self.roadmap.time_s(then)
        away = eikonal.descent(x, y, on, *origin, spacing)
        back = eikonal.descent(x, y, self.roadmap.time_s(self.came_from), *origin, spacing)
        turn_rad = math.acos(min(1.0, max(-1.0, -away[0] * back[0] - away[1] * back[1])))
        if turn_rad > THROUGH_RAD:
            return NO_GATE
        x0, y0 = origin
        if len(discs):
            on, x0, y0, _ = self._detour(on, discs)
        left_s = eikonal.value_at(x, y, on, x0, y0, spacing, 0.0)
        if not math.isfinite(left_s):
            return NO_GATE
        # The turn is to be made, sooner or later: who puts it off has not been spared it.
        return on, x0, y0, spacing, x, y, near_m, left_s + self._window[1] * turn_rad

    def _mute(self, beside: FloatArray) -> FloatArray:
        """(K, 2) middles, map frame, of bodies among returns that no mate who talks says it is."""
        if not len(beside):
            return NO_POINTS
        # Whoever is met is as large as the robot itself; its near side alone is seen.
        middles = self._on_map(voronoi_window.bodies(beside, self.radius_m))
        talk = [
            (word.x_m, word.y_m, self.radius_m + self.speed_m_s * (self.t_s - sent_s))
            for sent_s, word in self.mates.values()
            if self.t_s - sent_s < 3.0 * self.config.message_period_s
        ]
        mute = [
            not any(math.hypot(x - word_x, y - word_y) < reach_m for word_x, word_y, reach_m in talk)
            for x, y in middles.tolist()
        ]
        return middles[np.array(mute, dtype=np.bool_)]

    def careful(self, command: Twist) -> Twist:
        """A command slowed down until its braking ends clear of everything, all of which may move."""
        if not self.fresh:
            return self._command
        v, now = command.v_m_s, self._twist
        for _ in range(4):
            if voronoi_window.stop_is_clear(
                now.v_m_s,
                now.w_rad_s,
                v,
                command.w_rad_s,
                self._limits,
                self._safety,
                (self.near, self.near, NO_POINTS),
                self.pose.as_array(),
                self._field(lost=True),
            ):
                break
            v *= 0.5
        else:
            v = 0.0
        self._command = Twist(v, command.w_rad_s)
        return self._command

    @property
    def moving_m_s(self) -> float:
        """By the odometry."""
        return abs(self._twist.v_m_s)

    def stand(self) -> Twist:
        """Stop."""
        self._command = STOP
        return STOP

    def _on_map(self, points: FloatArray) -> FloatArray:
        """Points (M, 2) of the base frame on the map."""
        if not len(points):
            return points
        c, s = math.cos(self.pose.theta_rad), math.sin(self.pose.theta_rad)
        return np.asarray(points @ np.array([[c, s], [-s, c]]) + np.array([self.pose.x_m, self.pose.y_m]))

    @property
    def pass_m(self) -> float:
        """Half the width of what has room for two."""
        return self._pass_m

    def heard(self) -> list[tuple[int, TeamWord]]:
        """The last words of mates that were heard lately, with their numbers."""
        latest_s = self.t_s - HEARD_PERIODS * self.config.message_period_s
        return [(number, word) for number, (sent_s, word) in self.mates.items() if sent_s > latest_s]

    def hears_all(self) -> bool:
        """Whether no mate is silent, or lost."""
        words = self.heard()
        return len(words) == len(self.task.starts) - 1 and all(math.isfinite(word.x_m) for _, word in words)

    def mate_reach_m(self, number: int) -> float:
        """Within so far of where a mate said it is, what is seen may be that mate."""
        return self.config.watch.mate_m + self.speed_m_s * (self.t_s - self.mates[number][0])

    def tell_claim(self, claim: Claim | None) -> None:
        """Claim a passage, or none any more; told at once where that is news."""
        old, self.claim = self.claim, claim
        if old is None and claim is None:
            return
        before, now = (None if c is None else (c.since_s, c.inside) for c in (old, claim))
        self._has_news |= before != now

    def strange_on_map(self) -> FloatArray:
        """(M, 2) what is on no map, map frame."""
        return self._on_map(self.strange)

    def bodies_on_map(self) -> FloatArray:
        """(K, 2) middles of those who are seen, map frame."""
        return self._on_map(voronoi_window.bodies(self.strange, self.radius_m))

    def here(self) -> FloatArray:
        """(1, 3) the place where it is, as a path; (0, 3) off the map."""
        time = self.roadmap.time_s(self.came_from)
        return self.roadmap.way(self.pose.x_m, self.pose.y_m, time, 0.0)

    def is_off_roadmap(self) -> bool:
        """Whether nothing leads from where it is, nor from beside it, to where it was last."""
        roadmap, (x, y) = self.roadmap, (self.pose.x_m, self.pose.y_m)
        grid = roadmap.time_s(self.came_from), *roadmap.origin_xy_m, roadmap.spacing_m
        return eikonal.value_at(x, y, *grid, 0.0) == math.inf and eikonal.descent(x, y, *grid) == (0.0, 0.0)

    def is_narrow(self) -> bool:
        """Whether there is room for one where it is."""
        return bool((self.here()[:, 2] < self._pass_m).any())

    def crowded(self, reach_m: float) -> bool:
        """Whether something that may move is so near to the body's edge."""
        return bool((np.hypot(*self.strange.T) < reach_m + self.radius_m).any())

    def waits_for(self) -> bool:
        """Whether a mate with a smaller number, that is blocked and near, is to go first."""
        return any(
            number < self.task.robot
            and self.t_s - sent_s < 3.0 * self.config.message_period_s
            and word.blocked
            and math.hypot(word.x_m - self.pose.x_m, word.y_m - self.pose.y_m) < self.config.watch_m
            for number, (sent_s, word) in self.mates.items()
        )

    def say(self, kind: str, text: str) -> None:
        """Tell that something happened."""
        self.journal.say(self.t_s, kind, text)


def _discs(middles_xy_m: FloatArray, radius_m: float) -> FloatArray:
    """(M, 3) discs of one radius."""
    return np.column_stack([middles_xy_m, np.full(len(middles_xy_m), radius_m)])
