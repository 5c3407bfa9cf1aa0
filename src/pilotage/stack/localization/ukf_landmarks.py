"""The unscented Kalman filter on beacons."""

from __future__ import annotations

from pilotage.kernels.filters import ukf
from pilotage.maps.world_map import WorldMap
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.landmark_filter import LandmarkFilter, LandmarkFilterConfig
from pilotage.stack.localization.localizer import LOCALIZERS


@LOCALIZERS.add("ukf-landmarks", LandmarkFilterConfig)
class UkfLandmarkLocalizer(LandmarkFilter):
    """Unscented Kalman filter with known correspondences (Julier and Uhlmann 2004; Thrun et al. table 3.4).

    Mean and covariance go through the equations themselves, by points, where the EKF takes their slope:
    right to second order, so a heading uncertain by tenths of a radian does not make it overconfident.

    Fails where the belief is no single hump (a wrong start, an ambiguous place).
    """

    def __init__(
        self,
        config: LandmarkFilterConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        initial: Belief,
        journal: Journal,
    ) -> None:
        super().__init__(
            "ukf-landmarks", ukf.predict, ukf.update_range_bearings, config, robot, chart, initial, journal
        )
