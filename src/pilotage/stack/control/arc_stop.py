"""What a robot does next of what it is told, and how it is stopped: along the arc that it is on."""

from __future__ import annotations

import math

from pilotage.core.types import STOP, Twist
from pilotage.models.motion.rates import approach
from pilotage.models.odometry import increment_variances
from pilotage.sensors.readings import OdometryIncrement, Readings
from pilotage.stack.control.brakes import Brakes
from pilotage.stack.control.own_motion import odometry_of_every_step
from pilotage.stack.knowledge import RobotKnowledge

STDS = 4.0
"""Of an increment: so much off it hardly ever tells."""
STEPS = 2.0
"""So many steps of speeding up or braking lie between what it is told and what its odometry told, at most."""


class ArcStop:
    """Reckons how a robot rolls by what it was told, and says what it is told that shall stop.

    Who checks a command checks the stop after it along its arc. Told (0, 0) a robot whose brakes are weaker
    than its steering drops its turn at once and rolls straight on, off that arc. So it is told each step's
    speed of the braking, and turn rate and lateral speed in proportion: a twist times a number has the same
    radius. It reckons that rates follow what it was told as fast as its data sheet, or its ``brakes`` as they
    have proved, let them, which is what they will do when a command acts, ``delay_s`` later; where its
    odometry tells that they do not, as against a wall, those that it tells, but none faster than it can be:
    a reading that comes late comes together with the next. Robots that steer wheels, which stay where they
    are in a stop, and those that stop within a step are told (0, 0).
    """

    def __init__(self, robot: RobotKnowledge, brakes: Brakes) -> None:
        motion = robot.motion
        self._motion, self._dt_s, self._brakes = motion, robot.dt_s, brakes
        self._slows_m_s = motion.braking_m_s2 * robot.dt_s
        self._rolls = self._slows_m_s < motion.top_speed_m_s
        self._steers = motion.least_turning_radius_m > 0.0
        self._turns_rad_s = motion.turn_acceleration_rad_s2 * robot.dt_s
        self._top_m_s, self._top_rad_s = motion.top_speed_m_s, motion.top_turn_rate_rad_s
        self._fastest_m_s = math.hypot(motion.top_speed_m_s, motion.top_lateral_m_s)
        self._may_differ_m_s = (STEPS + motion.delay_s / robot.dt_s) * self._slows_m_s
        self._odometry = odometry_of_every_step(robot)
        self._going, self._per_m = STOP, 0.0

    def take_in(self, readings: Readings) -> None:
        """Begin a step with its readings."""
        if not self._rolls or self._odometry is None:
            return
        slows_m_s = self._brakes.likely_m_s2 * self._dt_s
        if slows_m_s != self._slows_m_s:
            # With other brakes it was not where it was reckoned to be.
            ahead_m_s, lateral_m_s = self._brakes.rates_m_s
            self._slows_m_s, self._going = slows_m_s, Twist(ahead_m_s, self._going.w_rad_s, lateral_m_s)
        name, sheet = self._odometry
        told, going, dt_s = readings.by_sensor.get(name), self._going, self._dt_s
        if not isinstance(told, OdometryIncrement):
            return
        along_m_s = told.distance_m / dt_s - going.v_m_s
        across_m_s = told.lateral_m / dt_s - going.lateral_m_s
        # Nearly always so, and quickly told.
        if abs(along_m_s) + abs(across_m_s) <= self._may_differ_m_s:
            return
        driven_m = math.hypot(told.distance_m, told.lateral_m)
        distance_var, _ = increment_variances(driven_m, told.angle_rad, *sheet.densities)
        noise_m_s = STDS * math.sqrt(distance_var) / dt_s
        if math.hypot(along_m_s, across_m_s) > self._may_differ_m_s + noise_m_s:
            over_s = max(dt_s, driven_m / self._fastest_m_s)
            self._going = Twist(told.distance_m / over_s, told.angle_rad / over_s, told.lateral_m / over_s)

    def sent(self, command: Twist) -> None:
        """A command left."""
        if not self._rolls:
            return
        self._going = self.follows(command)
        if self._steers and command.v_m_s != 0.0:
            self._per_m = self._bends(command)

    @property
    def rolls_on(self) -> bool:
        """Whether it is faster than it can stop within a step."""
        return self._rolls and math.hypot(self._going.v_m_s, self._going.lateral_m_s) > self._slows_m_s

    def leaving(self, command: Twist) -> Twist:
        """What is to leave for a command: itself, or of a stop what brakes along the arc."""
        return self._braked() if command == STOP and self._rolls and not self._steers else command

    def follows(self, command: Twist) -> Twist:
        """What it does in the next step, told a command: the command itself where it gets there within it."""
        going, slows = self._going, self._slows_m_s
        if not self._rolls or (not self._steers and self._reaches(command)):
            return command
        motion = self._motion
        v_m_s = approach(going.v_m_s, command.v_m_s, self._top_m_s, slows)
        if self._steers:
            return Twist(v_m_s, v_m_s * (self._bends(command) if command.v_m_s != 0.0 else self._per_m))
        return Twist(
            v_m_s,
            approach(going.w_rad_s, command.w_rad_s, self._top_rad_s, self._turns_rad_s),
            approach(going.lateral_m_s, command.lateral_m_s, motion.top_lateral_m_s, slows),
        )

    def no_faster(self, command: Twist) -> tuple[Twist, ...]:
        """Of a command to one that rolls that way: no faster than it rolls, turning as it comes to or as now.

        None to one that brakes within a step, nor to one that steers wheels.
        """
        going, asked_m_s = self._going, math.hypot(command.v_m_s, command.lateral_m_s)
        speed_m_s = math.hypot(going.v_m_s, going.lateral_m_s)
        same_way = going.v_m_s * command.v_m_s + going.lateral_m_s * command.lateral_m_s > 0.0
        if self._steers or speed_m_s <= self._slows_m_s or not same_way:
            return ()
        share = min(1.0, speed_m_s / asked_m_s)
        v_m_s, lateral_m_s = share * command.v_m_s, share * command.lateral_m_s
        turns = self.follows(command).w_rad_s, going.w_rad_s
        return tuple(Twist(v_m_s, w_rad_s, lateral_m_s) for w_rad_s in turns)

    def _reaches(self, command: Twist) -> bool:
        """Whether all its rates are as told within a step."""
        going = self._going
        return (
            abs(command.v_m_s - going.v_m_s) <= self._slows_m_s
            and abs(command.w_rad_s - going.w_rad_s) <= self._turns_rad_s
            and command.lateral_m_s == going.lateral_m_s
            and abs(command.v_m_s) <= self._top_m_s
            and abs(command.w_rad_s) <= self._top_rad_s
        )

    def _bends(self, command: Twist) -> float:
        """The curvature of a car's path in the next step."""
        motion = self._motion
        tightest = 1.0 / motion.least_turning_radius_m
        change = motion.curvature_rate_per_m_s * self._dt_s
        return approach(self._per_m, command.w_rad_s / command.v_m_s, tightest, change)

    def _braked(self) -> Twist:
        going = self._going
        speed_m_s = math.hypot(going.v_m_s, going.lateral_m_s)
        slower_m_s = speed_m_s - self._slows_m_s
        if slower_m_s <= 0.0:
            return STOP
        share = slower_m_s / speed_m_s
        return Twist(share * going.v_m_s, share * going.w_rad_s, share * going.lateral_m_s)
