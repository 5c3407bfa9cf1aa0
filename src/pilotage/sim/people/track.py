"""People who walk as real ones were seen to walk, whatever stands in their way now."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydantic import Field

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.logs.people import RADIUS_M, read_people
from pilotage.sensors.sensor import NonNegative, Positive
from pilotage.sim.people.people import PEOPLE, Around, PeopleSetting

CLEAR_M = 3.5
"""Recordings begin in the midst of things: who would appear nearer to a robot than this comes later. Real
people are seen from farther away: a robot that brakes from 2 m/s while somebody comes at 2.5 needs 3.3 m."""
APART_S = 1.0
"""Who comes so long after another one has left may take the place of its row."""


class TrackConfig(Config):
    """The recording, and where and when in it the run begins."""

    file: str = Field(min_length=1)
    """One annotation a line: frame, person, x, y."""
    frame_rate_hz: Positive = 25.0
    begins_s: NonNegative = 0.0
    """Since the recording's first annotation."""
    moved_by_m: tuple[float, float] = (0.0, 0.0)
    radius_m: Positive = RADIUS_M


@PEOPLE.add("track", TrackConfig)
class TrackPeople:
    """Straight between their annotations; there from the first to the last one; they give way to nobody."""

    def __init__(self, config: TrackConfig, setting: PeopleSetting) -> None:
        tracks = read_people(Path(config.file), config.frame_rate_hz)
        if config.begins_s > tracks.duration_s:
            raise InputError(
                f"{setting.where}.begins_s: expected at most the {tracks.duration_s:.1f} s that the "
                f"recording lasts, found {config.begins_s:g}"
            )
        self._tracks, self._begins_s = tracks, config.begins_s
        self._moved = np.array(config.moved_by_m)
        self._slot = tracks.slots(APART_S)
        self._there = np.zeros(int(self._slot.max()) + 1, dtype=np.bool_)
        self.radius_m: FloatArray = np.full(int(self._slot.max()) + 1, config.radius_m)

    def step(self, t_s: float, around: Around) -> FloatArray:
        """Where they were then."""
        out = np.full((len(self.radius_m), 2), np.nan)
        rows, places = self._tracks.at(self._begins_s + t_s)
        out[self._slot[rows]] = places + self._moved
        for x, y, _, radius in around.robots_m.tolist():
            near = np.hypot(out[:, 0] - x, out[:, 1] - y) < radius + self.radius_m + CLEAR_M
            out[near & ~self._there] = np.nan
        self._there = np.isfinite(out[:, 0])
        return out
