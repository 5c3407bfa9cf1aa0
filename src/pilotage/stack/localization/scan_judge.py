"""Whether scans speak for where a localizer by a map believes to be."""

from __future__ import annotations

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import FloatArray
from pilotage.stack.localization.likelihood_field import LikelihoodField
from pilotage.stack.localization.odometry_doubt import OdometryDoubt
from pilotage.stack.localization.relocalization import Relocalization
from pilotage.stack.localization.self_check import LEAST_SEEN, ExplainedShare, SelfCheck

POSE_DOF = 3.0
MOST_BESIDE = 0.25
"""A belief of which a larger share of beams end beside one is wrong."""
LEAST_AT_WALL, UNEXPLAINED_SCANS = 0.15, 10
"""A crowd may hide the walls for a while; more scans that show fewer of them speak against the belief."""
UNSURE_M = 0.1
"""A cloud wider than this (standard deviation) may settle at another place that looks alike."""


class ScanJudge:
    """Holds each scan against the belief before it, and beam by beam against the one after it.

    The step from the one mean to the other is at most as large as the first was uncertain. A beam that ends
    far from any wall may have hit what is on no map; many that end beside one, not at it, say that the pose
    is off, and so does a scan of which next to nothing is at a wall. Where the cloud was wide or the robot
    lost, it may have settled at a place that only looks alike: it is believed again when the scans fit as
    well as they used to; and so it is where more beams than usual end beside a wall.

    Attributes
    ----------
    check
        What it says of the filter.
    """

    def __init__(
        self, field: LikelihoodField, relocalization: Relocalization | None, doubt: OdometryDoubt
    ) -> None:
        self._field, self._relocalization, self._doubt = field, relocalization, doubt
        self.check = SelfCheck(refused_share=MOST_BESIDE)
        self._unexplained, self._found = 0, True
        self._explained, self._sharp = ExplainedShare(), ExplainedShare()

    def tell(
        self,
        t_s: float,
        prior: tuple[FloatArray, FloatArray],
        mean: FloatArray,
        points: FloatArray,
        beams: int,
    ) -> None:
        """One scan.

        Parameters
        ----------
        prior
            Mean (3,) and covariance (3, 3) of the belief before it.
        mean
            (3,) of the one after it.
        points
            (K, 2) where its beams ended, in the robot's frame; at least one.
        beams
            How many were looked at; what ended nowhere is none of the points.
        """
        densities = self._field.log_densities(points, mean)
        at_wall = int((densities >= self._field.least_at_wall).sum())
        beside = int((densities > self._field.least_beside).sum())
        step = mean - prior[0]
        step[2] = wrap_to_pi(float(step[2]))
        self.check.tell(t_s, beside, at_wall, float(step @ np.linalg.solve(prior[1], step)), POSE_DOF)
        if len(points) >= LEAST_SEEN:
            self._unexplained = self._unexplained + 1 if at_wall < LEAST_AT_WALL * len(points) else 0
        if self._unexplained >= UNEXPLAINED_SCANS:
            self.check.alarm(t_s)
        share, used_share = at_wall / len(points), len(points) / beams
        self._try(t_s, share, used_share)
        if self.check.lost(t_s) or prior[1][0, 0] + prior[1][1, 1] > UNSURE_M**2:
            self._found = False
        as_usual = self._explained.tell(share, self._found, used_share)
        if self._doubt.judge(t_s, as_usual):
            self.check.alarm(t_s)
        if as_usual:
            self._found = True
        elif not self._found:
            self.check.alarm(t_s)
        # Crowds do not change which share of what ends about a wall ends at it; a wrong pose does.
        if beside and not self._sharp.tell(at_wall / beside, self._found, beside / beams):
            self.check.alarm(t_s)

    def _try(self, t_s: float, share: float, used_share: float) -> None:
        """Begin anew where a place that was tried explains the scans; go on looking where it does not."""
        again = self._relocalization
        passed = None if again is None else again.passed(share, used_share, self._explained.usual)
        if passed and self.check.begin_anew(t_s):
            self._found = True
            self._explained.begin_anew()
            self._sharp.begin_anew()
        elif passed is False:
            self.check.alarm(t_s)
