"""Filters on one's own arrays: no mission, no robot, no files.

Every filter is a value: ``predict`` and ``update`` give a new one and leave the old one as it was, so that
the steps of a lecture or of a log chain as they are written on the board.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from pilotage.core import given
from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.config import SMALLEST
from pilotage.core.errors import InputError
from pilotage.core.types import BoolArray, FloatArray, Pose2
from pilotage.kernels.filters import ekf, iekf, sighting, ukf
from pilotage.maps.landmarks import Landmarks
from pilotage.models.odometry import increment_variances
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig

__all__ = ["EkfLandmarks", "IekfLandmarks", "UkfLandmarks"]

F = TypeVar("F", bound="_LandmarkFilter")
_ODOMETRY, _BEACONS = WheelOdometryConfig(), BeaconConfig()
_NOTHING: FloatArray = np.zeros(0)


@dataclass(frozen=True, slots=True, eq=False)
class _LandmarkFilter:
    """Known landmarks, ranges and bearings, a planar pose.

    Parameters
    ----------
    landmarks
        (M, 2) x, y in metres; their ids are 0 to M - 1. Or (M, 3) id, x, y.
    pose
        (3,) x, y, theta of the start, or a ``Pose2``.
    cov
        (3, 3) its covariance in m^2, m rad, rad^2.
    range_var_m2, bearing_var_rad2
        Of a measurement.
    distance_var_m2_per_m, angle_var_rad2_per_rad, angle_var_rad2_per_m
        Of an odometry increment: a random walk, whose variance grows with the way and with the turn.
    gate
        The share of true measurements that is let through (chi-square, two degrees of freedom); 1: all.
    mount
        (3,) pose of the sensor in the base frame.

    Attributes
    ----------
    nis
        (K,) normalized innovation squared of the last update's measurements; nan for unknown landmarks.
    accepted
        (K,) which of them the gate let through.
    """

    landmarks: ArrayLike
    pose: ArrayLike | Pose2 = (0.0, 0.0, 0.0)
    cov: ArrayLike = ((0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.01))
    range_var_m2: float = _BEACONS.range_var_m2
    bearing_var_rad2: float = _BEACONS.bearing_var_rad2
    distance_var_m2_per_m: float = _ODOMETRY.distance_var_m2_per_m
    angle_var_rad2_per_rad: float = _ODOMETRY.angle_var_rad2_per_rad
    angle_var_rad2_per_m: float = _ODOMETRY.angle_var_rad2_per_m
    gate: float = 0.999
    mount: ArrayLike = (0.0, 0.0, 0.0)
    nis: FloatArray = field(default_factory=lambda: _NOTHING, kw_only=True)
    accepted: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=np.bool_), kw_only=True)

    _predict: ClassVar[Callable[..., Any]]
    _update: ClassVar[Callable[..., Any]]

    def __post_init__(self) -> None:
        pose = given.array("pose", self.pose.as_array() if isinstance(self.pose, Pose2) else self.pose, 3)
        cov = given.array("cov", self.cov, 3, 3)
        if not np.allclose(cov, cov.T, rtol=1e-9, atol=1e-15) or np.linalg.eigvalsh(cov)[0] < -1e-12:
            raise InputError("cov: expected a symmetric positive matrix (3, 3), found one that is not")
        for name in ("range_var_m2", "bearing_var_rad2"):
            object.__setattr__(self, name, given.number(name, getattr(self, name), SMALLEST))
        for name in ("distance_var_m2_per_m", "angle_var_rad2_per_rad", "angle_var_rad2_per_m"):
            object.__setattr__(self, name, given.number(name, getattr(self, name), 0.0))
        object.__setattr__(self, "gate", given.number("gate", self.gate, high=1.0, above=0.0))
        object.__setattr__(self, "landmarks", _landmarks(self.landmarks))
        object.__setattr__(self, "pose", _frozen(pose))
        object.__setattr__(self, "cov", _frozen(cov))
        object.__setattr__(self, "mount", _frozen(given.array("mount", self.mount, 3)))

    @property
    def mean(self) -> Pose2:
        """The pose believed in."""
        return Pose2.from_array(np.asarray(self.pose))

    @property
    def std(self) -> FloatArray:
        """(3,) standard deviations of x, y, theta."""
        variances: FloatArray = np.diagonal(np.asarray(self.cov, dtype=np.float64))
        return np.asarray(np.sqrt(variances))

    def predict(self: F, distance_m: float, angle_rad: float) -> F:
        """The filter after an odometry increment along an arc (Thrun et al. 2005, table 7.2).

        Raises
        ------
        InputError
            Where a number is not finite.
        """
        distance = given.number("predict: distance_m", distance_m)
        angle = given.number("predict: angle_rad", angle_rad)
        variances = increment_variances(
            distance,
            angle,
            self.distance_var_m2_per_m,
            0.0,
            self.angle_var_rad2_per_rad,
            self.angle_var_rad2_per_m,
        )
        pose, cov = np.array(self.pose), np.array(self.cov)
        type(self)._predict(pose, cov, distance, angle, np.diag(variances), True)
        return replace(self, pose=pose, cov=cov, nis=_NOTHING, accepted=np.zeros(0, dtype=np.bool_))

    def update(self: F, ids: ArrayLike, ranges_m: ArrayLike, bearings_rad: ArrayLike) -> F:
        """The filter after landmarks that were seen at once; those outside the gate change nothing.

        Parameters
        ----------
        ids
            (K,) which landmarks.
        ranges_m, bearings_rad
            (K,) as the sensor saw them, bearings counter-clockwise from its own x axis.

        Raises
        ------
        InputError
            Where the three differ in length, an id is no whole number, or a range or bearing none at all.
        """
        numbers = given.indices("ids", _several(ids), None)
        ranges = given.array("ranges_m", _several(ranges_m), len(numbers))
        if (ranges < 0.0).any():
            raise InputError(f"ranges_m: expected ranges of 0 or more, found {ranges.min():g}")
        bearings = given.array("bearings_rad", _several(bearings_rad), len(numbers))
        known = self.landmarks
        assert isinstance(known, Landmarks), "settled at construction"
        pose, cov = np.array(self.pose), np.array(self.cov)
        _, nis, outcome = type(self)._update(
            pose,
            cov,
            sighting.Seen(numbers, ranges, bearings),
            known.by_id(),
            np.array(self.mount),
            np.diag([self.range_var_m2, self.bearing_var_rad2]),
            math.inf if self.gate == 1.0 else chi_square_quantile(self.gate, 2),
        )
        return replace(self, pose=pose, cov=cov, nis=nis, accepted=outcome == sighting.OUTCOME_ACCEPTED)


@dataclass(frozen=True, slots=True, eq=False)
class EkfLandmarks(_LandmarkFilter):
    """The extended Kalman filter with known landmarks (Thrun et al. 2005, table 7.2; Joseph form).

    Examples
    --------
    >>> import numpy as np, pilotage as pl
    >>> filter = pl.filters.EkfLandmarks(landmarks=[[4.0, 0.0], [0.0, 3.0]], pose=(0.0, 0.0, 0.0))
    >>> after = filter.predict(0.5, 0.0).update([0, 1], [3.49, 3.04], [0.0, 1.737])
    >>> bool(np.all(after.std < filter.std)), 0.45 < after.mean.x_m < 0.55
    (True, True)
    """

    _predict: ClassVar[Callable[..., Any]] = ekf.predict
    _update: ClassVar[Callable[..., Any]] = ekf.update_range_bearings


@dataclass(frozen=True, slots=True, eq=False)
class IekfLandmarks(_LandmarkFilter):
    """The iterated EKF: every landmark linearized anew at its own outcome (Bell and Cathey 1993)."""

    _predict: ClassVar[Callable[..., Any]] = ekf.predict
    _update: ClassVar[Callable[..., Any]] = iekf.update_range_bearings


@dataclass(frozen=True, slots=True, eq=False)
class UkfLandmarks(_LandmarkFilter):
    """The unscented Kalman filter with known landmarks (Julier and Uhlmann 2004)."""

    _predict: ClassVar[Callable[..., Any]] = ukf.predict
    _update: ClassVar[Callable[..., Any]] = ukf.update_range_bearings


def _landmarks(known: Any) -> Landmarks:
    if isinstance(known, Landmarks):
        return known
    table = given.array("landmarks", known, None, None)
    if table.shape[0] == 0 or table.shape[1] not in (2, 3):
        raise InputError(f"landmarks: expected (M, 2) x, y or (M, 3) id, x, y, found {table.shape}")
    if table.shape[1] == 2:
        return Landmarks(np.arange(len(table)), table)
    return Landmarks(given.indices("landmarks: ids", table[:, 0], None), table[:, 1:])


def _several(values: ArrayLike) -> ArrayLike:
    """One number stands for a list of it."""
    alone = np.isscalar(values) or (isinstance(values, np.ndarray) and values.ndim == 0)
    return np.array([values]) if alone else values


def _frozen(values: FloatArray) -> FloatArray:
    values.flags.writeable = False
    return values
