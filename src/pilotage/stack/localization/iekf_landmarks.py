"""The iterated extended Kalman filter on beacons."""

from __future__ import annotations

from pilotage.kernels.filters import ekf, iekf
from pilotage.maps.world_map import WorldMap
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.landmark_filter import LandmarkFilter, LandmarkFilterConfig
from pilotage.stack.localization.localizer import LOCALIZERS


@LOCALIZERS.add("iekf-landmarks", LandmarkFilterConfig)
class IteratedEkfLandmarkLocalizer(LandmarkFilter):
    """EKF that linearizes each beacon anew at its own outcome (Bell and Cathey 1993).

    Pays where a measurement is much surer than the prior and the beacon is near: the first sighting after
    a vague start. Fails as the EKF does without beacons in sight, and gates on the first linearization.
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
            "iekf-landmarks", ekf.predict, iekf.update_range_bearings, config, robot, chart, initial, journal
        )
