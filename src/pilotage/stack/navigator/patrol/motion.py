"""The choice of motion of a robot on patrol: down a field, around who stands in the way, through a place."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.kernels.control import disc_returns, eikonal, safe_stop, voronoi_window
from pilotage.kernels.geometry.field import Field
from pilotage.models.motion.motion import MotionConfig
from pilotage.stack.navigator.patrol.approach import Approach, horizon_s
from pilotage.stack.navigator.patrol.gate import NO_GATE, gate_at
from pilotage.stack.navigator.patrol.hidden import HiddenMates
from pilotage.stack.navigator.patrol.onward import Onward
from pilotage.stack.navigator.patrol.passage import CLAIM_M
from pilotage.stack.navigator.patrol.senses import (
    AS_ONE,
    LATENCY_S,
    NO_DISCS,
    NO_POINTS,
    PEOPLE_M_S,
    Senses,
)
from pilotage.stack.navigator.patrol.still import StillWatch
from pilotage.stack.patrol.roadmap import Roadmap

ROUNDED_M = 0.03
"""Paths between nodes come nearer than these, and bodies are seen a little elsewhere."""
DETOUR_SLACK_S = 1.0
NO_DETOUR_S = 6.0
"""A detour that takes longer than this is none: it waits instead."""
THERE_RATIO = 1.0
"""Where somebody stands on the place to visit, so much of ``visit_m`` away is as good, in time to go."""
LANE_AHEAD_M, MERGE_S = 2.0, 1.0
"""A passage is as wide as its narrowest place so far ahead; the last part of a way leads to the middle."""
LANE_FROM_M = 6.0
"""It keeps to its lane where a mate may be so near: the middle is shorter, and farther from walls."""
THROUGH_RATIO = 0.5
"""It drives through a place within so much of ``visit_m``."""
ROUND_M = 0.06
"""Returns that lie so near to a rim as large as its own, on average, are of a mate's."""
TALKS_PERIODS = 3.0
"""A body is that of a mate who said so lately that it is there."""
SLOWED = 1.0, 0.5, 0.25, 0.125, 0.0
"""Shares of a speed that are tried; who rolls yet may have no room to turn meanwhile."""


