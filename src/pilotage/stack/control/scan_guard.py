"""Do not drive into what the lasers show, whatever maps say."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.core.types import Command, FloatArray, Pose2, Twist
from pilotage.kernels.arrays import read_only
from pilotage.kernels.bodies.beam_contact import confirmed_ends, touches_an_end
from pilotage.kernels.geometry.motion import turned_part
from pilotage.kernels.geometry.solids import Outline
from pilotage.sensors.joint_lidar import JointLidarConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, Readings
from pilotage.stack.control.brakes import Brakes
from pilotage.stack.control.own_motion import OwnMotion
from pilotage.stack.knowledge import RobotKnowledge

TOUCH_M = 0.01
"""What a laser shows nearer than this on the way of a command is touched."""
MOST_PIECES = 100
"""A metre, within which a robot that is guarded stops."""
OWN_M = 0.05
"""An end so much deeper in the outline than a range may be off is the robot's own."""
SAME_STDS = 4.0
"""By so many deviations of a range neighbouring ones of one surface differ at most."""
PERIODS = 3.0
"""A scan counts for so many of its laser's periods;"""
KEPT_M = 1.0
"""where no other comes, as of a laser whose scans are lost, until the robot is so far from where it was."""
MISSED_STEPS = 1.5
"""It is told of every step, or begins anew."""
EPSILON_S = 1e-9
NOTHING: FloatArray = np.empty((0, 2))


class Scan(NamedTuple):
    """One scan: until when it counts, its nearest range, and where the robot was (its own frame)."""

    until_s: float
    nearest_m: float
    ranges_m: FloatArray
    at: tuple[float, float, float]


class Near(NamedTuple):
    """Of S scans the ranges (S, N), the present pose in the frame of each (S, 3), and how far each counts."""

    ranges_m: FloatArray
    starts: FloatArray
    reaches_m: FloatArray


class LaserView:
    """What a laser showed of late."""

    def __init__(self, name: str, sheet: LidarConfig) -> None:
        self._name, self._valid_s = name, PERIODS / sheet.rate_hz - EPSILON_S
        angles_rad = sheet.mount.theta_rad + sheet.beam_angles_rad()
        mount = sheet.mount.x_m, sheet.mount.y_m
        self.fan = read_only(np.column_stack([np.cos(angles_rad), np.sin(angles_rad)])), mount
        self._arm_m, self._sure_m = math.hypot(*mount), sheet.sure_range_m
        # The nearest of some returns is told too near by about two deviations; a vague laser's are averaged.
        std_m = math.sqrt(sheet.range_var_m2)
        self._between = sheet.beam_step_rad
        margin_m, own_m, same_m = max(TOUCH_M - 2.0 * std_m, 0.0), OWN_M + 3.0 * std_m, SAME_STDS * std_m
        self.kept = margin_m, self._between, own_m, same_m
        self._scans: list[Scan] = []

    def take_in(self, readings: Readings, here: tuple[float, float, float]) -> None:
        """A step's scan, and where the robot is now."""
        t_s, scan = readings.t_s, readings.by_sensor.get(self._name)
        if isinstance(scan, LidarScan):
            nearest_m = float(np.fmin.reduce(scan.ranges_m)) if len(scan.ranges_m) else math.inf
            self._scans.append(Scan(t_s + self._valid_s, nearest_m, scan.ranges_m, here))
        while self._scans and t_s > self._scans[0].until_s:
            x, y, _ = self._scans[0].at
            if len(self._scans) == 1 and math.hypot(here[0] - x, here[1] - y) < KEPT_M:
                break  # what it showed has not gone because nothing is shown any more
            del self._scans[0]

    def forget(self) -> None:
        """Where the robot has moved to since is not known."""
        self._scans.clear()

    def near(self, within_m: float, here: tuple[float, float, float]) -> Near | None:
        """Scans that may show something so near to where the robot is."""
        found, sure_m = [], self._sure_m
        for scan in self._scans:
            x, y, _ = scan.at
            reach_m = (within_m + self._arm_m + math.hypot(here[0] - x, here[1] - y)) * (1.0 + self._between)
            if scan.nearest_m < reach_m and scan.nearest_m < sure_m:
                found.append((scan, min(reach_m, sure_m)))
        if not found:
            return None
        return Near(
            np.stack([scan.ranges_m for scan, _ in found]),
            np.array([_since(scan.at, here) for scan, _ in found]),
            np.array([reach_m for _, reach_m in found]),
        )

    def touches(self, near: Near, move: tuple[float, float, float], pieces: int, outline: Outline) -> bool:
        """Whether the robot would touch what scans show on a move."""
        return touches_an_end(*near, self.fan, move, pieces, outline, self.kept)

    def ends_m(self, near: Near) -> FloatArray:
        """(K, 2) where what scans show is around the robot."""
        scans, starts, reaches_m = near
        return np.concatenate(
            [
                Pose2(*start).seen(confirmed_ends(k, scans, starts, reach_m, self.fan, self.kept[-1]))
                for k, (start, reach_m) in enumerate(zip(starts.tolist(), reaches_m.tolist(), strict=True))
            ]
        )


