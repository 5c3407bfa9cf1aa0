"""The role of local controller: what it sees of the world in one step, the command out; and its registry."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from pilotage.core.checked import Gives
from pilotage.core.errors import InputError
from pilotage.core.misfit import kept, misfit, told
from pilotage.core.registry import Registry
from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.kernels.control.scan_ends import evenly_spaced


@dataclass(frozen=True, slots=True)
class LocalLimits:
    """What the robot can do, as its data sheet says.

    Attributes
    ----------
    speed_m_s, reverse_m_s
        Highest speeds forwards and backwards; 0 backwards for a robot that cannot.
    acceleration_m_s2, deceleration_m_s2
        Speeding up and braking.
    turn_rate_rad_s, turn_acceleration_rad_s2
        Highest turn rate, and how fast it changes.
    delay_s
        From giving a command until the robot begins to follow it.
    """

    speed_m_s: float
    reverse_m_s: float
    acceleration_m_s2: float
    deceleration_m_s2: float
    turn_rate_rad_s: float
    turn_acceleration_rad_s2: float
    delay_s: float = 0.0

    def __post_init__(self) -> None:
        """Refuse limits that no robot has."""
        for name in (
            "speed_m_s",
            "acceleration_m_s2",
            "deceleration_m_s2",
            "turn_rate_rad_s",
            "turn_acceleration_rad_s2",
        ):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise InputError(f"limits: {name}: expected a finite number above 0, found {value}")
        for name in ("reverse_m_s", "delay_s"):
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise InputError(f"limits: {name}: expected a finite number, 0 or more, found {value}")


@dataclass(frozen=True, slots=True)
class LocalView:
    """All that a local controller gets in one step.

    Attributes
    ----------
    t_s
        Time of the scan; later than the step before.
    pose
        Of the base in the odometry's frame, which drifts.
    twist
        Measured speed and turn rate.
    ranges_m
        (N,) of the laser; ``max_range_m`` and above mean no echo, 0 and NaN that nothing was measured: the
        ground there is not known to be free.
    beam_angles_rad
        (N,) directions in the sensor's frame, evenly spaced and increasing.
    mount
        Of the laser on the base.
    goal_xy_m
        In the odometry's frame as it is when this goal is given for the first time; a controller that
        corrects the odometry keeps it there.
    goal_tolerance_m
        Nearer than this is there.
    goal_is_sure
        The goal is where it should be in the odometry's frame as it is now: a controller that corrects the
        odometry does not move it.
    footprint_xy_m
        (K, 2) corners of a convex polygon in the base frame.
    speed_var_m2_s2, turn_rate_var_rad2_s2
        Variances of the measured ``twist``, as far as known.
    """

    t_s: float
    pose: Pose2
    twist: Twist
    ranges_m: FloatArray
    beam_angles_rad: FloatArray
    mount: Pose2
    max_range_m: float
    goal_xy_m: tuple[float, float]
    limits: LocalLimits
    footprint_xy_m: FloatArray
    goal_tolerance_m: float = 0.3
    people_about: bool = False
    goal_is_sure: bool = False
    speed_var_m2_s2: float = 0.0
    turn_rate_var_rad2_s2: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a scan that does not fit its angles, and beams that are not evenly spaced."""
        angles = self.beam_angles_rad
        if self.ranges_m.shape != angles.shape or angles.ndim != 1 or angles.shape[0] < 2:
            raise InputError(
                f"scan: expected as many ranges as beam angles, two or more, found {self.ranges_m.shape} "
                f"and {angles.shape}"
            )
        if not evenly_spaced(angles):
            raise InputError("scan: expected beam angles that increase evenly; resample the scan")


class LocalController(Protocol):
    """Drives to a goal through ground that is not known beforehand. Built as ``cls(config, generator)``."""

    def step(self, view: LocalView) -> Twist:
        """Give the next command."""

    @property
    def status(self) -> str:
        """What it is doing, in a word: driving, turning, backing, waiting, closed, arrived."""


def _unfit(given: object, controller: LocalController, *_: object) -> str:
    status = kept(controller, "status")
    return misfit(given, Twist) or ("" if isinstance(status, str) else f"status {told(status)}")


LOCAL_CONTROLLERS: Registry[LocalController] = Registry(
    "local controller",
    "pilotage.stack.control.local",
    gives=(Gives("step", "a Twist of finite numbers, and a word as status", _unfit),),
)
