"""What a robot's commands make it drive, by its own data sheet."""

from __future__ import annotations

import math
from collections import deque

from pilotage.core.types import STOP, Command, Twist
from pilotage.models.motion.motion import MotionConfig
from pilotage.models.motion.rates import approach
from pilotage.models.motion.wheel_drive import WheelDriveConfig
from pilotage.sensors.readings import OdometryIncrement, Readings
from pilotage.stack.interface import Stack, WrappedStack

EPSILON_S = 1e-9


class CommandedMotion:
    """Rates that follow the commands sent as fast as the data sheet lets them (motion by controls: Thrun et
    al. 2005, section 5.3).

    Within a step the acting command u is the last one sent ``delay_s`` before its begin or earlier; each rate
    is v <- v + clip(u - v, +-a dt), held for the step, or with a lag T the mean of u + (v - u) exp(-t / T). A
    car's turn rate is its speed times its curvature, which follows that of the command alike. Wrong where a
    robot does not do as it is told: slips, stands against a wall, answers later than its data sheet says.
    """

    def __init__(self, motion: MotionConfig, dt_s: float) -> None:
        self._motion, self._dt_s = motion, dt_s
        self._last_s: float | None = None
        self._under_way: deque[tuple[float, Twist]] = deque()
        self._acting = STOP
        self._v = self._lateral = self._w = self._curvature = 0.0

    def sent(self, t_s: float, command: Command) -> None:
        """A command was sent at this time."""
        self._under_way.append((t_s + self._motion.delay_s, _as_twist(command, self._motion)))

    def step(self, t_s: float) -> OdometryIncrement:
        """What was driven from the last step to this one."""
        begin_s = t_s - self._dt_s if self._last_s is None else self._last_s
        self._last_s = t_s
        while self._under_way and self._under_way[0][0] <= begin_s + EPSILON_S:
            self._acting = self._under_way.popleft()[1]
        dt_s, u, motion = max(t_s - begin_s, 0.0), self._acting, self._motion
        top_m_s, change = motion.top_speed_m_s, motion.braking_m_s2 * dt_s
        self._v, ahead_m = self._follow(self._v, u.v_m_s, top_m_s, change, dt_s)
        self._lateral, left_m = self._follow(self._lateral, u.lateral_m_s, top_m_s, change, dt_s)
        if motion.least_turning_radius_m > 0.0:
            if u.v_m_s != 0.0:
                tightest = 1.0 / motion.least_turning_radius_m
                change = motion.curvature_rate_per_m_s * dt_s
                self._curvature = approach(self._curvature, u.w_rad_s / u.v_m_s, tightest, change)
            return OdometryIncrement(ahead_m, self._curvature * ahead_m, left_m)
        change = motion.turn_acceleration_rad_s2 * dt_s
        self._w, turn_rad = self._follow(self._w, u.w_rad_s, motion.top_turn_rate_rad_s, change, dt_s)
        return OdometryIncrement(ahead_m, turn_rad, left_m)

    def _follow(
        self, rate: float, wanted: float, limit: float, change: float, dt_s: float
    ) -> tuple[float, float]:
        """A rate after a step, and what it made in it."""
        lag_s, target = self._motion.lag_s, approach(rate, wanted, limit, change)
        if lag_s == 0.0:
            return target, target * dt_s
        kept = math.exp(-dt_s / lag_s)
        return target + (rate - target) * kept, target * dt_s + (rate - target) * lag_s * (1.0 - kept)


class CommandedStack(WrappedStack):
    """A stack whose commands a model of its robot is told of."""

    def __init__(self, stack: Stack, commanded: CommandedMotion) -> None:
        super().__init__(stack)
        self._commanded = commanded

    def step(self, readings: Readings) -> Command:
        """One control step."""
        command = self._stack.step(readings)
        self._commanded.sent(readings.t_s, command)
        return command


def _as_twist(command: Command, motion: MotionConfig) -> Twist:
    """A command as a twist; of wheels that cannot be as fast as asked, what they make of it."""
    if not isinstance(motion, WheelDriveConfig):
        assert isinstance(command, Twist), "other motions refuse wheel speeds"
        return command
    top_m_s, separation_m = motion.top_speed_m_s, motion.wheel_separation_m
    if isinstance(command, Twist):
        faster_m_s = abs(command.v_m_s) + 0.5 * separation_m * abs(command.w_rad_s)
        slower = min(1.0, top_m_s / max(faster_m_s, 1e-12))
        return Twist(slower * command.v_m_s, slower * command.w_rad_s)
    left, right = (
        min(max(speed * motion.wheel_radius_m, -top_m_s), top_m_s)
        for speed in (command.left_rad_s, command.right_rad_s)
    )
    return Twist(0.5 * (left + right), (right - left) / separation_m)
