"""What every sensor declares of its readings as numbers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.models.motion.motion import MotionConfig
from pilotage.sensors.numbers import SensorSetting
from support.robots import BEACONS


def tells_its_numbers(
    config: Any, readings: Iterable[Any], dt_s: float, motion: MotionConfig | None = None
) -> None:
    """As many as declared in every reading, all within the bounds."""
    setting = SensorSetting(motion or DifferentialDriveConfig(), dt_s, BEACONS.ids)
    declared = config.as_numbers(setting)
    assert declared is not None, "every sensor of ours declares its numbers"
    for reading in readings:
        for numbers in () if reading is None else declared:
            values = numbers.read(reading)
            assert values.shape == (numbers.size,), numbers.name
            assert (values >= numbers.low).all()
            assert (values <= numbers.high).all()
            assert numbers.low <= numbers.rest <= numbers.high