class ScanGuard:
    """Checks the arc of a command, and the stop after it, against what each of the robot's lasers shows.

    Who knows his place badly passes walls by his map that stand elsewhere. What a laser showed counts
    for three of its periods, as seen from where the robot has moved to since: the edge of a post that is
    passed is hit by few beams, and a laser may be slower than the robot's steps. The last scan counts on
    where no other comes.
    It stops by its brakes as they have proved. Whoever gets no nearer to what he touches, or is about to,
    may. Where no laser looks it knows nothing, and of what comes up to the robot by itself no more than where
    it was.
    """

    def __init__(self, robot: RobotKnowledge, brakes: Brakes) -> None:
        self._limits, self._brakes = robot.motion, brakes
        self._outline, self._radius_m = robot.footprint.outline, robot.footprint.radius_m
        motion = robot.motion
        self._slowing_rad_s2 = min(motion.turn_acceleration_rad_s2, motion.top_turn_rate_rad_s / robot.dt_s)
        self._reacts_s = robot.dt_s + motion.delay_s
        # Their joint scan leaves out what the middle between them does not see.
        self._lasers = [
            LaserView(name, sheet)
            for name, sheet in robot.sensors.items()
            if isinstance(sheet, LidarConfig) and not isinstance(sheet, JointLidarConfig)
        ]
        self._motion, self._dt_s = OwnMotion(robot), robot.dt_s
        self._t_s, self._here = 0.0, (0.0, 0.0, 0.0)
        # So fast it is by the time that it reacts to what comes in the next step, at most.
        self._most_m_s, self._most_rad_s = self._faster_than(0.0, 0.0)

    def take_in(self, readings: Readings) -> None:
        """Take in what came in a step; to be called at every one, before commands are asked about."""
        if not self._lasers:
            return
        if readings.t_s - self._t_s > MISSED_STEPS * self._dt_s:
            for laser in self._lasers:
                laser.forget()
        self._t_s = readings.t_s
        moved = ahead_m, lateral_m, angle_rad = self._motion.step(readings)
        self._here = turned_part(*self._here, *moved, 1.0)
        self._most_m_s, self._most_rad_s = self._faster_than(math.hypot(ahead_m, lateral_m), angle_rad)
        for laser in self._lasers:
            laser.take_in(readings, self._here)

    @property
    def place_m(self) -> tuple[float, float]:
        """Where the robot is by its own motion, seen from where it began; where it has a laser."""
        return self._here[0], self._here[1]

    def sent(self, command: Command) -> None:
        """A command left in this step."""
        if self._lasers:
            self._motion.sent(self._t_s, command)

    def touched_m(self, command: Twist) -> FloatArray:
        """(K, 2) in the base frame what the lasers show around a robot that would touch some of it.

        Of none where it would not.
        """
        told_m_s = math.hypot(command.v_m_s, command.lateral_m_s)
        speed_m_s = min(told_m_s, self._most_m_s)
        w_rad_s = self._can_turn(command.w_rad_s, speed_m_s)
        turn_rate = abs(w_rad_s)
        if speed_m_s == 0.0 and turn_rate == 0.0:
            return NOTHING
        # At full speed as far as while it brakes.
        stops_s = max(speed_m_s / self._brakes.sure_m_s2, turn_rate / self._slowing_rad_s2)
        until_s, here = self._reacts_s + 0.5 * stops_s, self._here
        within_m = self._radius_m + TOUCH_M + speed_m_s * until_s
        near = [(laser, seen) for laser in self._lasers if (seen := laser.near(within_m, here)) is not None]
        if not near:
            return NOTHING
        # So finely that no corner skips over what is touched.
        swept_m = (speed_m_s + turn_rate * self._radius_m) * until_s + TOUCH_M
        pieces = min(math.ceil(swept_m / TOUCH_M), MOST_PIECES)
        each_s = until_s * speed_m_s / told_m_s if told_m_s > 0.0 else 0.0
        move = command.v_m_s * each_s, command.lateral_m_s * each_s, w_rad_s * until_s
        if not any(laser.touches(seen, move, pieces, self._outline) for laser, seen in near):
            return NOTHING
        return np.concatenate([laser.ends_m(seen) for laser, seen in near])

    def _faster_than(self, moved_m: float, turned_rad: float) -> tuple[float, float]:
        """The most speed and turn rate that comes of what it moved in a step, until it reacts anew."""
        for_s = self._reacts_s + self._dt_s
        gains_m_s, gains_rad_s = self._brakes.likely_m_s2 * for_s, self._slowing_rad_s2 * for_s
        return moved_m / self._dt_s + gains_m_s, abs(turned_rad) / self._dt_s + gains_rad_s

    def _can_turn(self, w_rad_s: float, speed_m_s: float) -> float:
        """The turn rate that it makes of a command: wheels do not turn so sharply, nor so fast."""
        most, least_m = (
            min(self._limits.top_turn_rate_rad_s, self._most_rad_s),
            self._limits.least_turning_radius_m,
        )
        if least_m > 0.0:
            most = min(most, speed_m_s / least_m)
        return min(max(w_rad_s, -most), most)


def _since(at: tuple[float, float, float], here: tuple[float, float, float]) -> tuple[float, float, float]:
    """Where it is now, seen from where it was."""
    dx, dy, cosine, sine = here[0] - at[0], here[1] - at[1], math.cos(at[2]), math.sin(at[2])
    return cosine * dx + sine * dy, cosine * dy - sine * dx, here[2] - at[2]
