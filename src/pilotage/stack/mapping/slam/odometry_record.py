"""What an odometry told beside where scans were found to lie: how far it is to be believed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pilotage.core.angles import wrap_array_to_pi
from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.slam.frames import between, composed
from pilotage.kernels.slam.placing import distance
from pilotage.kernels.slam.wheels import SCALE_STD, Wheels, righted, unknown_wheels
from pilotage.stack.mapping.slam.uncertainty import Edges, relative_poses

STRETCH_M, STRETCHES = 1.0, 200
"""An odometry is judged by the last so many stretches of so much path, a radian counting as half a metre:
over them errors of the alignments, which do not add up, are small."""
JUDGED_ANEW = 100
"""After so many scans it is judged anew."""
STANDING_VAR = np.array([0.002, 0.002, 0.001]) ** 2
DRIVEN = 0.5
"""Share of a stretch that is driven, not turned, from which on it tells of lengths: who turns on the spot is
off by next to nothing along its way, and would make all others look sure."""
EXPECTED_STD, EXPECTED = 0.05, 2.0
"""What it may be expected to be off by, a metre or half a radian, and how many stretches that counts as."""
HEADING_SHARE = 0.1
"""What of its turns' information counts: what is left of what it is always off by adds up over a long way,
and any wall tells a heading, where hardly one tells how far a robot came."""
LEAST_STRETCHES, CHANCE_STDS, SURE_STDS = 10, 2.0, 4.0
"""Stretches from which on, and standard deviations from which on more and more, it is taken to be always off
by something, not by chance: who rights what is right adds the error of what was learnt, and that adds up."""


@dataclass(frozen=True, slots=True)
class ToldByOdometry:
    """What an odometry tells of a track.

    Attributes
    ----------
    edges
        Between consecutive keyframes; they tell nothing where scans fitted nowhere that should have.
    alone
        (M,) where the track hangs by it already, and its own edge says the same.
    scale_std
        What all its lengths may be off by together, a share of them.
    """

    edges: Edges
    alone: BoolArray
    scale_std: float = 0.0


@dataclass(frozen=True, slots=True)
class _Judgement:
    """After so many scans: variances (3,) a metre of path, what is always off, and its lengths' std."""

    scans: int
    rates: FloatArray
    wheels: Wheels
    scale_std: float


