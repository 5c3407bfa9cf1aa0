"""Every scan aligned with the keyframes just before it.

A guess of the motion starts the alignment; where none leads to a fit
as good as usual, the neighbourhood is searched by branch and bound.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.align import TOO_FEW
from pilotage.kernels.slam.branch_bound import NO_SEED
from pilotage.kernels.slam.following import keep, look, settle, thinned
from pilotage.kernels.slam.frames import between, carried, composed
from pilotage.kernels.slam.local_map import (
    NOTHING_KNOWN,
    SCALE_M,
    LocalMap,
    add_to_map,
    align_in_map,
    empty_map,
)
from pilotage.kernels.slam.movers import empty_views, looked_through
from pilotage.kernels.slam.placing import (
    LONG_M,
    POOR,
    POOR_AS_GUESSED,
    distance,
    plausibility,
)
from pilotage.kernels.slam.track import Look, Track, Tracked, empty_keyframes, has_room
from pilotage.kernels.slam.wheels import unknown_wheels
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.fit import Fit
from pilotage.stack.mapping.slam.surroundings import KEYFRAMES, Surroundings, every_second, in_range

BUCKET_M = 0.1
FETCHED = 64
"""After so many keyframes at most compiled code is left."""
LEAST_ROOM = 4096
"""Points that the map of the last keyframes has room for at least."""
NONE = 0.3
"""Fit over its running mean below which it is no fit at all: what hangs by so few points hangs by chance."""
GONE, CHANGED, LEAST_ASKED = 0.1, 0.2, 40
"""Share of what was last seen that a scan sees through (of so many points at least), and the same together
with the share of the scan that came all at once, from which on a poor fit is none (decision 0372)."""
SEARCH_STEP_RAD = 0.02
FAR, LEAST_FAR = 0.65, 0.12
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


@dataclass(frozen=True, slots=True)
class Aside:
    """Keyframes that the track tore from: what they saw around the last place, and the map of them."""

    around: Surroundings
    map_: LocalMap


class LocalMatcher:
    """Aligns scans with the last keyframes, one after the other.

    Attributes
    ----------
    track, found
        Where it has come to, and what the guesses alone made of the last scan.
    map_, views
        What the keyframes saw, as points and as beams.
    keyframes
        Those that were not fetched yet.
    searched, lost
        How many scans needed a search, and how many fitted nowhere.
    """

    def __init__(self, config: SlamConfig) -> None:
        self._config = config
        self.track = Track(
            np.zeros(3),
            np.zeros(3),
            np.array([0.0, 0.001, 0.002]),
            np.zeros(3),
            np.array([0.6, SCALE_M]),
            np.zeros((3, 3)),
            np.zeros((3, 3)),
            np.zeros(1, np.int64),
            np.zeros(2),
            np.zeros(1, np.int64),
            np.full(2, np.nan),
            np.ones(1),
            unknown_wheels(),
        )
        self.found = Look(
            np.zeros((3, 3)), np.zeros(3, np.int64), np.zeros(3), np.zeros((3, 3)), np.zeros(3), np.zeros(4)
        )
        self.map_, self.views = empty_map(LEAST_ROOM), empty_views(0)
        self.keyframes = empty_keyframes(FETCHED, 0)
        self._local: list[tuple[FloatArray, FloatArray]] = []
        self._around: Surroundings | None = None
        self._lost_s, self._led = 0.0, False
        self.searched = 0
        self.lost = 0

    @property
    def tracked(self) -> Tracked:
        """Where it has come to, as kernels take it."""
        return Tracked(self.track, self.map_, self.views, self.found)

    def look(
        self, cloud: FloatArray, step: FloatArray | None, others: FloatArray, dt_s: float
    ) -> tuple[FloatArray, FloatArray, bool]:
        """Place a scan by guesses alone, into ``found``.

        Returns
        -------
        As the kernel.
        """
        led = step is not None
        step = _STANDING if step is None else step
        return look(cloud, step, led, others, dt_s, self.tracked)

    def found_again(self) -> None:
        """Scans fitted: nothing is lost any more."""
        self._lost_s = 0.0

    def found_fit(self) -> Fit | None:
        """Where the guesses alone had the last scan, if it fitted anywhere."""
        value, _, rms_m, weight = self.found.told.tolist()
        if value < 0.0:
            return None
        pose, hessian, start = self.found.pose, self.found.hessian, self.found.start
        return Fit(value, pose.copy(), hessian.copy(), start.copy(), rms_m, weight)

    def settle(self, fit: Fit, step: FloatArray | None, dt_s: float) -> None:
        """Go on to where a scan was found to lie."""
        self._lost_s = 0.0
        told = np.array([fit.value, 0.0, fit.rms_m, fit.weight])
        led, step = step is not None, _STANDING if step is None else step
        settle(fit.pose, fit.hessian, fit.start, told, step, led, dt_s, self.track)

    def keep(self, scan: int, cloud: FloatArray, kept: FloatArray, hessian: FloatArray, led: bool) -> None:
        """Make the last scan a keyframe; as the kernel."""
        local = self._config.local_keyframes
        keep(scan, cloud, kept, hessian, led, local, self.tracked, self.keyframes)

    def remember(self, kept: FloatArray, pose: FloatArray) -> None:
        """Take note of a keyframe that was fetched from ``keyframes``, unless it has no point."""
        if len(kept) == 0:
            return
        self._local = [*self._local, (kept, pose)][-self._config.local_keyframes :]
        self._around = None

    def make_room(self, beams: int, led: bool) -> None:
        """Let a scan of so many points be placed; all keyframes were fetched."""
        self._led = led
        if has_room(beams, self.map_, self.views, self.keyframes):
            return
        if len(self.keyframes.points) < beams:
            self.keyframes = empty_keyframes(FETCHED, beams)
        if self.map_.counts[0] + beams > len(self.map_.points):
            self._map_anew(beams)
        width = self.views.polar.shape[1]
        if width <= beams:
            polar = empty_views(2 * beams).polar
            polar[:, :width] = self.views.polar
            self.views = self.views._replace(polar=polar)

    def _map_anew(self, beams: int = 0) -> None:
        """Make the map of the last keyframes alone, with room for as many again and a scan."""
        points = sum(len(cloud) for cloud, _ in self._local)
        self.map_ = empty_map(2 * points + beams + LEAST_ROOM)
        for cloud, pose in self._local:
            add_to_map(self.map_, thinned(cloud), pose, self._config.local_keyframes, self._led)

    def known(self) -> list[tuple[FloatArray, FloatArray]]:
        """Points (K, 6) of the last keyframes in their frames, thinned, and their poses."""
        return [(thinned(cloud), pose) for cloud, pose in self._local]

    def _clouds(self) -> list[FloatArray]:
        """Points (K, 6) of the keyframes in the frame of the track, as many as are searched."""
        return [carried(thinned(cloud), pose) for cloud, pose in self._local[-KEYFRAMES:]]

    def set_aside(self) -> Aside | None:
        """Begin anew without keyframes; what they were is handed out, to be found again."""
        seen = bool(self._local) and len(self._local[-1][0]) > 0
        clouds = self._clouds() if seen else []
        around = Surroundings.of(clouds, clouds[-1][0, :2]) if seen else None
        out = None if around is None else Aside(around, self.map_)
        self._local, self.map_, self._around = [], empty_map(LEAST_ROOM), None
        self.track.velocity[:] = 0.0
        self.views.added[0] = 0
        return out

    def find(
        self, aside: Aside, cloud: FloatArray, centre: FloatArray, half_m: float, turn_rad: float
    ) -> Fit | None:
        """Look for a scan in what was set aside, so far from a pose and turned by so much at most; None where
        it fits nowhere, or in two places."""
        near = in_range(cloud)
        if near.shape[0] < LEAST_FOUND:
            return None
        points, turns = every_second(near), np.arange(-turn_rad, turn_rad, SEARCH_STEP_RAD)
        best = aside.around.best(points, centre, half_m, turns, LEAST_SCORE_ROUND)
        if best is None:
            return None
        other = np.concatenate([best[:3], OTHER_PLACE])
        if aside.around.best(points, centre, half_m, turns, ALIKE * float(best[3]), other) is not None:
            return None
        fit = self._align(cloud, best[:3].copy(), 0.3, aside.map_)
        return fit if fit is not None and fit.value >= FOUND * self.track.usual[0] else None

    def carry(self, moved: FloatArray) -> None:
        """Move the keyframes by a motion (3,) of the map."""
        self._local = [(cloud, composed(moved, pose)) for cloud, pose in self._local]
        self._around = None
        self._map_anew()
        for pose in (self.track.pose, self.track.keyframe, *self.views.poses):
            pose[:] = composed(moved, pose)

    def search(
        self, cloud: FloatArray, step: FloatArray | None, others: FloatArray, dt_s: float, gap_s: float
    ) -> Fit | None:
        """Look farther than ``found`` for where a scan lies; None where it fits nowhere.

        Parameters
        ----------
        step, others
            (3,) motion since the last scan by the odometry, if there is any, and what else (M, 3) it may be.
        dt_s, gap_s
            Smoothed and stamped time since.
        """
        last, usual, found = self.track.pose.copy(), float(self.track.usual[0]), self.found
        count, sure, split = found.counts.tolist()
        motions = found.motions[:count]
        led = self._odometry_leads(step)
        best = self.found_fit()
        credible = np.concatenate([motions[:sure], others])
        if led and distance(motions[0], _STANDING) > LONG_M:
            best = self._near(cloud, last, motions[0], credible, best)
        poor = best is None or best.value < POOR * usual
        if poor or step is None:
            self.searched += 1
            gap_s = min(max(dt_s, gap_s, 0.2) + self._lost_s, MOST_GAP_S)
            centres = [last, composed(last, motions[0])] if poor and split else [last]
            for centre in centres:
                better = BETTER_POOR if poor else BETTER_GOOD
                guess = composed(last, motions[0]) if poor else None
                for fit in self._search(cloud, centre, *_window(gap_s), guess, best):
                    judged = self._plausible(fit, last, credible, led)
                    if best is None or judged.value > better * best.value + 0.01:
                        best = judged
        if best is None or best.value < NONE * usual:
            best = self._far(cloud, last, motions[0], None if step is None else credible, led)
        # Without odometry a scan that fits nowhere breaks the track at once: worse than a poor fit.
        if best is None or (step is not None and self._is_contradicted(best, cloud)):
            best = None
            self.lost += 1
            self._lost_s += dt_s
        return best

    def _is_contradicted(self, fit: Fit, cloud: FloatArray) -> bool:
        """Whether the world looks so different from where a scan fits poorly that it lies elsewhere."""
        if fit.value >= POOR_AS_GUESSED * self.track.usual[0] or self.track.fitted[0] < POOR:
            return False
        before, now = self.track.moving.tolist()
        came = now - before if now > before else 0.0  # also where either was not asked
        known, at = self._local[-1] if self._local else (cloud[:0], fit.pose)
        through, asked = looked_through(cloud, fit.pose, known, np.asarray(at))
        gone = through / max(asked, LEAST_ASKED)
        return gone > GONE or came + gone > CHANGED

    def _odometry_leads(self, step: FloatArray | None) -> bool:
        errors = self.track.errors
        return step is not None and bool(errors[0] == errors.min())

    def _plausible(self, fit: Fit, last: FloatArray, guesses: FloatArray, led: bool) -> Fit:
        """Lower a fit's value by how far it is from all credible guesses, in units of their usual error."""
        share, _ = plausibility(between(last, fit.pose), guesses, float(self.track.errors.min()), led)
        return replace(fit, value=share * fit.value)

    def _align(
        self, cloud: FloatArray, start: FloatArray, reach_m: float, map_: LocalMap | None = None
    ) -> Fit | None:
        if cloud.shape[0] == 0:
            return None
        pose, hessian, fit, status = align_in_map(map_ or self.map_, cloud, start, reach_m, NOTHING_KNOWN)
        if status == TOO_FEW:
            return None
        pose[2] = (pose[2] + np.pi) % (2.0 * np.pi) - np.pi
        return Fit(float(fit[1]) / cloud.shape[0], pose, hessian, start, float(fit[0]), float(fit[1]))

    def _far(
        self,
        cloud: FloatArray,
        last: FloatArray,
        motion: FloatArray,
        credible: FloatArray | None,
        led: bool,
    ) -> Fit | None:
        """Search as far as any gap would have it: the stamps of scans may lie about how long it was.

        ``credible`` are the guesses that speak against what is far from them; None where no odometry does.
        """
        usual = float(self.track.usual[0])
        fits = self._search(cloud, last, *_window(MOST_GAP_S), composed(last, motion))
        fits = [fit for fit in fits if fit.value >= FAR * usual]
        if credible is None:
            return min(fits, key=lambda fit: distance(between(last, fit.pose), motion), default=None)
        found = [self._plausible(fit, last, credible, led) for fit in fits]
        near = [fit for fit in found if fit.value >= LEAST_FAR * usual]
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
            found = self._plausible(fit, last, credible, True)
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
            self._around = Surroundings.of(self._clouds(), centre)
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
