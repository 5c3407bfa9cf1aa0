"""The Kalman filters on beacons: extended, iterated and unscented."""

from __future__ import annotations

from pilotage.kernels.filters import ekf, iekf, ukf
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


@LOCALIZERS.add("iekf-landmarks", LandmarkFilterConfig)
class IteratedEkfLandmarkLocalizer(LandmarkFilter):
    """EKF that linearizes each beacon anew at its own outcome (Bell and Cathey 1993).

    Pays where a measurement is much surer than the prior and the beacon is near: the first sighting after
    a vague start. Fails as the EKF does without beacons in sight, and gates on the first linearization.
    """

    NAME = "iekf-landmarks"

    def _kernels(self) -> tuple[Predict, Update]:
        return ekf.predict, iekf.update_range_bearings


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
