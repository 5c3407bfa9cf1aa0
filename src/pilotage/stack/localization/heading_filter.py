"""The role of a heading filter: encoders, gyroscope and magnetometer in, a heading with its variance out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

from pilotage.core.checked import Gives, keeps
from pilotage.core.config import Config
from pilotage.core.misfit import kept, misfit, told
from pilotage.core.registry import Registry
from pilotage.sensors.sensor import NonNegative, Positive


@dataclass(frozen=True, slots=True)
class HeadingEstimate:
    """Heading in [-pi, pi) and its variance."""

    heading_rad: float
    variance_rad2: float


class HeadingFilter(Protocol):
    """Estimates the heading. Built as ``cls(config, initial)``.

    Attributes
    ----------
    USES
        ``gyroscope``, ``magnetometer``: what it makes use of beside the encoders.
    """

    USES: ClassVar[frozenset[str]]

    @property
    def estimate(self) -> HeadingEstimate:
        """The current estimate."""

    def step(
        self,
        encoder_heading_change_rad: float | None,
        gyro_rate_rad_s: float | None,
        dt_s: float,
        resting: bool,
        magnetometer_heading_rad: float | None = None,
    ) -> HeadingEstimate:
        """Take in one step of ``dt_s`` and return the estimate after it.

        Parameters
        ----------
        encoder_heading_change_rad
            Turn since the last step by the wheels; None where the encoders said nothing.
        gyro_rate_rad_s
            Mean rate over the step; None where the gyroscope said nothing.
        resting
            Whether the wheels stand still and are not driven.
        magnetometer_heading_rad
            Heading in the map frame, corrected for offsets; None where there is no reading.

        Raises
        ------
        InputError
            For a ``dt_s`` that is not above 0, for numbers that are not finite, and where neither encoders
            nor gyroscope said anything.
        """


class HeadingErrors(Config):
    """What the sensors are wrong by, as calibration finds it."""

    encoder_var_rad2_per_rad: NonNegative = 4.0e-4
    encoder_var_rad2_per_s: NonNegative = 1.0e-6
    """While the robot moves: slip that shows in no turn."""
    gyro_var_rad2_per_s: NonNegative = 5.2e-8
    """Angle random walk squared; 0.013 degrees per root second were found on a recorded sensor."""
    gyro_bias_var_rad2_s2: NonNegative = 4.0e-4
    """Of the unknown bias at the start: about 1.1 degrees a second."""
    gyro_bias_walk_var_rad2_s3: NonNegative = 1.0e-10
    """How fast the bias wanders: growth of its variance per second."""
    magnetometer_var_rad2: Positive = 3.35e-3
    """The report's R of 11, read as squared degrees."""


USABLE = frozenset({"gyroscope", "magnetometer"})


def _unfit_kept(heading: HeadingFilter) -> str:
    uses = kept(heading, "USES")
    if not isinstance(uses, set | frozenset) or not uses <= USABLE:
        return f"USES {told(uses)}"
    wrong = _unfit(kept(heading, "estimate"))
    return f"estimate {wrong}" if wrong else ""


def _unfit(given: object, *_: object) -> str:
    wrong = misfit(given, HeadingEstimate)
    if wrong or not isinstance(given, HeadingEstimate) or given.variance_rad2 >= 0.0:
        return wrong
    return f"HeadingEstimate with variance_rad2 {given.variance_rad2}"


HEADING_FILTERS: Registry[HeadingFilter] = Registry(
    "heading",
    "pilotage.stack.localization",
    "pilotage.replicas",
    gives=(
        keeps("a HeadingEstimate, and as USES a set of gyroscope, magnetometer or none", _unfit_kept),
        Gives("step", "a HeadingEstimate of finite numbers", _unfit),
    ),
)
