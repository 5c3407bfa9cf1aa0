"""The iterated extended Kalman filter on beacons."""

from __future__ import annotations

from pilotage.kernels.filters import ekf, iekf
from pilotage.stack.localization.landmark_filter import LandmarkFilter, LandmarkFilterConfig, Update
from pilotage.stack.localization.localizer import LOCALIZERS
from pilotage.stack.localization.odometry_prediction import Predict


@LOCALIZERS.add("iekf-landmarks", LandmarkFilterConfig)
class IteratedEkfLandmarkLocalizer(LandmarkFilter):
    """EKF that linearizes each beacon anew at its own outcome (Bell and Cathey 1993).

    Pays where a measurement is much surer than the prior and the beacon is near: the first sighting after
    a vague start. Fails as the EKF does without beacons in sight, and gates on the first linearization.
    """

    NAME = "iekf-landmarks"

    def _kernels(self) -> tuple[Predict, Update]:
        return ekf.predict, iekf.update_range_bearings
