"""What an answer of ``pilotage calibrate`` holds of each kind, as far as its page draws it.

The page divides by these numbers, takes their logarithms and looks names up among them: what a damaged file
holds instead is found here, where it can be named, and not in the middle of a figure.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from pilotage.core.config import describe
from pilotage.core.misfit import LARGEST

Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, le=LARGEST)]
Count = Annotated[int, Field(ge=0, le=2**53)]
LARGEST_POWER = 100.0
"""Of a cosine: what falls faster is nothing that a camera sees."""


class _Part(BaseModel):
    """An object in it; there may be more than the page needs, which stays as it is."""

    model_config = ConfigDict(extra="allow", frozen=True, strict=True)


class EstimateRow(_Part):
    """A value and the interval that holds the truth 95 times in 100."""

    value: Number
    low: Number
    high: Number


class Normality(_Part):
    """What a test said of a distribution; nothing where there was none."""

    normality_test: str | None = None
    normality_p: Number | None = None


class _Answer(_Part):
    """What all kinds share: estimates by their names among the rest."""

    warnings: list[str] = []

    @model_validator(mode="before")
    @classmethod
    def _estimates_are_numbers(cls, answer: Any) -> Any:
        for key, value in answer.items():
            if isinstance(value, Mapping) and {"value", "low", "high"} <= set(value):
                try:
                    EstimateRow.model_validate(value)
                except ValidationError as error:
                    raise ValueError(describe(error, EstimateRow, key)) from None
        return answer


class DistanceErrors(Normality):
    """Errors of the steps of a log along its path."""

    mean_m: Number
    var_m2: Number


class AngleErrors(Normality):
    """Errors of the steps of a log in heading."""

    mean_rad: Number
    var_rad2: Number


class OdometryLog(_Part):
    """One log of steps."""

    log: str
    steps: Count
    used: bool
    wrong_axis: bool
    distance_error: DistanceErrors
    angle_error: AngleErrors


class OffsetModel(_Part):
    """One shape that the offset may have."""

    shape: str
    free_parameters: Count
    rms_m: Number
    delta_bic: Number


class Offset(_Part):
    """The shape that fits best, and all of them."""

    shape: str
    explanation: str
    models: list[OffsetModel]


class OdometryAnswer(_Answer):
    """Of ``calibrate odometry``."""

    logs: list[OdometryLog] = Field(min_length=1)
    offset: Offset | None = None


class AloneRow(EstimateRow):
    """One that is drawn as a value with an arm to each end of its interval."""

    @model_validator(mode="after")
    def _holds_the_value(self) -> Self:
        if not self.low <= self.value <= self.high:
            raise ValueError("expected a value between low and high")
        return self


class CommandLog(_Part):
    """One recording of a drive, and what it gives alone."""

    alone: dict[str, AloneRow] | None = None
    robot: int | None = None


class CommandsAnswer(_Answer):
    """Of ``calibrate commands``; without a camera's ranges there is neither scale nor power."""

    windows: Count
    readings: Count
    delay_s: EstimateRow
    speed_gain: EstimateRow
    speed_loss_per_rad_s: EstimateRow
    turn_gain: EstimateRow
    bend_rad_per_m: EstimateRow
    range_scale: EstimateRow | None = None
    depth_power: EstimateRow | None = None
    logs: list[CommandLog] = Field(min_length=1)

    @model_validator(mode="after")
    def _belongs_together(self) -> Self:
        camera = ("range_scale", "depth_power")
        if len({name in self.model_fields_set and getattr(self, name) is not None for name in camera}) > 1:
            raise ValueError("expected range_scale and depth_power or neither")
        if self.range_scale is not None and not self.range_scale.value > 0.0:
            raise ValueError("range_scale.value: expected more than 0")
        if self.depth_power is not None and not abs(self.depth_power.value) <= LARGEST_POWER:
            raise ValueError(f"depth_power.value: expected a number within {LARGEST_POWER:g}")
        names = ["speed_gain", "speed_loss_per_rad_s", "turn_gain", "bend_rad_per_m"]
        names += camera if self.range_scale is not None else []
        for i, log in enumerate(self.logs):
            missing = [name for name in names if log.alone and name not in log.alone]
            if missing:
                raise ValueError(f"logs.{i}.alone: expected {missing[0]}, found none")
        return self


