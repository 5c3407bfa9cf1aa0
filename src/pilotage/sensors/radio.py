"""A radio: what the others sent, as far as it carries."""

from __future__ import annotations

from typing import Any

from pydantic import Field, field_validator

from pilotage.sensors.numbers import Numbers, SensorSetting
from pilotage.sensors.sensor import SENSORS, NonNegative, Positive, SensorConfig


@SENSORS.add_config("radio")
class RadioConfig(SensorConfig):
    """Broadcasts reach every radio on the same world within both ranges, late, and some fail to arrive.

    A disc model: walls neither stop nor weaken it, and messages do not collide.
    """

    range_m: Positive | None = None
    """None: everywhere."""
    loss: float = Field(default=0.0, ge=0.0, le=1.0)
    """Share of messages that do not arrive, each at each receiver for itself."""
    delay_s: NonNegative = 0.0
    """At the receiver, beside the step that any message takes."""

    @field_validator("range_m", mode="before")
    @classmethod
    def _carries_somewhere(cls, value: Any) -> Any:
        """Who wants none asks for a range of 0, and is told how."""
        if isinstance(value, int | float) and value == 0:
            raise ValueError("expected a range above 0, found 0; to have no radio set team.radio to null")
        return value

    def as_numbers(self, setting: SensorSetting) -> tuple[Numbers, ...]:
        """None: messages may be anything."""
        del setting
        return ()
