"""Readings that never arrive: one here and there, or all of them for a while."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import Field

from pilotage.sensors.readings import Reading
from pilotage.sensors.sensor import Positive
from pilotage.sim.faults.fault import FAULTS, FaultConfig, FaultSetting


class DropConfig(FaultConfig):
    """Which share is lost."""

    share: float = Field(default=0.3, ge=0.0, le=1.0)


@FAULTS.add("drop", DropConfig)
class Drop:
    """Loses readings, each by itself; the motion that an odometry reading would have told is lost with it."""

    def __init__(self, config: DropConfig, setting: FaultSetting) -> None:
        self._share, self._rng = config.share, setting.rng

    def pass_on(self, t_s: float, readings: Sequence[Reading]) -> Sequence[Reading]:  # noqa: ARG002
        """Those that are not lost."""
        return [reading for reading in readings if self._rng.random() >= self._share]


class GapConfig(FaultConfig):
    """How long nothing arrives, from ``from_s`` on."""

    length_s: Positive = 60.0


@FAULTS.add("gap", GapConfig)
class Gap:
    """Loses every reading for a while."""

    def __init__(self, config: GapConfig, setting: FaultSetting) -> None:
        del setting
        self._until_s = config.from_s + config.length_s

    def pass_on(self, t_s: float, readings: Sequence[Reading]) -> Sequence[Reading]:
        """All of them, once it is over."""
        return readings if t_s >= self._until_s else ()
