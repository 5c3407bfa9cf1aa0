"""The unscented Kalman filter on beacons."""

from __future__ import annotations

from pilotage.kernels.filters import ukf
from pilotage.stack.localization.landmark_filter import LandmarkFilter, LandmarkFilterConfig, Update
from pilotage.stack.localization.localizer import LOCALIZERS
from pilotage.stack.localization.odometry_prediction import Predict


@LOCALIZERS.add("ukf-landmarks", LandmarkFilterConfig)
class UkfLandmarkLocalizer(LandmarkFilter):
    """Unscented Kalman filter with known correspondences (Julier and Uhlmann 2004; Thrun et al. table 3.4).

    Mean and covariance go through the equations themselves, by points, where the EKF takes their slope:
    right to second order, so a heading uncertain by tenths of a radian does not make it overconfident.

    Fails where the belief is no single hump (a wrong start, an ambiguous place).
    """

    NAME = "ukf-landmarks"

    def _kernels(self) -> tuple[Predict, Update]:
        return ukf.predict, ukf.update_range_bearings
