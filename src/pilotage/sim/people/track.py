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

NOTICED_STEPS = 6
"""So many steps after somebody appeared a robot brakes: four to track him, one to see, one to act."""
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
    """Straight between their annotations; there from the first to the last one; they give way to nobody.

    Recordings begin in the midst of things, and real people are seen from farther away: who would appear
    so near that a robot, as fast as it is then, could not stop before he reaches it, comes later
    (``needs_m``).
    """

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
        self._before: FloatArray = setting.robots_m
        self._stopping, self._dt_s = setting.stopping, setting.dt_s
        self._there = np.zeros(int(self._slot.max()) + 1, dtype=np.bool_)
        self.radius_m: FloatArray = np.full(int(self._slot.max()) + 1, config.radius_m)

    def step(self, t_s: float, around: Around) -> FloatArray:
        """Where they were then."""
        out = np.full((len(self.radius_m), 2), np.nan)
        rows, places = self._tracks.at(self._begins_s + t_s)
        slots = self._slot[rows]
        out[slots] = places + self._moved
        walks = np.zeros(len(self.radius_m))
        walks[slots] = self._tracks.speeds_m_s(rows)
        driven = np.hypot(*(around.robots_m[:, :2] - self._before[:, :2]).T) / self._dt_s
        self._before = around.robots_m.copy()
        robots = zip(around.robots_m.tolist(), driven.tolist(), self._stopping.tolist(), strict=True)
        for (x, y, _, radius), speed, (delay_s, braking) in robots:
            needed = needs_m(speed, walks, delay_s + NOTICED_STEPS * self._dt_s, braking)
            near = np.hypot(out[:, 0] - x, out[:, 1] - y) < radius + self.radius_m + needed
            out[near & ~self._there] = np.nan
        self._there = np.isfinite(out[:, 0])
        return out


def needs_m(speed_m_s: float, walks_m_s: FloatArray, reaction_s: float, braking_m_s2: float) -> FloatArray:
    """(K,) gap that a robot needs to stand before people reach it who come at it as fast as they walk."""
    stands_s = reaction_s + speed_m_s / braking_m_s2
    robot_m = speed_m_s * reaction_s + speed_m_s**2 / (2.0 * braking_m_s2)
    return np.asarray(robot_m + walks_m_s * stands_s)
