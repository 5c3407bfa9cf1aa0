"""The extended Kalman filter on beacons."""

from __future__ import annotations

from pilotage.kernels.filters import ekf
from pilotage.stack.localization.landmark_filter import LandmarkFilter, LandmarkFilterConfig, Update
from pilotage.stack.localization.localizer import LOCALIZERS
from pilotage.stack.localization.odometry_prediction import Predict


@LOCALIZERS.add("ekf-landmarks", LandmarkFilterConfig)
class EkfLandmarkLocalizer(LandmarkFilter):
    """Extended Kalman filter with known correspondences (night-watch report 3.3; Thrun et al. table 7.2).

    Each beacon passes a chi-square gate with two degrees of freedom and updates in Joseph form.

    Fails where no beacon is in sight for long (it is dead reckoning then), or after a wrong start: a
    pose far outside its covariance gates away what could mend it.
    """

    NAME = "ekf-landmarks"

    def _kernels(self) -> tuple[Predict, Update]:
        return ekf.predict, ekf.update_range_bearings
