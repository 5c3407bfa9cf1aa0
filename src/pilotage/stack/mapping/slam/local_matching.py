"""Every scan aligned with the keyframes just before it.

A guess of the motion starts the alignment; where none leads to a fit
as good as usual, the neighbourhood is searched by branch and bound.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.slam.align import TOO_FEW, align
from pilotage.kernels.slam.branch_bound import NO_SEED
from pilotage.kernels.slam.buckets import fused, sort_into_buckets
from pilotage.kernels.slam.frames import between, carried, composed
from pilotage.kernels.slam.placing import (
    ITERATIONS,
    LONG_M,
    REACH_M,
    SCALE_M,
    distance,
    placed,
    plausibility,
)
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.fit import Fit
from pilotage.stack.mapping.slam.odometry import NO_OTHERS, MotionGuess
from pilotage.stack.mapping.slam.surroundings import Surroundings, every_second, in_range

BUCKET_M = 0.1
LOCAL_BUCKET_M, FUSED_M, FUSED_COSINE = 0.2, 0.1, 0.9
"""What the last keyframes saw of a square in directions alike is one point: fewer to look through, and each
the mean of several scans. Not without odometry, where single points are all that tells how far one came."""
MOST_POINTS = 240
"""Of a scan of more points every second, third, ... is aligned: beams nearer together than their lines are
long tell little of their own."""
PRIOR = np.diag([2.0, 2.0, 20.0])
"""Holds the pose at the guess where the scan leaves it open, in squared residuals. More would pull every
scan a little towards an odometry whose errors all have one sign."""
POOR, NONE = 0.75, 0.3
"""Fit over its running mean below which there is a search, and below which it is no fit at all: what hangs by
so few points hangs by chance."""
SEARCH_STEP_RAD = 0.02
FAR, LEAST_FAR = 0.6, 0.12
"""Share of the usual fit that a place far from all guesses takes, and what its distance must leave of it."""
LEAST_FOUND, FOUND, ALIKE = 40, 0.8, 0.8
"""Points and share of the usual fit that finding a place all round takes, and the share of its score from
which a second place speaks against it,"""
OTHER_PLACE = np.array([0.5, 0.35, 0.0, 0.0])
"""where it is so far away and turned."""
MOST_GAP_S = 2.5
"""The search window grows with the time since the last fit, up to this."""
LEAST_SEARCHED, LEAST_SCORE, LEAST_SCORE_ROUND = 10, 0.2, 0.3
"""Points of a scan that is searched for, and mean score a point of what is found near, or all round."""
NEAR_M, NEAR_RAD = 0.5, 0.6
"""The search window beside an odometry's motion that is longer than LONG_M."""
BETTER_POOR, BETTER_GOOD = 1.1, 1.03
"""By how much a place that was searched must fit better than the guesses."""

_STANDING = np.zeros(3)

Reference = tuple[FloatArray, IntArray, FloatArray]
"""Points in buckets, as ``align`` takes them."""


@dataclass(frozen=True, slots=True)
class Aside:
    """Keyframes that the track tore from: what they saw around the last place, and their points."""

    around: Surroundings
    reference: Reference | None