class OdometryRecord:
    """An odometry's poses, and how unsure its motions are.

    Attributes
    ----------
    poses
        (3,) each, of the scanner at each scan by the odometry, in any frame.
    """

    def __init__(self) -> None:
        self.poses: list[FloatArray] = [np.zeros(3)]
        self._alone: set[int] = set()
        self._lost: set[int] = set()
        self._open: set[int] = set()
        self._judgement: _Judgement | None = None

    def add(self, step: FloatArray | None) -> None:
        """Take note of the motion (3,) to the next scan, if there is any."""
        here = self.poses[-1]
        self.poses.append(here if step is None else np.asarray(composed(here, step)))

    def lose(self, scan: int) -> None:
        """A scan fits nowhere though it should: of who is carried away an odometry says nothing."""
        self._lost.add(scan)

    def leave_open(self, scan: int) -> None:
        """A scan does not hold the robot along its way: where it is found it was guessed to be."""
        self._open.add(scan)

    def slip(self, scan: int, step: FloatArray, track: list[FloatArray]) -> FloatArray:
        """Covariance (3, 3), in the scanner's frame, of the motion (3,) to a scan that hangs by it.

        ``track``: (3,) each, poses of all scans before it.
        """
        self._alone.add(scan)
        return np.diag(self._judged(track).rates * distance(step, np.zeros(3)))

    def told(self, scans: IntArray, track: list[FloatArray]) -> ToldByOdometry:
        """Motions between scans (K,) of a track, as sure as they were right so far."""
        poses = np.array([self.poses[k] for k in scans])
        moved = relative_poses(poses[:-1], poses[1:])
        path_m = np.hypot(moved[:, 0], moved[:, 1]) + 0.5 * np.abs(moved[:, 2])
        judgement = self._judged(track)
        variances = (judgement.rates * path_m[:, None] + STANDING_VAR) / [1.0, 1.0, HEADING_SHARE]
        spans = [range(a + 1, b + 1) for a, b in pairwise(scans.tolist())]
        lost = np.array([not self._lost.isdisjoint(span) for span in spans], np.bool_)
        alone = np.array([not self._alone.isdisjoint(span) for span in spans], np.bool_)
        motions = np.array([righted(judgement.wheels, motion) for motion in moved]).reshape(-1, 3)
        information = np.where(lost[:, None, None], 0.0, np.eye(3) / variances[:, None])
        first = np.arange(len(motions))
        edges = Edges(first, first + 1, motions, information, np.zeros_like(lost))
        return ToldByOdometry(edges, alone, judgement.scale_std)

    def _judged(self, track: list[FloatArray]) -> _Judgement:
        """How far it is to be believed, judged anew now and then."""
        if self._judgement is None or len(track) - self._judgement.scans >= JUDGED_ANEW:
            self._judgement = self._judge(track)
        return self._judgement

    def _judge(self, track: list[FloatArray]) -> _Judgement:
        """By stretches that lead to scans which were found; along its way by those alone that held it there.

        What is expected is joined by its logarithm: variances may be a hundred times less, and a mean of
        both would still be what was expected after many stretches.
        """
        stretches = self._stretches(track)
        moved = np.array([one[0] for one in stretches]).reshape(-1, 3)
        off = np.array([one[1] for one in stretches]).reshape(-1, 3)
        root = np.sqrt([one[2] for one in stretches])
        drove = np.hypot(moved[:, 0], moved[:, 1]) > DRIVEN * root**2
        held = np.array([one[3] for one in stretches], np.bool_) & drove
        along = _always(moved[held, :1] / root[held, None], off[held, 0] / root[held])
        turned = _always(moved[:, [0, 2]] / root[:, None], off[:, 2] / root)
        wheels = unknown_wheels()._replace(off=np.concatenate([along, turned]))
        left = np.array([o + m - righted(wheels, m) for m, o in zip(moved, off, strict=True)]).reshape(-1, 3)
        squares = (left / root[:, None]) ** 2
        place = max(_joined(squares[held, axis], EXPECTED_STD**2) for axis in (0, 1))
        heading = _joined(squares[:, 2], 4.0 * EXPECTED_STD**2)
        scale_std = _left(moved[held, 0] / root[held], off[held, 0] / root[held], place, float(along[0]))
        return _Judgement(len(track), np.array([place, place, heading]), wheels, scale_std)

    def _stretches(self, track: list[FloatArray]) -> list[tuple[FloatArray, FloatArray, float, bool]]:
        """Of the last stretches: motion (3,) it told, what was found beside it, path, and whether held."""
        told, found = np.array(self.poses[: len(track)]), np.array(track)
        turns = np.abs(wrap_array_to_pi(np.diff(told[:, 2])))
        path_m = np.append(0.0, np.cumsum(np.hypot(*np.diff(told[:, :2], axis=0).T) + 0.5 * turns))
        count = min(int(path_m[-1] / STRETCH_M), STRETCHES)
        cuts = np.searchsorted(path_m, path_m[-1] - STRETCH_M * np.arange(count, -1.0, -1.0))
        out = []
        for a, b in pairwise(np.minimum(cuts, len(track) - 1).tolist()):
            scans = range(a, b + 1)
            if path_m[b] > path_m[a] and self._alone.isdisjoint(scans) and self._lost.isdisjoint(scans):
                moved, seen = between(told[a], told[b]), between(found[a], found[b])
                off = np.append(seen[:2] - moved[:2], between(moved, seen)[2])
                out.append((moved, off, float(path_m[b] - path_m[a]), self._open.isdisjoint(scans)))
        return out


def _always(told: FloatArray, off: FloatArray) -> FloatArray:
    """Shares (P,) of what was told (S, P) that it is always off by, zero where they may be chance."""
    count, number = told.shape
    normal = told.T @ told
    if count < LEAST_STRETCHES or np.linalg.matrix_rank(normal) < number:
        return np.zeros(number)
    shares = np.linalg.solve(normal, told.T @ off)
    variance = ((off - told @ shares) ** 2).sum() / (count - number)
    stds = np.abs(shares) / np.sqrt(np.maximum(variance * np.diag(np.linalg.inv(normal)), 1e-18))
    return np.asarray(shares * np.clip((stds - CHANCE_STDS) / (SURE_STDS - CHANCE_STDS), 0.0, 1.0))


def _left(told: FloatArray, off: FloatArray, variance: float, taken: float) -> float:
    """Standard deviation of what lengths told (S,) may still be off by, once a share of them is ``taken``.

    Wheels may be off by SCALE_STD until stretches say more; that what they say was not taken may be wrong.
    """
    information = float(told @ told) / variance + SCALE_STD**-2
    share = float(told @ off) / variance / information
    return math.sqrt((share - taken) ** 2 + 1.0 / information)


def _joined(squares: FloatArray, expected: float) -> float:
    """Variance of what was measured (S,) and of what is expected."""
    if not squares.size:
        return expected
    share = EXPECTED / (EXPECTED + squares.size)
    return float(expected**share * max(float(squares.mean()), 1e-6) ** (1.0 - share))
