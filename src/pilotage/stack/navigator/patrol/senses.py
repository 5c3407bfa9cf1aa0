"""What a robot on patrol senses: where it believes to be, who is around it, and what mates said last."""

from __future__ import annotations

import math
from collections.abc import ItemsView

import numpy as np

from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.kernels.control import disc_returns
from pilotage.kernels.geometry.field import Field
from pilotage.kernels.lines import clustering
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.radio import RadioConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, RadioMessages, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.control.brakes import Brakes
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.navigator.patrol.config import PatrolNavigatorConfig
from pilotage.stack.navigator.patrol.mates import Mates
from pilotage.stack.patrol.last_words import LEAST_LOSS, LastWords
from pilotage.stack.patrol.task import PatrolTask
from pilotage.stack.patrol.watch import IntruderWatch
from pilotage.stack.patrol.word import Talk, TeamWord

NO_FIELD: FloatArray = np.zeros((1, 1))
NO_POINTS: FloatArray = np.zeros((0, 2))
NO_DISCS: FloatArray = np.zeros((0, 3))
AS_ONE = np.array([1.0, 1j])
"""A place as one number, for finding returns among others."""
SECTORS = 72
NEAR_M = 1.6
"""Returns beyond this distance from the axle are out of the way of one decision, of a robot that stops in
less."""
LATENCY_S = 0.05
PEOPLE_M_S = 1.4
"""Who is no mate may come on at a walk, and gives way to nobody."""
SHIFT_M = 0.1
"""Of a body that stands another part may be seen from one scan to the next."""
SIGMAS = 3.0
TOLD_M, FAILED_M = 0.2, 0.35
"""What a mate may be wrong about its place by, and how far off a body is seen besides."""
SWAY_M = 0.03
"""What two who pass each other stray from their lanes by, in all, to each side of the middle."""
AT_REST_M_S = 0.05
HEARD_PERIODS = 4.0
"""Who said nothing for so many of its messages is silent, where no more are lost than of good radios."""
NO_WONDER_LOG = math.log(0.05)
"""A silence likelier than this by chance, of words that were due in reach, tells of nothing but distance."""
MOST_LOSS = 0.95
"""Of a radio from which hardly anything arrives, as far as waiting for a word goes."""