class Motion:
    """Chooses commands by the dynamic window, of what its senses say.

    Attributes
    ----------
    roadmap
        Whose fields it follows.
    body_m, shut_m, wall_m
        What it keeps from the middle of who stands, close by and in plans, and from a wall.
    standing
        (K, 2) bodies near by, map frame, that have stood for some seconds and say nothing.
    command
        The last one: it stands between two scans.
    to_go_s
        Down the field that it follows.
    blocked
        Whether no way leads around who is in the way, or it holds for another reason.
    taken
        Whether somebody who does not go stands where it drives to.
    """

    def __init__(self, senses: Senses, motion: MotionConfig, roadmap: Roadmap, clearance_m: float) -> None:
        self._senses, self.roadmap, self._clearance_m = senses, roadmap, clearance_m
        self.body_m = clearance_m + senses.radius_m
        # Who stands may move again: where commands keep the gap to it no nearer path can be driven.
        self.shut_m = max(self.body_m, 2.0 * senses.radius_m + senses.config.gap_m + ROUNDED_M)
        self.wall_m = clearance_m + ROUNDED_M
        config, period_s, speed = senses.config, senses.period_s, motion.top_speed_m_s
        turn_rate = motion.top_turn_rate_rad_s
        turning = min(motion.turn_acceleration_rad_s2, turn_rate / senses.dt_s)
        self._safety = np.array(
            [period_s + LATENCY_S, senses.radius_m, config.margin_m, config.gap_m, PEOPLE_M_S]
        )
        braking = senses.brakes.sure_m_s2
        self._limits = np.array([speed, braking, braking, turn_rate, turning, period_s])
        self._reckon_with(braking)
        self._room: tuple[FloatArray, Pose2, tuple[float, float]] | None = None
        self._still, self._meets = StillWatch(), Onward(period_s + LATENCY_S, braking)
        self._onward = self._fronts = NO_POINTS
        self._hidden_mates = HiddenMates(senses, roadmap)
        self._swings_s = period_s + LATENCY_S + turn_rate / turning
        self.standing = NO_POINTS
        self.command, self.to_go_s = STOP, math.nan
        self.blocked = self.taken = False

    def _reckon_with(self, braking_m_s2: float) -> None:
        """Brakes that have proved to be so good.

        It goes on to ask for the speeds that its data sheet promises: what comes of them is what proves it.
        """
        self._limits[2] = braking_m_s2
        window, (reacts_s, radius_m, margin_m, *_) = self._senses.config.window, self._safety.tolist()
        costs = window.heading_s_per_rad, window.near_cost_s, window.soft_m
        top_m_s, keep_m = self._senses.speed_m_s, radius_m + margin_m
        ahead_s = window.horizon_s or horizon_s(top_m_s, braking_m_s2, reacts_s)
        self._approach = Approach(top_m_s, braking_m_s2, ahead_s, reacts_s, keep_m)
        self._window = ahead_s, *costs, window.speeds, window.turns, self._approach.slow_m_s

    def watch(self, *, lost: bool) -> None:
        """Look who stands, in a scan, who comes as no mate would, and where mates are that are hidden."""
        if self._senses.brakes.sure_m_s2 != self._limits[2]:
            self._reckon_with(self._senses.brakes.sure_m_s2)
        beside = self._beside()
        self._onward = self._meets.step(self._senses, beside)
        self.standing = self._still.step(self._senses.t_s, self._mute(beside), self._senses.fell_silent())
        hidden = NO_POINTS if lost else self._hidden_mates.fronts(self._stop_m())
        self._fronts = np.concatenate([hidden, self._meets.fronts])

    def _stop_m(self) -> float:
        """What it needs at most to stop, of what it can be told now."""
        v_m_s = self._senses.moving_m_s + self._limits[1] * self._limits[5]
        return float(v_m_s * (self._safety[0] + 0.5 * v_m_s / self._limits[2]))

    def _give_way_to_nobody(self) -> FloatArray:
        """(P, 2) returns, base frame, of people and of who comes as they do."""
        people, onward = self._senses.people, self._onward
        return np.concatenate([people, onward]) if len(onward) else people

    @property
    def turns_back_s(self) -> float:
        """How long it takes to come back to where it drove past."""
        return self._approach.turns_back_s

    @property
    def is_met(self) -> bool:
        """Whether somebody comes on so near that a corner which swings now may hit him before it rests."""
        return is_near(self._onward, self._senses.radius_m + PEOPLE_M_S * self._swings_s)

    def _beside(self) -> FloatArray:
        """(M, 2) returns of what may move and is near, base frame."""
        senses = self._senses
        return (
            disc_returns.within(senses.strange, senses.config.watch_m) if len(senses.strange) else NO_POINTS
        )

    def _around(self, beside: FloatArray) -> FloatArray:
        """(M, 3) what it goes around, map frame, of returns (M, 2) of what may move.

        A path nearer to a mate than commands may come is crept along, and mates find another one. Who is none
        gives way to nobody: beside him any path that there is will do.
        """
        senses = self._senses
        discs = _discs(senses.on_map(beside), self.shut_m - senses.radius_m)
        if len(senses.people):
            of_people = np.isin(beside @ AS_ONE, senses.people @ AS_ONE)
            discs[of_people, 2] = self._clearance_m
        return discs

    def room_ahead_m(self, time: FloatArray) -> tuple[float, float]:
        """Half the width of the narrowest place down a field, for claims and for lanes."""
        known, pose = self._room, self._senses.pose
        if known is None or known[0] is not time or known[1] is not pose:
            room_m = self.roadmap.narrowest_m(pose.x_m, pose.y_m, time, CLAIM_M, LANE_AHEAD_M)
            self._room = known = time, pose, room_m
        return known[2]

    def sure_m(self) -> float:
        """How near it is to a place that it is at for sure."""
        task = self._senses.task
        return max(min(task.near_m, 0.95 * task.visit_m - self._senses.spread_m), 0.5 * task.visit_m)

    def descend(
        self,
        time: FloatArray,
        at: FloatArray | None = None,
        *,
        came_from: int = -1,
        then: int = -1,
        first: bool = False,
    ) -> Twist:
        """The command that leads down a field of the roadmap, to a place (2,) to visit if it leads to one.

        From there it is to go on to vertex ``then``, where it came from another one; -1 where that is not
        known. Between two scans the last command stands. Who goes ``first`` drives on towards mates who talk.
        """
        senses, roadmap, config = self._senses, self.roadmap, self._senses.config
        pose = senses.pose
        # Also between scans: the way to another vertex is not measured by what was left to the last one.
        self.to_go_s = eikonal.value_at(pose.x_m, pose.y_m, roadmap.placed(time), 0.0)
        if not senses.fresh:
            return self.command
        room_m = self.room_ahead_m(time)[1]
        # Where nobody can pass a lane would lead into the door's edge.
        passable = senses.pass_m <= room_m < math.inf and senses.may_meet_mates(LANE_FROM_M)
        lane_m = min(config.lane_m, max(0.0, room_m - self._clearance_m)) if passable else 0.0
        lane_m *= min(1.0, self.to_go_s / MERGE_S)
        self.blocked = self.taken = False
        beside, still = self._beside(), self.standing
        body_m = self.body_m
        discs = self._around(beside) if len(beside) and not first else NO_DISCS
        if len(still):
            discs = np.concatenate([discs, _discs(still, body_m)])
            # Beside who stands where it wants to be it goes around him, on either side, and that will do.
            self.taken = at is not None and bool(np.hypot(*(still - at).T).min() < body_m)
            lane_m *= not self.taken
        if len(discs):
            # The nodes around it stay free however close somebody is: else no path begins there.
            away_m = np.hypot(*(discs[:, :2] - (pose.x_m, pose.y_m)).T)
            discs[:, 2] = np.minimum(discs[:, 2], away_m - math.sqrt(0.5) * roadmap.spacing_m)
        if at is None or self.taken:
            then = -1
        limits = self._limits_ahead(time, then)
        v, w, held = self._choose(time, at, came_from, then, discs, lane_m, limits)
        if held and lane_m > 0.0:
            # Beside a corner the lane may lead into it; the middle does not.
            v, w, held = self._choose(time, at, came_from, then, discs, 0.0, limits)
        self.command = Twist(v, w)
        return self.command

    def _limits_ahead(self, time: FloatArray, then: int) -> FloatArray:
        """Its limits, no faster than its way ahead lets it be; no slower than its brakes make it by then."""
        senses, limits = self._senses, self._limits
        known = senses.field(lost=False)
        top_m_s = self._approach.speed_m_s(self.roadmap, senses.pose, time, then, known)
        if top_m_s >= limits[0]:
            return limits
        return np.array([max(top_m_s, senses.twist.v_m_s - limits[2] * limits[5]), *limits[1:]])

    def _choose(
        self,
        time: FloatArray,
        at: FloatArray | None,
        came_from: int,
        then: int,
        discs: FloatArray,
        lane_m: float,
        limits: FloatArray,
    ) -> tuple[float, float, bool]:
        """Speed, turn rate, and whether it stays where it is: down a field, around discs (M, 3)."""
        senses, pose = self._senses, self._senses.pose
        field = self.roadmap.placed(time)
        if len(discs):
            dx, dy = eikonal.descent(pose.x_m, pose.y_m, field)
            # Who follows the field is the point to the left of the robot: so must be what it goes around.
            discs = discs + lane_m * np.array([-dy, dx, 0.0])
        gate = self.gate(at, came_from, then, discs)
        if len(discs):
            field, around_s = self._detour(time, discs)
            self.blocked = not around_s < self.to_go_s + NO_DETOUR_S
        v, w, status = voronoi_window.choose(
            senses.twist.v_m_s,
            senses.twist.w_rad_s,
            pose.as_array(),
            limits,
            self._safety,
            (senses.near, np.concatenate([senses.strange, self._fronts]), self._give_way_to_nobody()),
            field,
            gate,
            senses.field(lost=False),
            lane_m,
            self._window,
        )
        return v, w, status == voronoi_window.HELD

    def _detour(self, time: FloatArray, discs: FloatArray) -> tuple[Field, float]:
        """A field around discs (M, 3), near by, and the time at the robot."""
        senses, field = self._senses, self.roadmap.placed(time)
        x, y, reach_m = senses.pose.x_m, senses.pose.y_m, senses.config.watch_m
        there_s, slow = THERE_RATIO * senses.task.visit_m / senses.speed_m_s, self.roadmap.slowness
        return eikonal.detour(field, slow, x, y, reach_m, discs, DETOUR_SLACK_S, there_s)

    def gate(
        self, at: FloatArray | None, came_from: int, then: int, discs: FloatArray
    ) -> voronoi_window.Gate:
        """The place (2,) that it passes on its way to vertex ``then``, if it is near and no sharp turn."""
        senses, (ahead_s, turn_s_per_rad, *_) = self._senses, self._window
        near_m = min(self.sure_m(), THROUGH_RATIO * senses.task.visit_m)
        if then < 0 or at is None:
            return NO_GATE
        x, y = at.tolist()
        if math.hypot(x - senses.pose.x_m, y - senses.pose.y_m) > near_m + ahead_s * senses.speed_m_s:
            return NO_GATE

        def around(time: FloatArray) -> Field:
            return self._detour(time, discs)[0] if len(discs) else self.roadmap.placed(time)

        return gate_at(self.roadmap, at, came_from, then, near_m, turn_s_per_rad, around)

    def _mute(self, beside: FloatArray) -> FloatArray:
        """(K, 2) middles, map frame, of bodies among returns that no mate who talks says it is."""
        senses = self._senses
        if not len(beside):
            return NO_POINTS
        # Whoever is met is as large as the robot itself; its near side alone is seen.
        middles = senses.on_map(disc_returns.round_bodies(beside, senses.radius_m, ROUND_M))
        latest_s = senses.t_s - senses.patience_s(TALKS_PERIODS)
        talk = [
            (word.x_m, word.y_m, senses.radius_m + senses.speed_m_s * (senses.t_s - sent_s))
            for _, (sent_s, word) in senses.mates.items()
            if sent_s > latest_s
        ]
        mute = [
            not any(math.hypot(x - word_x, y - word_y) < reach_m for word_x, word_y, reach_m in talk)
            for x, y in middles.tolist()
        ]
        return middles[np.array(mute, dtype=np.bool_)]

    def careful(self, command: Twist) -> Twist:
        """A command slowed down until its braking ends clear of everything, all of which may move."""
        senses = self._senses
        if not senses.fresh:
            return self.command
        now = senses.twist
        for share in SLOWED:
            v = share * command.v_m_s
            if safe_stop.stop_is_clear(
                now.v_m_s,
                now.w_rad_s,
                v,
                command.w_rad_s,
                self._limits,
                self._safety,
                (senses.near, senses.near, NO_POINTS),
                senses.pose.as_array(),
                senses.field(lost=True),
            ):
                self.command = Twist(v, command.w_rad_s)
                return self.command
        return self.stand(lost=True)

    def stand(self, *, lost: bool = False) -> Twist:
        """Stop; straight on unless that leads into something."""
        senses = self._senses
        if senses.at_rest:
            self.command = STOP
        elif senses.fresh or self.command.v_m_s != 0.0:
            w = safe_stop.braking_turn(
                senses.twist.v_m_s,
                senses.twist.w_rad_s,
                self._limits,
                self._safety,
                (senses.near, senses.strange, self._give_way_to_nobody()),
                senses.pose.as_array(),
                senses.field(lost=lost),
            )
            self.command = Twist(0.0, w)
        return self.command


def is_near(points_m: FloatArray, reach_m: float) -> bool:
    """Whether one of points (K, 2) is nearer to the origin."""
    return bool(len(points_m)) and bool(np.hypot(*points_m.T).min() < reach_m)


def _discs(middles_xy_m: FloatArray, radius_m: float) -> FloatArray:
    """(M, 3) discs of one radius."""
    return np.column_stack([middles_xy_m, np.full(len(middles_xy_m), radius_m)])
