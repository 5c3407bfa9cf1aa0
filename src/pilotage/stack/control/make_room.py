"""Making room: a robot that people shut in goes where nobody has to get past it."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_to_pi
from pilotage.core.config import Config
from pilotage.core.types import STOP, BoolArray, FloatArray, Pose2, Twist
from pilotage.kernels.bodies.outline import is_inside, least_along
from pilotage.kernels.control.closing_in import AWAY, drive_closes_in
from pilotage.maps.distance_field import DistanceField
from pilotage.maps.near_walls import NearWalls
from pilotage.sensors.sensor import Positive
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.perception.moving_bodies import MovingBodies

BEARINGS, STEP_M = 24, 0.1
NEAR_M, AHEAD_RAD, TURN_GAIN_PER_S = 0.1, 0.3, 2.0
"""Where it is there, and where it drives on rather than turns."""
WALL_M, LEAST_M, SLACK_M = 0.05, 0.01, 0.005
"""Kept from walls; where it stands nearer, what it is off them, and at least this."""
BESIDE_M = 0.1
"""What is so near, beyond the disc around the robot, is in the way of a plan, and of corners that swing."""
CREEPS = (0.6, 0.0), (-0.6, 0.0), (0.15, 0.0), (-0.15, 0.0), (0.0, 0.3), (0.0, -0.3)
"""So far, in metres and radians, it looks ahead when it has no room to turn."""
POSES = 6
BETTER_M = 0.005
NOW_S, AGAIN_S = 0.05, 0.3
"""When people are meant who are there now; how often it looks for a place where they leave none."""


class MakeRoomConfig(Config):
    """How far, how fast, for how long, and what a place has to be better by."""

    reach_m: float = Field(default=2.5, gt=0.0, le=20.0)
    speed_m_s: Positive = 0.3
    longest_s: Positive = 15.0
    look_s: Positive = 1.0
    """A place is chosen anew after so long: people move."""
    keep_m: Positive = 0.15
    """To where people are now; whoever is nearer, it drives away from him."""
    room_m: Positive = 1.0
    """More room than this to walls, or to people, makes a place no better."""
    gain_m: Positive = 0.1


class MakeRoom:
    """Straight to the place in sight with the most room to walls and to people, again and again.

    Who stands in a door, beside the end of a wall or in somebody's path waits there with whoever wants to get
    past, for ever: people do not foresee, and push. A robot that cannot turn on the spot stays where it is,
    and so does one whose corners would touch something or somebody if it turned.
    """

    def __init__(
        self, config: MakeRoomConfig, robot: RobotKnowledge, field: DistanceField, bodies: MovingBodies
    ) -> None:
        self._config, self._field, self._bodies = config, field, bodies
        self._radius_m, self._turns = robot.radius_m, robot.motion.least_turning_radius_m == 0.0
        self._outline, self._walls = robot.footprint.outline, NearWalls(field.segments_m)
        self._corners_m = robot.footprint.points_m
        self._braking_m_s2 = min(robot.motion.braking_m_s2, robot.motion.top_speed_m_s / robot.dt_s)
        self._rate_rad_s = min(0.8, robot.motion.top_turn_rate_rad_s)
        self._speed_m_s = min(config.speed_m_s, robot.motion.top_speed_m_s)
        self._to: tuple[float, float] | None = None
        self._until_s = self._look_s = -math.inf

    def helps(self, pose: Pose2, mapped_m: FloatArray) -> bool:
        """Whether it stands in somebody's way, or too near to a thing to plan from there.

        Out in the open whoever wants to get past does.
        """
        beside = np.hypot(mapped_m[:, 0] - pose.x_m, mapped_m[:, 1] - pose.y_m) - mapped_m[:, 2]
        near = bool((beside < self._radius_m + BESIDE_M).any())
        wall_m = self._field.at(np.array([[pose.x_m, pose.y_m]]))[0]
        return self._turns and (near or bool(wall_m < self._config.room_m))

    def begin(self, t_s: float) -> None:
        """From now on, for ``longest_s`` at most."""
        self._to, self._look_s = None, -math.inf
        self._until_s = t_s + self._config.longest_s

    def step(self, t_s: float, pose: Pose2, mapped_m: FloatArray) -> Twist | None:
        """The next command, ``mapped_m`` (N, 3) discs being things; None when it is there, or time is up."""
        if t_s >= self._until_s:
            return None
        creeps = self._creep(pose, mapped_m)
        if creeps is not None:
            self._to, self._look_s = None, -math.inf
            return creeps
        if t_s - self._look_s >= (self._config.look_s if self._to else AGAIN_S):
            self._look_s, self._to = t_s, self._best(pose, mapped_m)
        if self._to is None:
            return STOP
        dx, dy = self._to[0] - pose.x_m, self._to[1] - pose.y_m
        away_m = math.hypot(dx, dy)
        if away_m < NEAR_M:
            return None
        off_rad = wrap_to_pi(math.atan2(dy, dx) - pose.theta_rad)
        turn = min(max(TURN_GAIN_PER_S * off_rad, -self._rate_rad_s), self._rate_rad_s)
        if not self.may_turn(pose, mapped_m):
            return STOP
        if abs(off_rad) > AHEAD_RAD:
            return Twist(0.0, turn)
        ahead = np.array([[math.cos(pose.theta_rad), math.sin(pose.theta_rad)]])
        free, _ = self._looked_at(pose, mapped_m, ahead, min(away_m, 3.0 * STEP_M))
        return Twist(self._speed_m_s if free.all() else 0.0, turn)

    def may_turn(self, pose: Pose2, mapped_m: FloatArray) -> bool:
        """Whether it has no corners, or nothing and nobody is within the disc around it."""
        return not len(self._corners_m) or self._beside_m(pose, self._bodies_m(pose, mapped_m)) > 0.0

    def _bodies_m(self, pose: Pose2, mapped_m: FloatArray) -> FloatArray:
        """(N, 3) mapped things, and people where they are now; of those inside the outline none is one."""
        people_m = self._bodies.foretold(NOW_S, 1, pose, mapped_m, self._config.reach_m)[0]
        bodies_m = np.concatenate([mapped_m, people_m])
        seen_m = pose.seen(bodies_m[:, :2])
        near = np.hypot(*seen_m.T) - bodies_m[:, 2] < self._config.reach_m
        own = [is_inside(x_m, y_m, self._corners_m) for x_m, y_m in seen_m[near]]
        beside_m: FloatArray = bodies_m[near][~np.array(own, np.bool_)]
        return beside_m

    def _beside_m(self, pose: Pose2, bodies_m: FloatArray) -> float:
        """How far the disc around the robot is from walls and bodies (N, 3)."""
        gaps_m = np.hypot(bodies_m[:, 0] - pose.x_m, bodies_m[:, 1] - pose.y_m) - bodies_m[:, 2]
        to_wall_m = self._field.at(np.array([[pose.x_m, pose.y_m]]))[0]
        return float(min(to_wall_m, gaps_m.min(initial=math.inf))) - self._radius_m

    def _creep(self, pose: Pose2, mapped_m: FloatArray) -> Twist | None:
        """Away from what is beside corners, nearer to nothing; None where nothing is, or no motion helps."""
        if not (self._turns and len(self._corners_m)):
            return None
        bodies_m = self._bodies_m(pose, mapped_m)
        now_m = self._beside_m(pose, bodies_m)
        if now_m >= BESIDE_M:
            return None
        best, most_m = None, self._room_m(pose, now_m, bodies_m) + BETTER_M
        for ahead_m, turn_rad in CREEPS:
            if ahead_m < 0.0 and self._bodies.may_be_at(math.pi):
                continue
            holds_s = abs(ahead_m) / self._speed_m_s + abs(turn_rad) / self._rate_rad_s
            command = Twist(ahead_m / holds_s, turn_rad / holds_s)
            there = self._ends_at(pose, command, holds_s, bodies_m)
            if there is None:
                continue
            room_m = self._room_m(there, self._beside_m(there, bodies_m), bodies_m)
            if room_m > most_m:
                best, most_m = command, room_m
        return best

    def _room_m(self, pose: Pose2, beside_m: float, bodies_m: FloatArray) -> float:
        """What is better about a place: room around the disc, as far as needed, and around the outline."""
        return min(beside_m, BESIDE_M) + min(self._least_m([pose], bodies_m), BESIDE_M)

    def _least_m(self, poses: list[Pose2], bodies_m: FloatArray) -> float:
        """Least clearance of its outline to walls and bodies (N, 3) at poses."""
        reach_m = 2.0 * self._config.reach_m
        walls_m = self._walls.near(poses[0].x_m, poses[0].y_m, reach_m)
        circles_m = np.concatenate([self._field.circles_m, bodies_m])
        rows = np.array([pose.as_array() for pose in poses])
        return float(least_along(rows, self._outline, walls_m, circles_m))

    def _ends_at(self, pose: Pose2, command: Twist, holds_s: float, bodies_m: FloatArray) -> Pose2 | None:
        """Where a command leads, straight or on the spot; None where it closes in on something."""
        v_m_s, w_rad_s, nothing_m = command.v_m_s, command.w_rad_s, bodies_m[:0]
        moved = [
            pose.compose(Pose2(v_m_s * t_s, 0.0, w_rad_s * t_s)) for t_s in np.linspace(0.0, holds_s, POSES)
        ]
        if self._least_m(moved[1:], nothing_m) < min(WALL_M, self._least_m(moved[:1], nothing_m)):
            return None
        closes = drive_closes_in(
            (pose.x_m, pose.y_m, pose.theta_rad),
            v_m_s,
            w_rad_s,
            holds_s,
            self._braking_m_s2,
            holds_s / (POSES - 1),
            self._outline,
            np.ascontiguousarray(bodies_m[None]),
            WALL_M,
        )
        return None if closes else moved[-1]

    def _best(self, pose: Pose2, mapped_m: FloatArray) -> tuple[float, float] | None:
        """The place with the most room; None where none within reach is better than here."""
        config = self._config
        bearings = np.linspace(-math.pi, math.pi, BEARINGS, endpoint=False)
        ahead = np.column_stack([np.cos(bearings), np.sin(bearings)])
        free, room = self._looked_at(pose, mapped_m, ahead, config.reach_m)
        here = room[0, 0]
        room = np.where(np.logical_and.accumulate(free, axis=1), room, -math.inf)
        k, j = np.unravel_index(int(np.argmax(room)), room.shape)
        if room[k, j] < here + config.gain_m:
            return None
        return pose.x_m + j * STEP_M * float(ahead[k, 0]), pose.y_m + j * STEP_M * float(ahead[k, 1])

    def _looked_at(
        self, pose: Pose2, mapped_m: FloatArray, ahead: FloatArray, reach_m: float
    ) -> tuple[BoolArray, FloatArray]:
        """Whether it is free (K, S) every ``STEP_M`` along unit vectors (K, 2), and the room there (K, S)."""
        config = self._config
        along_m = STEP_M * np.arange(max(2, round(reach_m / STEP_M) + 1))
        here = np.array([pose.x_m, pose.y_m])
        points = here + along_m[None, :, None] * ahead[:, None, :]
        shape = points.shape[:2]
        wall_m = self._field.at(points.reshape(-1, 2)).reshape(shape)
        off_m = max(min(self._radius_m + WALL_M, wall_m[0, 0] - SLACK_M), self._radius_m + LEAST_M)
        free = wall_m >= off_m
        people = self._bodies.foretold(NOW_S, 1, pose, mapped_m, config.reach_m)[0]
        to_people_m = np.full(shape, config.room_m)
        for discs, keep_m in ((people, config.keep_m), (mapped_m, WALL_M)):
            if not len(discs):
                continue
            keep_m += self._radius_m
            gap_m = np.hypot(*(points[:, :, None] - discs[:, :2]).transpose(3, 0, 1, 2)) - discs[:, 2]
            least_m = np.minimum(keep_m, gap_m[:1, :1] + AWAY * along_m[None, :, None])
            free &= (gap_m >= least_m - 1e-9).all(axis=2)
            nearest_m = gap_m.min(axis=2)
            if discs is people:
                to_people_m = np.minimum(to_people_m, nearest_m)
            else:
                wall_m = np.minimum(wall_m, nearest_m)
        return free, np.minimum(wall_m, config.room_m) + to_people_m - 0.1 * along_m
