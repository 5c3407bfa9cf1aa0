"""Lost: the whole map is searched for where the last scans fit, and a place found is tried first."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import FloatArray
from pilotage.sensors.readings import OdometryIncrement
from pilotage.stack.localization.likelihood_field import LikelihoodField
from pilotage.stack.localization.odometry_watch import TURN_AS_PATH_M
from pilotage.stack.localization.scan_search import (
    FEW_SCANS,
    LEAST_SCANS,
    MOST_SCANS,
    RecentScans,
    ScanSearch,
    carried,
)

PATIENCE_S = 2.0
"""A filter that doubts itself for a moment often comes round; lost for longer, it searches."""
AGAIN_SCANS = 3
"""After so many new scans it searches again."""
TRIAL_SCANS, TRIAL_M = 15, 1.5
"""A place counts after so many scans and so much path from which it went on to fit,"""
TRIAL_WEIGHT = 5.0
"""and readings of so many full scans: on open ground a few of each say next to nothing;"""
LONGEST_TRIAL_M = 5.0
"""Where the map says so little that a trial does not end, the search begins anew: after so much path and as
many scans as would have been enough, if they said something, or so much path without any."""
FITTING = 0.85
"""this share of what is usual; less, and it is given up."""
LEAST_USUAL = 0.6
"""What is usual at least: share of the beams on the map's walls."""
SAME_M, SAME_RAD = 0.3, 0.15
"""A place so near to where the cloud is needs no other cloud."""
STRAYS, TURNS_RAD_PER_M = 0.2, 0.1
"""Share of its path, turns included, that the odometry leads astray by, and how far it turns, at most."""
STDS = np.array([0.1, 0.1, 0.02])
"""Of the cloud that begins at a place found."""


@dataclass(slots=True)
class Trial:
    """A place that is being tried: scans, what they count in all (readings over those of full ones), what of
    that fits, the path since, and that since the last of them."""

    scans: int = 0
    weight: float = 0.0
    fitting: float = 0.0
    path_m: float = 0.0
    unseen_m: float = 0.0

    @property
    def says_nothing(self) -> bool:
        """Whether it will not end."""
        path_m = self.path_m if self.scans >= TRIAL_SCANS else self.unseen_m
        return path_m > LONGEST_TRIAL_M


class Relocalization:
    """Says where to begin anew while the filter is lost, and when to believe it again.

    Global localization as in Thrun et al. (2005, section 8.3) by an exact search instead of random particles:
    the last dozen scans, joined by the odometry, must fit in one place of the map and in no second one; then
    the filter follows that place, and is believed after 1.5 m of scans that fit as usual.

    Attributes
    ----------
    trial
        The place under trial, a new one or where the filter is anyway; None where there is none.
    elsewhere
        Whether the filter's place is none to be believed but after a trial: the last dozen scans fit clearly
        better in another one, be it several; or it has left where its last trusted one leads by the odometry.
    """

    def __init__(
        self, field: LikelihoodField, bounds_m: tuple[float, float, float, float], told: bool = True
    ) -> None:
        """Search a map; who was ``told`` no place at first has none to be trusted before a trial."""
        self._field, self._bounds_m = field, bounds_m
        self._search: ScanSearch | None = None  # its scores are made when they are needed first
        self._scans = RecentScans()
        self._since_s: float | None = None
        self._new = 0
        self.trial: Trial | None = None
        self._fit_elsewhere, self._has_left = False, not told
        self.elsewhere = self._has_left
        self._trusted: FloatArray | None = None
        self._path_m = 0.0

    def move(self, odometry: OdometryIncrement) -> None:
        """Carry everything along."""
        moved = odometry.distance_m, odometry.lateral_m, odometry.angle_rad
        self._scans.move(*moved)
        driven_m = math.hypot(odometry.distance_m, odometry.lateral_m)
        path_m = driven_m + TURN_AS_PATH_M * abs(odometry.angle_rad)
        if self._trusted is not None:
            self._trusted, self._path_m = carried(self._trusted, *moved), self._path_m + path_m
        if self.trial is not None:
            self.trial.path_m += path_m
            self.trial.unseen_m += path_m
            if self.trial.says_nothing:
                self.trial = None

    def see(self, points: FloatArray) -> None:
        """Keep a scan's end points (K, 2), in the robot's frame, where it was taken from elsewhere."""
        self._new += self._scans.see(points)

    def forget(self) -> None:
        """The odometry cannot be relied on: what was seen before joins nothing any more."""
        self._scans.forget()
        self._trusted = None

    def begin(self, t_s: float, lost: bool, mean: FloatArray) -> FloatArray | None:
        """A place (3,) to begin anew at; None where none is found, or a trial of the filter's own began."""
        if not lost:
            self._since_s = self.trial = None
            self._trust(mean)
            return None
        self._has_left |= self._leaves(mean)
        self.elsewhere = self._fit_elsewhere or self._has_left
        self._since_s = t_s if self._since_s is None else self._since_s
        waits = self.trial is not None or self._new < AGAIN_SCANS or len(self._scans) < LEAST_SCANS
        if waits or t_s - self._since_s < PATIENCE_S:
            return None
        self._new = 0
        if self._search is None:
            self._search = ScanSearch(self._field, self._bounds_m)
        cloud = self._scans.cloud(FEW_SCANS)
        place = self._search.best(cloud)
        self._fit_elsewhere = place is not None and not self._search.fits_as_well(mean, cloud, place)
        self.elsewhere |= self._fit_elsewhere
        other = LEAST_SCANS if place is None else MOST_SCANS
        if (place is None or not place.alone) and len(self._scans) > min(other, FEW_SCANS):
            place = self._search.best(self._scans.cloud(other))
        if place is None or not place.alone:
            return None
        self.trial, self._fit_elsewhere = Trial(), False
        off = place.pose - mean
        near = float(np.hypot(off[0], off[1])) < SAME_M and abs(wrap_to_pi(float(off[2]))) < SAME_RAD
        return None if near else place.pose

    def passed(self, at_wall_share: float, weight: float, usual: float) -> bool | None:
        """One scan of a trial, of readings over a full one's: whether the place has proved itself; None while
        that is open."""
        trial = self.trial
        if trial is None:
            return None
        trial.scans, trial.unseen_m = trial.scans + 1, 0.0
        trial.weight += weight
        trial.fitting += weight * at_wall_share
        enough = trial.scans >= TRIAL_SCANS and trial.weight >= TRIAL_WEIGHT and trial.path_m >= TRIAL_M
        if not enough:
            return None
        self.trial = None
        passed = trial.fitting / trial.weight >= FITTING * float(np.fmax(usual, LEAST_USUAL))
        if passed:
            self._trust(None)
        return passed

    def _trust(self, place: FloatArray | None) -> None:
        """From here on it is where this place (3,) leads; None: wherever it is."""
        self._trusted, self._path_m = place, 0.0
        self.elsewhere = self._fit_elsewhere = self._has_left = False

    def _leaves(self, mean: FloatArray) -> bool:
        """Whether a belief (3,) is not where the odometry leads from the last one that was trusted.

        A wide cloud settles where scans fit, and of two places that look alike it takes either.
        """
        if self._trusted is None:
            return False
        off = mean - self._trusted
        return (
            math.hypot(off[0], off[1]) > SAME_M + STRAYS * self._path_m
            or abs(wrap_to_pi(float(off[2]))) > SAME_RAD + TURNS_RAD_PER_M * self._path_m
        )
