"""The robots' true batteries: what they drove since they were full, and whether they stand at a station."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pilotage.missions.mission import Mission
from pilotage.missions.places import Point
from pilotage.missions.team import BatteryConfig
from pilotage.sim.bodies.body import Body
from pilotage.sim.source import Simulator

REACH_M = 1.0
"""A station charges whose middle is this near."""


@dataclass(slots=True)
class _Charge:
    body: Body
    station: Point
    full_at_m: float = 0.0
    """What it had driven when it was full."""
    before_m: float = 0.0
    stood_s: float = 0.0
    empty: bool = False


class Batteries:
    """Batteries that driving empties; standing at the own station for the time to charge fills one.

    Turning on the spot is free: the range is a length of path. A charge that is broken off is lost.
    """

    def __init__(self, mission: Mission, source: Simulator) -> None:
        self._config: BatteryConfig | None = mission.team.battery
        self._dt_s = mission.run.dt_s
        stations = [mission.station_of(index) for index in range(len(mission.members))]
        self._charges = [
            _Charge(body, station)
            for body, station in zip(source.bodies, stations, strict=True)
            if station is not None
        ]

    def run_out(self) -> list[int]:
        """After every step: the numbers of robots whose batteries became empty in it."""
        config, now = self._config, []
        if config is None:
            return []
        for index, charge in enumerate(self._charges):
            driven_m = charge.body.driven_m
            pose, (x, y) = charge.body.pose, charge.station
            stands = driven_m == charge.before_m
            there = math.hypot(pose.x_m - x, pose.y_m - y) <= REACH_M
            charge.stood_s = charge.stood_s + self._dt_s if stands and there and not charge.empty else 0.0
            charge.before_m = driven_m
            if charge.stood_s >= config.charge_s:
                charge.full_at_m = driven_m
            if not charge.empty and driven_m - charge.full_at_m >= config.range_m:
                charge.empty = True
                now.append(index)
        return now
