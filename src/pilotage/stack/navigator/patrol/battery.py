"""What a robot on patrol reckons of its battery, by its own odometry."""

from __future__ import annotations

import math

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.kernels.control import eikonal
from pilotage.stack.patrol.roadmap import Roadmap
from pilotage.stack.patrol.task import Supply

DOCK_M = 0.5
"""So near to its station it stands and charges."""
SHORT_SHARE = 0.5
"""Of the reserve, the rest of which is for making room for others on its way to the station."""
SURE_S = 1.0
"""It stands for so much longer than the battery takes: it may come to rest later than its odometry says."""


class Battery:
    """Metres left, and whether they still suffice for more than the path to the station.

    Attributes
    ----------
    roadmap
        By which it reckons what is left to go.
    station
        Its number among the roadmap's places.
    left_m
        Range left.
    low
        Whether it has to charge before anything else.
    charge_s
        It stands there for so long.

    Raises
    ------
    InputError
        Where a full battery does not suffice to the farthest place to visit and back.
    """

    def __init__(self, supply: Supply, roadmap: Roadmap, station: int, speed_m_s: float) -> None:
        self._supply, self.roadmap, self._speed_m_s = supply, roadmap, speed_m_s
        self.station, self.left_m, self.low = station, supply.range_m, False
        self.charge_s = supply.charge_s + SURE_S
        there_m = roadmap.longest_s(station) * speed_m_s
        least_m = 2.0 * there_m + supply.reserve_m
        if supply.range_m < least_m:
            raise InputError(
                f"team.battery.range_m: expected at least {math.ceil(least_m)} m, from a charging station to "
                f"the farthest place to visit and back with a reserve of {supply.reserve_m:g} m, found "
                f"{supply.range_m:g} m"
            )

    def spend(self, driven_m: float) -> None:
        """It drove so far, forwards or back."""
        self.left_m -= abs(driven_m)

    def fill(self) -> None:
        """It stood at its station for long enough."""
        self.left_m, self.low = self._supply.range_m, False

    def check(self, pose: Pose2) -> bool:
        """Whether it is time to go and charge; ``low`` from then on."""
        self.low = self._spare_m(pose) <= self._supply.reserve_m
        return self.low

    def is_short(self, pose: Pose2) -> bool:
        """Whether it is low and little of the reserve is left: enough for the path to the station alone."""
        return self.low and self._spare_m(pose) <= SHORT_SHARE * self._supply.reserve_m

    def _spare_m(self, pose: Pose2) -> float:
        """What is left beyond the path to the station.

        The time to go is longer than the path over the speed wherever walls are near: no path is longer than
        what it says.
        """
        field = self.roadmap.placed(self.roadmap.time_s(self.station))
        to_go_s = eikonal.value_at(pose.x_m, pose.y_m, field, 0.0)
        # Where the map has no floor the pose is a little off: the next one tells.
        return self.left_m - (to_go_s * self._speed_m_s if to_go_s < math.inf else 0.0)