class RangeSensor(Normality):
    """One quantity of a sensor that looks at the same thing all the time, in metres or radians."""

    sensor: str
    quantity: str
    readings: Count
    mean_m: EstimateRow | None = None
    var_m2: EstimateRow | None = None
    expected_m: Number | None = None
    given_var_m2: Number | None = None
    mean_rad: EstimateRow | None = None
    var_rad2: EstimateRow | None = None
    expected_rad: Number | None = None
    given_var_rad2: Number | None = None
    recovered: bool | None = None

    @model_validator(mode="after")
    def _has_one_unit(self) -> Self:
        pairs = ((self.mean_m, self.var_m2), (self.mean_rad, self.var_rad2))
        if sorted(sum(part is not None for part in pair) for pair in pairs) != [0, 2]:
            raise ValueError("expected a mean and a variance of one unit")
        named = self.model_fields_set & {"mean_m", "var_m2", "mean_rad", "var_rad2"}
        if len(named) != 2:
            raise ValueError("expected a mean and a variance of one unit")
        if (self.given_var_m2, self.given_var_rad2) != (None, None) and self.recovered is None:
            raise ValueError("expected whether the given variance was recovered")
        return self


class RangeAnswer(_Answer):
    """Of ``calibrate range``."""

    sensors: list[RangeSensor] = Field(min_length=1)


class GyroscopeEntry(_Part):
    """One axis of a log: its Allan deviation where it was at rest, else what it turned."""

    log: str
    axis: Literal["x", "y", "z"]
    allan_tau_s: list[Positive] | None = None
    allan_deviation_rad_s: list[Positive] | None = None
    angle_random_walk_rad_sqrt_s: EstimateRow | None = None
    turn_rad: Number = 0.0

    @model_validator(mode="after")
    def _has_pairs(self) -> Self:
        if "allan_tau_s" in self.model_fields_set and not self.allan_tau_s:
            raise ValueError("expected averaging times, found none")
        if len(self.allan_tau_s or ()) != len(self.allan_deviation_rad_s or ()):
            raise ValueError("expected as many Allan deviations as averaging times")
        return self


class DriveEntry(_Part):
    """A gyroscope against the reference heading of a drive."""

    log: str
    bias_rad_s: EstimateRow
    scale: EstimateRow | None
    bias_with_scale_rad_s: EstimateRow | None

    @model_validator(mode="after")
    def _has_both(self) -> Self:
        if self.scale is not None and self.bias_with_scale_rad_s is None:
            raise ValueError("expected a bias with the scale")
        return self


class MagnetometerEntry(_Part):
    """A magnetometer that was turned about an axis, and its ellipse in the plane of the two others."""

    log: str
    axes: Literal["xy", "yz", "xz", "yx", "zy", "zx"]
    offset_gauss: dict[str, EstimateRow]
    axis_ratio: EstimateRow
    radius_gauss: Number
    residual_gauss: Number
    soft_iron: list[list[Number]]
    tilt_rad: Number

    @model_validator(mode="after")
    def _is_an_ellipse(self) -> Self:
        missing = [axis for axis in self.axes if axis not in self.offset_gauss]
        if missing:
            raise ValueError(f"offset_gauss: expected axis {missing[0]}, found none")
        if [len(row) for row in self.soft_iron] != [2, 2]:
            raise ValueError("soft_iron: expected two rows of two numbers")
        (a, b), (c, d) = self.soft_iron
        if not abs(a * d - b * c) > 1e-9 * max(abs(a * d), abs(b * c)):
            raise ValueError("soft_iron: expected a matrix that has an inverse")
        return self


class HeadingAnswer(_Answer):
    """Of ``calibrate heading``."""

    gyroscope: list[GyroscopeEntry]
    magnetometer: list[MagnetometerEntry]
    gyroscope_while_driving: list[DriveEntry] = []


ANSWERS: dict[str, type[_Answer]] = {
    "odometry": OdometryAnswer,
    "range": RangeAnswer,
    "heading": HeadingAnswer,
    "commands": CommandsAnswer,
}


def require_answer(answer: Mapping[str, Any]) -> None:
    """Look an answer over.

    Raises
    ------
    ValueError
        With the place in it and what is wrong there.
    """
    model = ANSWERS[answer["calibration"]]
    try:
        model.model_validate(answer)
    except ValidationError as error:
        raise ValueError(describe(error, model, "")) from None
