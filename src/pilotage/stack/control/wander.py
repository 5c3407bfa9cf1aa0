"""Driving about safely without knowing where: towards open floor, by the scanner alone."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.config import Config
from pilotage.core.types import STOP, FloatArray, Twist
from pilotage.kernels.lines import clustering
from pilotage.kernels.scans import wander
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, Readings
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.stack.knowledge import RobotKnowledge

LEAST_SHARE = 0.5
"""Of the beams that look down a lane so many have to have measured something, or that nothing is there."""


class WanderConfig(Config):
    """Where it likes to go and how near it lets things come."""

    speed_m_s: Positive = 0.8
    margin_m: Positive = 0.12
    """Free on each side of the body in a lane that counts as open."""
    stop_m: Positive = 0.7
    """With less free ahead of the centre it turns on the spot,"""
    go_m: Positive = 1.2
    """until there is this much,"""
    aligned_rad: Positive = 0.4
    """in a direction this near the best."""
    reach_m: Positive = 12.0
    turn_cost_m_per_rad: NonNegative = 1.5
    """A lane this much longer is worth turning one radian for."""
    led_reach_m: Positive = 1.5
    """With somewhere to go to, a lane need not be longer than this."""
    gain_per_s: Positive = 1.5
    max_turn_rate_rad_s: Positive = 0.8
    directions: int = Field(default=41, ge=3, le=10_000)


class Wanderer:
    """Turns towards the longest open lane in view and drives down it.

    It forgets everything from one scan to the next but the sense of a turn on the spot, so that it does
    not waver in a corner. Fails among things that the scanner's plane does not meet, and it explores
    nothing on purpose: it may come back to where it was.
    """

    def __init__(
        self, config: WanderConfig, robot: RobotKnowledge, lidar_name: str, lidar: LidarConfig
    ) -> None:
        self._config = config
        self._name = lidar_name
        self._half_width, self._nose_m = robot.radius_m + config.margin_m, 0.0
        corners_m = robot.footprint.points_m
        if robot.motion.least_turning_radius_m > 0.0 and len(corners_m):
            # It sweeps no disc about its axle: a lane is as wide as its body, and ends before its nose.
            body_m = float(np.abs(corners_m[:, 1]).max())
            self._half_width = body_m + config.margin_m
            self._nose_m = max(float(corners_m[:, 0].max()) - body_m, 0.0)
        self._directions = clustering.beam_directions(
            float(lidar.beam_angles_rad()[0]) + lidar.mount.theta_rad, lidar.beam_step_rad, lidar.beams
        )
        self._arm = np.array([lidar.mount.x_m, lidar.mount.y_m])
        half_view = min(0.5 * lidar.field_of_view_rad, math.pi) - 0.2
        self._headings = np.linspace(-half_view, half_view, config.directions)
        self._lanes_rad = np.append(self._headings, 0.0)
        beams_rad = np.arctan2(self._directions[:, 1], self._directions[:, 0])
        beside = np.abs(wrap_array_to_pi(beams_rad - self._lanes_rad[:, np.newaxis]))
        # Which beams (K + 1, N) look down a lane: where none does, as behind a laser, it is none.
        self._looks = beside <= max(math.atan2(self._half_width, config.go_m), lidar.beam_step_rad)
        self._turning = self._turned_rad = 0.0
        self._dt_s = robot.dt_s
        self._command = STOP

    @staticmethod
    def of(config: WanderConfig, robot: RobotKnowledge) -> Wanderer | None:
        """A wanderer for a robot with a scanner; None for one without."""
        scanners = list(robot.sensors_of(LidarConfig).items())
        return Wanderer(config, robot, *scanners[0]) if scanners else None

    def step(self, readings: Readings, bearing_rad: float | None = None) -> Twist:
        """Choose a command from the scan; without a new scan, go on as before.

        ``bearing_rad``, in the robot's frame, is where it would like to go, as far as the floor is free.
        """
        scan = readings.by_sensor.get(self._name)
        if isinstance(scan, LidarScan):
            self._command = self._choose(scan.ranges_m, bearing_rad)
        return self._command

    def _turns_on(self, ahead: float, best: float) -> bool:
        """Whether to turn on the spot: begun before a wall, ended before a lane that is the best one too.

        Ending it before any lane that is free could lead straight back to the wall. After a whole turn any
        lane will do.
        """
        config = self._config
        if self._turning == 0.0:
            if ahead >= config.stop_m:
                return False
            self._turning = math.copysign(config.max_turn_rate_rad_s, best)
            self._turned_rad = 0.0
            return True
        self._turned_rad += abs(self._turning) * self._dt_s
        aligned = ahead >= config.go_m and abs(best) <= config.aligned_rad
        if aligned or (self._turned_rad > 2.0 * math.pi and ahead >= config.stop_m):
            self._turning = 0.0
            return False
        return True

    def _free_m(self, ranges_m: FloatArray) -> FloatArray:
        """Free lengths (K + 1,) along the headings and straight ahead; 0 where too few beams look."""
        measured = ~np.isnan(ranges_m)
        points = (clustering.scan_points(ranges_m, self._directions) + self._arm)[measured]
        free = wander.free_lengths(points, self._lanes_rad, self._half_width, self._config.reach_m)
        free = np.maximum(free - self._nose_m, 0.0)
        looks = self._looks.sum(axis=1)
        unseen = (looks == 0) | ((self._looks & measured).sum(axis=1) < LEAST_SHARE * looks)
        return np.where(unseen, 0.0, free)

    def _choose(self, ranges_m: FloatArray, bearing_rad: float | None) -> Twist:
        config = self._config
        lengths = self._free_m(ranges_m)
        free, ahead = lengths[:-1], float(lengths[-1])
        if bearing_rad is None:
            worth = free - config.turn_cost_m_per_rad * np.abs(self._headings)
        else:
            away = np.abs(wrap_array_to_pi(self._headings - bearing_rad))
            worth = np.minimum(free, config.led_reach_m) - config.turn_cost_m_per_rad * away
        best = float(self._headings[int(np.argmax(worth))])
        if self._turns_on(ahead, best):
            return Twist(0.0, self._turning)
        turn = config.gain_per_s * best
        turn = min(max(turn, -config.max_turn_rate_rad_s), config.max_turn_rate_rad_s)
        # Slower in a turn and before a wall, so that the lane ahead stays the one that was looked at.
        slow = max(0.0, math.cos(best)) * min(1.0, (ahead - 0.5 * config.stop_m) / config.go_m)
        return Twist(config.speed_m_s * slow, turn)