class Senses:
    """Takes in the readings of each step.

    Attributes
    ----------
    t_s, pose, spread_m
        Of this step; how far off it may be.
    twist
        By the odometry; where that is too rough to brake by, its speed by what it was told as well.
    brakes
        As they have proved so far.
    fresh
        Whether this step has a scan.
    near, strange
        (K, 2) and (M, 2) returns of the last scan, base frame: what is near, and what is on no map.
    people
        (P, 2) those of ``strange`` that are of no mate.
    alarm
        When and where it last saw an intruder; NaN before.
    mates
        The last word of each team mate that was heard, by number, and when it was sent.
    period_s
        Between two scans.
    radius_m, speed_m_s
        Its own, at most.
    pass_m
        Half the width of what has room for itself and any of its mates.
    talk_habit
        How it talks itself.
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
        self.dt_s, self.radius_m, self.speed_m_s = robot.dt_s, robot.radius_m, robot.motion.top_speed_m_s
        self.pass_m = self.radius_m + task.widest_mate_m + config.plan_margin_m + 0.5 * config.gap_m + SWAY_M
        self._lidar, lidar = robot.one_sensor(LidarConfig, "navigator 'patrol'")
        self._odometry, _ = robot.one_sensor(WheelOdometryConfig, "navigator 'patrol'")
        radios = robot.sensors_of(RadioConfig)
        self._radio = next(iter(radios), None)
        self.talk_habit = _habit(next(iter(radios.values()), None), config.message_period_s, self.speed_m_s)
        self._delay_s = max((radio.delay_s for radio in radios.values()), default=0.0)
        self._patience_s = self.patience_s(HEARD_PERIODS)
        self._last_words = LastWords(len(task.starts), chart.bounds_m)
        self._directions = clustering.beam_directions(
            float(lidar.beam_angles_rad()[0]), lidar.beam_step_rad, lidar.beams
        )
        self._look_m = min(config.look_m, lidar.max_range_m)  # a beam that met nothing reads its reach
        self._mount = np.array([lidar.mount.x_m, lidar.mount.y_m, lidar.mount.theta_rad])
        self._known = chart.wall_field
        self.period_s = max(1.0 / lidar.rate_hz, robot.dt_s)
        self.brakes = Brakes(robot)
        self.t_s, self.pose, self.spread_m, self.twist = 0.0, start, 0.0, STOP
        self._moved_s = 0.0
        self.fresh = False
        self.near = self.strange = self.people = NO_POINTS
        self.mates = Mates()
        self._watch = IntruderWatch(config.watch)
        self.alarm = (math.nan, math.nan, math.nan)

    @property
    def talks(self) -> bool:
        """Whether it has a radio."""
        return self._radio is not None

    def take_in(self, readings: Readings, belief: Belief, *, lost: bool) -> float:
        """One step's readings; returns the distance driven since the last one."""
        self.t_s, self.pose, cov = readings.t_s, belief.pose, belief.cov
        self.spread_m = SIGMAS * math.sqrt(max(cov.item(0, 0), cov.item(1, 1)))
        self.brakes.take_in(readings)
        driven_m, odometry = 0.0, readings.by_sensor.get(self._odometry)
        if isinstance(odometry, OdometryIncrement):
            driven_m = odometry.distance_m
            # It tells of the time since it last told, which may be several steps ago.
            steps = max(1, round((self.t_s - self._moved_s) / self.dt_s))
            self.twist = Twist(driven_m / (steps * self.dt_s), odometry.angle_rad / (steps * self.dt_s))
            self._moved_s = self.t_s
            if self.brakes.knows_its_speed_better:
                self.twist = Twist(self.brakes.rates_m_s[0], self.twist.w_rad_s)
        said = None if self._radio is None else readings.by_sensor.get(self._radio)
        if isinstance(said, RadioMessages):
            for message in said.messages:
                if isinstance(message.content, TeamWord):
                    self.hear(message.sent_s, message.content)
        self._last_words.step(self.t_s, self.pose, self.talk_habit, lost=lost)
        scan = readings.by_sensor.get(self._lidar)
        self.fresh = isinstance(scan, LidarScan)
        if isinstance(scan, LidarScan):
            self._look_around(scan.ranges_m, SIGMAS * math.sqrt(cov.item(2, 2)), lost=lost)
        return driven_m

    def sent(self, command: Twist) -> None:
        """What leaves in this step."""
        self.brakes.sent(command)

    def hear(self, sent_s: float, word: TeamWord) -> None:
        """A mate said something."""
        number = word.news.sender
        self.mates.hear(number, sent_s, word)
        self._last_words.hear(number, sent_s, word)

    def silences_log(self) -> FloatArray:
        """(N,) how unlikely each mate's silence is by chance: as ``LastWords.chances_log``."""
        return self._last_words.chances_log(self.talk_habit)

    def _look_around(self, ranges_m: FloatArray, spread_rad: float, *, lost: bool) -> None:
        """Who is there, of a scan."""
        stops_m = stop_m(self.speed_m_s, self.brakes.sure_m_s2, self.period_s)
        self.near, self.strange = disc_returns.scan_returns(
            ranges_m,
            self._directions,
            self._mount,
            self.pose.as_array(),
            max(NEAR_M, stops_m + self.radius_m + self.config.margin_m),
            self._look_m,
            self.config.tolerance_m + self.spread_m,
            spread_rad,
            self.field(lost=lost),
            SECTORS,
        )
        self.people = self._strangers()
        for x, y in self._watch.step(self.on_map(self.people)):
            self.journal.count("alarms")
            self.alarm = self.t_s, x, y
            text = f"somebody at ({x:.1f}, {y:.1f}) who is neither on the map nor of the team"
            self.say("intruder", text)

    def _strangers(self) -> FloatArray:
        """(P, 2) returns, base frame, that are of no mate: by its words, or followed since they told so.

        None while one is not heard: whoever comes into sight may be it.
        """
        if not len(self.strange):
            return NO_POINTS
        told_m, own = self.config.watch.mate_m, self.task.robot
        people = self._last_words.of_nobody(self.strange, self.pose, own, self.t_s, told_m, self.speed_m_s)
        follows = self._watch.follows(self.strange_on_map(), PEOPLE_M_S * self.period_s + SHIFT_M)
        if not follows.any():
            return people
        return self.strange[follows | np.isin(self.strange @ AS_ONE, people @ AS_ONE)]

    def field(self, *, lost: bool) -> Field:
        """Distances on its map, their origin and resolution; none where it does not know where it is."""
        known_m, x0, y0, resolution_m = self._known.nodes_m
        return NO_FIELD if lost else known_m, x0, y0, resolution_m

    def on_map(self, points: FloatArray) -> FloatArray:
        """Points (M, 2) of the base frame on the map."""
        return self.pose.placed(points) if len(points) else points

    def strange_on_map(self) -> FloatArray:
        """(M, 2) what is on no map, map frame."""
        return self.on_map(self.strange)

    def sees_nothing_at(self, place: FloatArray, reach_m: float) -> bool:
        """Whether nothing is seen at a place (2,) of the map, though it is near and nothing is before it."""
        here = np.array([self.pose.x_m, self.pose.y_m])
        to = place - here
        away_m = float(np.hypot(*to))
        if away_m > self.config.watch_m or away_m < 1e-6:
            return False
        along = to / away_m
        offset = self.strange_on_map() - here
        ahead, off = offset @ along, np.abs(offset @ np.array([-along[1], along[0]]))
        if ((ahead > 0.0) & (ahead < away_m + reach_m) & (off < reach_m)).any():
            return False
        steps = np.linspace(0.0, 1.0, math.ceil(away_m / self._known.resolution_m) + 1)
        line = here + steps[:, None] * to
        return bool(self._known.at(line).min() > self._known.resolution_m)

    def bodies_on_map(self) -> FloatArray:
        """(K, 2) middles of those who are seen, map frame."""
        return self.on_map(disc_returns.bodies(self.strange, self.radius_m))

    @property
    def moving_m_s(self) -> float:
        """By the odometry."""
        return abs(self.twist.v_m_s)

    @property
    def at_rest(self) -> bool:
        """Whether it stands, by the odometry."""
        return self.moving_m_s <= AT_REST_M_S

    def heard(self) -> ItemsView[int, TeamWord]:
        """The last words of mates that were heard lately, with their numbers."""
        return self.mates.lately(self.t_s, HEARD_PERIODS * self.config.message_period_s)

    def patience_s(self, periods: float) -> float:
        """How long after its last word was sent a mate's silence is no chance: so many words by a good radio.

        By one that loses more as many words more as are as unlikely to be lost one after the other.
        """
        loss = min(max(self.talk_habit.loss, LEAST_LOSS), MOST_LOSS)
        words = periods * math.log(LEAST_LOSS) / math.log(loss)
        return self._delay_s + words * self.config.message_period_s

    def fell_silent(self) -> FloatArray:
        """(L, 3) discs where mates that were not heard for too long may stand: around where they said last
        that they are, as far as they drive until the next word is due.
        """
        silent = self.mates.silent(self.t_s - self._patience_s)
        if not silent:
            return NO_DISCS
        driven_m = [0.0 if (talk := word.talk) is None else talk.speed_m_s * talk.period_s for word in silent]
        discs = [(w.x_m, w.y_m, FAILED_M + more_m) for w, more_m in zip(silent, driven_m, strict=True)]
        return np.array(discs).reshape(-1, 3)

    def mates_by_their_words(self, t_s: float) -> FloatArray:
        """(N, 4) of all robots by number: where each is on the map, within what distance of that its middle
        is by now, and its radius; NaN for who does not know, was not heard lately, or is itself."""
        within_s = HEARD_PERIODS * self.config.message_period_s
        return self._last_words.whereabouts(t_s, within_s, TOLD_M, self.speed_m_s)

    def may_meet_mates(self, reach_m: float) -> bool:
        """Whether a mate may be so near: by its words.

        Who was not heard lately may be anywhere; not near, where radios reach much farther and it was silent
        for long because it left their reach.
        """
        pose, own = self.pose, self.task.robot
        closing_m = 2.0 * self.speed_m_s * (self._delay_s + self.config.message_period_s)
        hears_it = self.talk_habit.reach_m >= reach_m + closing_m
        for number, (x, y, within_m, _) in enumerate(self.mates_by_their_words(self.t_s).tolist()):
            away_m = math.hypot(x - pose.x_m, y - pose.y_m)
            is_far = away_m > reach_m + within_m or (
                hears_it and math.isnan(away_m) and self._is_out_of_reach(number)
            )
            if number != own and not is_far:
                return True
        return False

    def _is_out_of_reach(self, number: int) -> bool:
        """Whether a mate was heard and is silent for long, which is no wonder: it may be too far away."""
        if number not in self.mates or not self.t_s - self.mates[number][0] > self._patience_s:
            return False
        return bool(self.silences_log()[number] > NO_WONDER_LOG)

    def weaker_m_s2(self, places: FloatArray, than_m_s2: float) -> FloatArray:
        """(M,) the weakest brakes, below some, of the mates that may be seen at places (M, 2) of the map.

        As each told last, or as its data sheet says; infinite where none may be. Who was not heard may be
        anywhere.
        """
        weakest, own = np.full(len(places), math.inf), self.task.robot
        for number, (x, y, off_m, radius_m) in enumerate(self.mates_by_their_words(self.t_s).tolist()):
            told = self.mates[number][1].braking_m_s2 if number in self.mates else None
            braking = self.task.brakings_m_s2[number] if told is None else told
            if number != own and braking < than_m_s2:
                elsewhere = np.hypot(*(places - (x, y)).T) > off_m + radius_m
                weakest[~elsewhere] = np.minimum(weakest[~elsewhere], braking)
        return weakest

    def hears_all(self) -> bool:
        """Whether no mate is silent, or lost."""
        words = self.heard()
        return len(words) == len(self.task.starts) - 1 and all(math.isfinite(word.x_m) for _, word in words)

    def mate_reach_m(self, number: int) -> float:
        """Within so far of where a mate said it is, what is seen may be that mate."""
        sent_s, word = self.mates[number]
        speed_m_s = self.speed_m_s if word.talk is None else word.talk.speed_m_s
        return word.radius_m + self.config.watch.mate_m + speed_m_s * (self.t_s - sent_s)

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


def stop_m(speed_m_s: float, braking_m_s2: float, period_s: float) -> float:
    """What a robot needs to stop, told so a period after what it stops for is seen."""
    return speed_m_s * (period_s + LATENCY_S) + 0.5 * speed_m_s**2 / braking_m_s2


def _habit(radio: RadioConfig | None, period_s: float, speed_m_s: float) -> Talk:
    """How a robot talks by its data sheets; nobody hears one without a radio."""
    if radio is None:
        return Talk(period_s, 0.0, 1.0, speed_m_s)
    return Talk(period_s, math.inf if radio.range_m is None else radio.range_m, radio.loss, speed_m_s)