class LocalMatcher:
    """Aligns scans with the last keyframes, one after the other.

    Attributes
    ----------
    searched, lost
        How many scans needed a search, and how many fitted nowhere.
    rms_m
        Running mean of the residuals.
    """

    def __init__(self, config: SlamConfig) -> None:
        self._config = config
        self._guess = MotionGuess()
        self._local: list[FloatArray] = []
        self._usual = 0.6
        self._reference: Reference | None = None
        self._around: Surroundings | None = None
        self._lost_s, self._led = 0.0, False
        self.searched = 0
        self.lost = 0
        self.rms_m = SCALE_M

    @property
    def guess_error(self) -> float:
        """Usual error of the most trusted guess of the motion."""
        return self._guess.least_error

    @staticmethod
    def thinned(cloud: FloatArray) -> FloatArray:
        """Return as many points of a scan (K, 6) as are worth while, evenly spread."""
        every = -(-cloud.shape[0] // MOST_POINTS)
        return cloud if every <= 1 else np.ascontiguousarray(cloud[::every])

    def add_keyframe(self, cloud: FloatArray, pose: FloatArray) -> None:
        """Let a scan lend its points to those that follow."""
        self._local = [*self._local, carried(cloud, pose)][-self._config.local_keyframes :]
        self._refer()

    def _refer(self) -> None:
        side_m = LOCAL_BUCKET_M if self._led else BUCKET_M
        box, starts, _, points = sort_into_buckets(np.concatenate(self._local), side_m)
        if self._led:
            starts, points = fused(box, starts, points, FUSED_M, FUSED_COSINE)
        self._reference = box, starts, points
        self._around = None

    def set_aside(self) -> Aside | None:
        """Begin anew without keyframes; what they were is handed out, to be found again."""
        seen = bool(self._local) and len(self._local[-1]) > 0
        around = Surroundings.of(self._local, self._local[-1][0, :2]) if seen else None
        out = None if around is None else Aside(around, self._reference)
        self._local, self._reference, self._around = [], None, None
        self._guess.velocity = np.zeros(3)
        return out

    def find(self, aside: Aside, cloud: FloatArray, centre: FloatArray, half_m: float) -> Fit | None:
        """Look for a scan all round in what was set aside; None where it fits nowhere, or in two places."""
        near = in_range(cloud)
        if near.shape[0] < LEAST_FOUND:
            return None
        points, turns = every_second(near), np.arange(-np.pi, np.pi, SEARCH_STEP_RAD)
        best = aside.around.best(points, centre, half_m, turns, LEAST_SCORE_ROUND)
        if best is None:
            return None
        other = np.concatenate([best[:3], OTHER_PLACE])
        if aside.around.best(points, centre, half_m, turns, ALIKE * float(best[3]), other) is not None:
            return None
        fit = self._align(cloud, best[:3].copy(), 0.3, aside.reference)
        return fit if fit is not None and fit.value >= FOUND * self._usual else None

    def carry(self, moved: FloatArray) -> None:
        """Move the keyframes by a motion (3,) of the map."""
        self._local = [carried(cloud, moved) for cloud in self._local]
        self._around = None
        self._refer()

    def guesses(self, step: FloatArray | None, dt_s: float) -> tuple[FloatArray, int]:
        """Motions (G, 3) that a scan may have made, the most trusted first, and how many are credible."""
        return self._guess.guesses(step, dt_s)

    def match(
        self,
        cloud: FloatArray,
        last: FloatArray,
        step: FloatArray | None,
        guesses: tuple[FloatArray, int],
        dt_s: float,
        gap_s: float,
        others: FloatArray = NO_OTHERS,
    ) -> Fit | None:
        """Align a scan; None where it cannot be.

        Parameters
        ----------
        last
            (3,) pose of the scan before.
        step
            (3,) motion since by the odometry, if there is any.
        guesses
            What ``guesses`` makes of it.
        dt_s, gap_s
            Smoothed and stamped time since.
        others
            (M, 3) what else the odometry may have meant: tried where the first fits less than well.
        """
        self._led = step is not None
        motions, count = guesses
        led = self._led and self._guess.odometry_leads
        best, split = self._placed(cloud, last, motions, count, led, others)
        credible = motions[:count] if len(others) == 0 else np.concatenate([motions[:count], others])
        if led and distance(motions[0], _STANDING) > LONG_M:
            best = self._near(cloud, last, motions[0], credible, best)
        poor = best is None or best.value < POOR * self._usual
        if poor or step is None:
            # Without odometry a scan may slide along a corridor and still fit: look around every time.
            self.searched += 1
            gap_s = min(max(dt_s, gap_s, 0.2) + self._lost_s, MOST_GAP_S)
            centres = [last, composed(last, motions[0])] if poor and split else [last]
            for centre in centres:
                better = BETTER_POOR if poor else BETTER_GOOD
                guess = composed(last, motions[0]) if poor else None
                for fit in self._search(cloud, centre, *_window(gap_s), guess, best):
                    found = self._plausible(fit, last, credible)
                    if best is None or found.value > better * best.value + 0.01:
                        best = found
        if best is None or best.value < NONE * self._usual:
            best = self._far(cloud, last, motions[0], None if step is None else credible)
        if best is None:
            self.lost += 1
            self._lost_s += dt_s
            return None
        self._lost_s = 0.0
        self.rms_m += 0.05 * (best.rms_m - self.rms_m)
        self._usual += 0.02 * (best.value - self._usual)
        self._guess.learn(step, between(last, best.pose), dt_s)
        return best

    def _placed(
        self,
        cloud: FloatArray,
        last: FloatArray,
        motions: FloatArray,
        count: int,
        led: bool,
        others: FloatArray,
    ) -> tuple[Fit | None, bool]:
        """Align from the guesses alone; and whether these are far apart."""
        reference = self._reference
        if reference is None or cloud.shape[0] == 0:
            return None, False
        pose, hessian, start, told, split = placed(
            cloud,
            last,
            motions,
            count,
            led,
            others,
            self._guess.least_error,
            self._usual,
            PRIOR,
            *reference,
        )
        value, off, rms_m, weight = told.tolist()
        if value < 0.0:
            return None, split
        return Fit(value, pose, hessian, start, rms_m, off, weight, self._guess.least_error, led), split

    def _plausible(self, fit: Fit, last: FloatArray, guesses: FloatArray) -> Fit:
        """Lower a fit's value by how far it is from all credible guesses, in units of their usual error."""
        share, off = plausibility(
            between(last, fit.pose),
            guesses,
            self._guess.least_error,
            self._led and self._guess.odometry_leads,
        )
        return replace(fit, value=share * fit.value, off=off)

    def _align(
        self, cloud: FloatArray, start: FloatArray, reach_m: float, reference: Reference | None = None
    ) -> Fit | None:
        reference = reference or self._reference
        if reference is None or cloud.shape[0] == 0:
            return None
        pose, hessian, fit, status = align(
            cloud, start, PRIOR, reach_m, REACH_M, SCALE_M, ITERATIONS, *reference
        )
        if status == TOO_FEW:
            return None
        pose[2] = (pose[2] + np.pi) % (2.0 * np.pi) - np.pi
        return Fit(
            float(fit[1]) / cloud.shape[0],
            pose,
            hessian,
            start,
            float(fit[0]),
            0.0,
            float(fit[1]),
            self._guess.least_error,
            self._led and self._guess.odometry_leads,
        )

    def _far(
        self, cloud: FloatArray, last: FloatArray, motion: FloatArray, credible: FloatArray | None
    ) -> Fit | None:
        """Search as far as any gap would have it: the stamps of scans may lie about how long it was.

        ``credible`` are the guesses that speak against what is far from them; None where no odometry does.
        """
        fits = self._search(cloud, last, *_window(MOST_GAP_S), composed(last, motion))
        fits = [fit for fit in fits if fit.value >= FAR * self._usual]
        if credible is None:
            return min(fits, key=lambda fit: distance(between(last, fit.pose), motion), default=None)
        found = [self._plausible(fit, last, credible) for fit in fits]
        near = [fit for fit in found if fit.value >= LEAST_FAR * self._usual]
        return max(near, key=lambda fit: fit.value, default=None)

    def _near(
        self, cloud: FloatArray, last: FloatArray, motion: FloatArray, credible: FloatArray, best: Fit | None
    ) -> Fit | None:
        """Search beside where a long motion of the odometry leads, turns above all; return what fits better.

        From a guess that is turned by a tenth of a radian an alignment may end in a wrong fit that is not
        poor, and in a search all round the next corner of a room fits as well as the right one.
        """
        self.searched += 1
        for fit in self._search(cloud, composed(last, motion), NEAR_M, NEAR_RAD, None, best):
            found = self._plausible(fit, last, credible)
            if best is None or found.value > BETTER_GOOD * best.value + 0.01:
                best = found
        return best

    def _search(
        self,
        cloud: FloatArray,
        centre: FloatArray,
        half_m: float,
        half_rad: float,
        guess: FloatArray | None,
        found: Fit | None = None,
    ) -> list[Fit]:
        """Search the neighbourhood of a pose; ``found``: the best so far.

        With a guess the heading found is tried at its position too: along a corridor the best score may lie
        anywhere, but no turn does.
        """
        near = in_range(cloud)
        if self._around is None:
            self._around = Surroundings.of(self._local, centre)
        if self._around is None or near.shape[0] < LEAST_SEARCHED:
            return []
        steps = round(half_rad / SEARCH_STEP_RAD)
        turns = SEARCH_STEP_RAD * np.arange(-steps, steps + 1, dtype=np.float64)
        seed = NO_SEED if found is None else found.pose
        best = self._around.best(every_second(near), centre, half_m, turns, LEAST_SCORE, seed=seed)
        if best is None:
            return []
        starts = [best[:3].copy()]
        if guess is not None:
            starts.append(np.array([guess[0], guess[1], best[2]]))
        fits = [self._align(cloud, start, 0.3) for start in starts]
        return [fit for fit in fits if fit is not None]


def _window(gap_s: float) -> tuple[float, float]:
    """Half a search window's side and turns, the wider the longer ago a place was."""
    return 0.3 + 0.6 * gap_s, 0.3 + 0.8 * gap_s
