"""What the robot is told before it starts: its map, its landmarks, its own data sheet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import Goal
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.segment_map import SegmentMap
from pilotage.sensors.sensor import SensorConfig
from pilotage.stack.interface import Belief

S = TypeVar("S", bound=SensorConfig)


@dataclass(frozen=True, slots=True)
class Knowledge:
    """Everything a component of the stack may know at its construction; no truth in it."""

    world_map: SegmentMap
    landmarks: Landmarks
    sensors: Mapping[str, SensorConfig]
    body_radius_m: float
    max_speed_m_s: float
    max_turn_rate_rad_s: float
    dt_s: float
    initial: Belief
    goal: Goal | None
    goal_tolerance_m: float
    streams: RandomStreams

    def sensors_of(self, kind: type[S]) -> dict[str, S]:
        """All sensors of one kind by name."""
        return {name: config for name, config in self.sensors.items() if isinstance(config, kind)}

    def one_sensor(self, kind: type[S], needed_by: str) -> tuple[str, S]:
        """Return the only sensor of one kind.

        Raises
        ------
        InputError
            If the robot has none of them or more than one.
        """
        found = list(self.sensors_of(kind).items())
        if len(found) != 1:
            raise InputError(
                f"{needed_by}: expected one {kind.__name__.removesuffix('Config')} among robot.sensors, "
                f"found {len(found)}; the robot has: {', '.join(self.sensors) or 'none'}"
            )
        return found[0]
