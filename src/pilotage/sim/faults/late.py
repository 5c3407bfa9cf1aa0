"""Readings that arrive late, twice, or in another order."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import Field

from pilotage.sensors.readings import Reading
from pilotage.sensors.sensor import Positive
from pilotage.sim.faults.fault import FAULTS, FaultConfig, FaultSetting


class DelayConfig(FaultConfig):
    """How late a reading is at most."""

    most_s: Positive = 0.2


@FAULTS.add("delay", DelayConfig)
class Delay:
    """Holds each reading back for a time of its own, from none to the most: jitter, and overtaking."""

    def __init__(self, config: DelayConfig, setting: FaultSetting) -> None:
        self._most_s, self._rng = config.most_s, setting.rng
        self._held: list[tuple[float, Reading]] = []

    def pass_on(self, t_s: float, readings: Sequence[Reading]) -> Sequence[Reading]:
        """Those that are due, in the order in which they are."""
        self._held += [(t_s + self._most_s * float(self._rng.random()), reading) for reading in readings]
        due = sorted((one for one in self._held if one[0] <= t_s), key=lambda one: one[0])
        self._held = [one for one in self._held if one[0] > t_s]
        return [reading for _, reading in due]


class RepeatConfig(FaultConfig):
    """Which share arrives twice."""

    share: float = Field(default=0.1, ge=0.0, le=1.0)


@FAULTS.add("repeat", RepeatConfig)
class Repeat:
    """Tells some readings twice in the same step; of odometry the motion then counts twice."""

    def __init__(self, config: RepeatConfig, setting: FaultSetting) -> None:
        self._share, self._rng = config.share, setting.rng

    def pass_on(self, t_s: float, readings: Sequence[Reading]) -> Sequence[Reading]:  # noqa: ARG002
        """All of them, some twice."""
        return [one for one in readings for _ in range(2 if self._rng.random() < self._share else 1)]


class ShuffleConfig(FaultConfig):
    """How many neighbours change places."""

    window: int = Field(default=3, ge=2, le=1000)


@FAULTS.add("shuffle", ShuffleConfig)
class Shuffle:
    """Gathers some readings and tells them in another order, one whenever the next one arrives."""

    def __init__(self, config: ShuffleConfig, setting: FaultSetting) -> None:
        self._window, self._rng = config.window, setting.rng
        self._gathered: list[Reading] = []
        self._ready: list[Reading] = []

    def pass_on(self, t_s: float, readings: Sequence[Reading]) -> Sequence[Reading]:  # noqa: ARG002
        """As many as came, once the first have been gathered."""
        out: list[Reading] = []
        for reading in readings:
            self._gathered.append(reading)
            if len(self._gathered) == self._window:
                self._ready += [self._gathered[k] for k in self._rng.permutation(self._window)]
                self._gathered = []
            if self._ready:
                out.append(self._ready.pop(0))
        return out
