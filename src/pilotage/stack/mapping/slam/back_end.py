"""The graph of a mapped recording: closed round by round, refined, and how sure it leaves the poses."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.memory import give_back
from pilotage.core.types import BoolArray, FloatArray
from pilotage.kernels.slam.frames import composed
from pilotage.kernels.slam.slips import CHANCE
from pilotage.models.pose_graph_covariance import JointCovariance, PoseCovariances, covariances, turns
from pilotage.models.pose_graph_solver import Loss, Start, optimize
from pilotage.stack.mapping.slam.closures import (
    COUNTING,
    FAR_SLIP,
    LARGE_SLIP,
    NEIGHBOURHOOD,
    TRIAL_SLIP,
    USUAL_SLIP,
    Closure,
    Slip,
    Verdict,
    candidates,
    is_on_trial,
    judge,
    spread_between,
    unproven,
)
from pilotage.stack.mapping.slam.clouds import Clouds
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.odometry_record import ToldByOdometry
from pilotage.stack.mapping.slam.refinement import neighbours, not_aligned, pair_edges
from pilotage.stack.mapping.slam.submaps import Extent, Submaps
from pilotage.stack.mapping.slam.tracker import LocalTrack
from pilotage.stack.mapping.slam.uncertainty import (
    NO_EDGES,
    TRACK_STD_M,
    Edges,
    agreeing,
    edge_information,
    fused,
    relative_poses,
)

TRACK_FLOOR = np.diag([0.004**2, 0.004**2, 0.0015**2])
ODOMETRY_PROBABILITY, MISALIGNED = 0.9999, np.diag([0.05**2, 0.05**2, 0.015**2])
"""Of the chi-square of an odometry with an alignment up to which wheels are not taken to have slipped, and
what alignments are off by where little is in sight, which they do not know of: in doors, along bare walls."""
OPEN_M = 0.1
"""An alignment leaves a direction open along which it tells a place to no better than this."""
ROBUST_STDS = 3.0
REFINED_STDS = 3.5
REFINED_TRACK = 0.02
"""What the front end's own edges still count beside the refined ones: enough where those are missing."""
SURE_M, SURE_RAD = 0.2, 0.05
"""Standard deviations between two submaps up to which their keyframes are aligned with one another."""
REFINEMENTS = 3
SECOND_LOOK_M, SECOND_LOOKS, ATTACHED = 3.0, 3, 2
"""Largest window and number of the second looks, and closures with which a stretch is attached."""
FAR_LOOPS, TRIALS, TRIAL_M = 8, 3, 12.0
"""How often loops are looked for that are longer than the windows allow, and likewise across corridors alone;
half a window's side for what must follow along them."""

OnRound = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Solved:
    """Poses (K, 3) of the keyframes, the edges they come from and how much each counts (M,)."""

    poses: FloatArray
    edges: Edges
    weights: FloatArray
    objective: float

    def covariances(self, variance_factor: float = 1.0) -> PoseCovariances:
        """How sure the poses are, the first being held, with alignments unsure by a factor of variance."""
        edges = self.edges if variance_factor == 1.0 else self.edges.calibrated(variance_factor)
        return covariances(edges.graph(self.poses), weights=self.weights)


def track_edges(track: LocalTrack, share: float = 1.0) -> Edges:
    """Edges between consecutive keyframes, as sure as their alignment, guesses and odometry leave them.

    ``share``: of what alignments and guesses tell; the odometry's, which nothing else tells, is left whole.
    """
    poses = track.poses[track.keyframes]
    count = poses.shape[0]
    relative = relative_poses(poses[:-1], poses[1:])
    turn = turns(poses[:-1, 2])
    hessian = turn.transpose(0, 2, 1) @ track.hessians[1:] @ turn
    k = np.arange(count - 1)
    information = edge_information(hessian, relative[:, 2], TRACK_STD_M, TRACK_FLOOR + track.slips[1:])
    aligned = Edges(k, k + 1, relative, information, np.zeros(count - 1, np.bool_))
    if track.odometry is None:
        return aligned.scaled(share)
    # Slips and guesses tell nothing of the wheels: what scans are held by alone speaks against them.
    surely = _without_chance(hessian)
    held = edge_information(surely, relative[:, 2], TRACK_STD_M, TRACK_FLOOR + MISALIGNED)
    told = agreeing(replace(aligned, information=held), track.odometry.edges, ODOMETRY_PROBABILITY)
    if share == 1.0:
        told = told.scaled(_needed(track.odometry, relative, hessian, surely).astype(np.float64))
    alone = track.odometry.alone
    told = told.scaled(np.where(alone, 1.0 - share, 1.0))
    both = fused(aligned.scaled(share), told)
    return replace(both, odometry=np.where(alone[:, None, None], both.information, told.information))


def _needed(told: ToldByOdometry, relative: FloatArray, hessian: FloatArray, surely: FloatArray) -> BoolArray:
    """(M,) where the odometry is to be heard on the way.

    Where an alignment leaves a direction open, or holds by chance what the odometry contradicts. Elsewhere a
    good scanner is surer than it says, and any odometry would only add its noise.
    """
    apart = relative_poses(relative, told.edges.relative)
    squares = np.einsum("mi,mij,mj->m", apart, told.edges.information, apart)
    slid = _is_open(surely) & (squares > chi_square_quantile(ODOMETRY_PROBABILITY, 3))
    return np.asarray(_is_open(hessian) | slid | told.alone)


def _is_open(hessian: FloatArray) -> BoolArray:
    weakest = np.linalg.eigvalsh(hessian[:, :2, :2])[:, 0] / TRACK_STD_M**2
    return np.asarray(weakest < OPEN_M**-2)


def _without_chance(hessian: FloatArray) -> FloatArray:
    """Hessians (K, 3, 3) of alignments without what comes by chance, as where a wall's points scatter."""
    weight = hessian[:, 0, 0] + hessian[:, 1, 1]
    told, axes = np.linalg.eigh(hessian - CHANCE * weight[:, None, None] * np.diag([1.0, 1.0, 0.0]))
    return np.asarray((axes * np.maximum(told, 0.0)[:, None, :]) @ axes.transpose(0, 2, 1))


def solved(edges: Edges, poses: FloatArray, scale: float, slipped: bool = False) -> Solved:
    """Optimize from where the poses are; only closures are doubted, all edges where the track slipped."""
    solution = optimize(
        edges.graph(poses),
        loss=Loss.CAUCHY,
        scale=scale,
        doubted=np.ones(len(edges), np.bool_) if slipped else edges.closes,
        start=Start.GIVEN,
        tolerance=1e-6,
        most_iterations=60 if slipped else 40,
    )
    return Solved(solution.graph.poses, edges, solution.weights, solution.objective)


class LoopCloser:
    """The graph of a track that may still grow, closed round by round.

    Attributes
    ----------
    state
        The graph after the last round.
    closures
        All candidates that were searched, with their verdicts.
    submaps
        Of the track so far.
    closing
        The edges of those that were accepted.
    """

    def __init__(self, config: SlamConfig) -> None:
        self.submaps = Submaps(config)
        self.closures: list[Closure] = []
        self._config = config
        self.closing = NO_EDGES
        self._searched: dict[tuple[int, int], float] = {}
        self._accepted: set[tuple[int, int]] = set()
        self._slipped = False
        self._joint: tuple[Solved, JointCovariance] | None = None
        self._sure: tuple[Solved, BoolArray] | None = None
        self.state: Solved

    def grow(self, track: LocalTrack, ended: bool = True) -> None:
        """Take in what the track has become; one that has not ended has no last submap yet."""
        local = track.poses[track.keyframes]
        own = track_edges(track)
        if len(self.closing) == 0:
            poses = local.copy()
        else:
            known = self.state.poses[: len(local)]
            self.closing = self.closing.chosen(np.maximum(self.closing.i, self.closing.j) < len(local))
            ahead = relative_poses(np.repeat(local[len(known) - 1 : len(known)], len(local), axis=0), local)
            added = [composed(known[-1], step) for step in ahead[len(known) :]]
            poses = np.concatenate([known, np.array(added).reshape(-1, 3)])
            own = own.and_more(self.closing)
        self.submaps.grow(track.clouds, local, track.breaks, ended)
        self.state = solved(own, poses, ROBUST_STDS, self._slipped)

    def take_joined(self, clouds: Clouds, state: Solved, extents: list[Extent], since: int) -> None:
        """Begin with two maps in one graph: closures are searched between them alone.

        Parameters
        ----------
        extents, since
            Submaps of both, and how many of them are the first map's.
        """
        self.submaps.lay(clouds, state.poses, extents)
        self.state = state
        for first, end in ((0, since), (since, len(extents))):
            self._searched |= {(a, b): 0.0 for b in range(first, end) for a in range(first, b)}

    def close(self, window_m: float, slip: Slip) -> tuple[int, int]:
        """Search what may overlap within a window and solve; how many were searched, and how many closed."""
        state, submaps, joint = self.state, self.submaps, self.joint()
        if slip is LARGE_SLIP:
            self._searched = dict.fromkeys(self._searched, np.inf)
        closed_often = Counter(later for _, later in self._accepted)
        found = [
            c
            for c in candidates(joint, submaps.pieces, window_m, self._searched, slip)
            if (c.earlier, c.later) not in self._accepted
            and not (slip is LARGE_SLIP and closed_often[c.later] >= ATTACHED)
        ]
        judged, edges = judge(submaps, joint, found, self._config, slip)
        for closure in judged:
            pair = closure.candidate.earlier, closure.candidate.later
            self._searched[pair] = closure.candidate.half_m
            if closure.verdict in COUNTING:
                self._accepted.add(pair)
        self.closures += judged
        if len(edges):
            self._slipped |= slip is LARGE_SLIP
            self.closing = self.closing.and_more(edges)
            self.state = solved(state.edges.and_more(edges), state.poses, ROBUST_STDS, self._slipped)
        return len(found), len(edges)

    def copied(self) -> LoopCloser:
        """Return one that can go on by itself."""
        other = copy(self)
        other.closures, other._searched = self.closures.copy(), self._searched.copy()
        other._accepted = self._accepted.copy()
        return other

    def forget(self, window_m: float) -> None:
        """Let pairs be searched again that were in a window of that size."""
        self._searched = {pair: half_m for pair, half_m in self._searched.items() if half_m < window_m}

    def refuse(self, closures: list[Closure]) -> None:
        """Take closures back that nothing bore out; they are not searched again."""
        refused = {(c.candidate.earlier, c.candidate.later) for c in closures}
        known = {id(c) for c in closures}
        self.closures = [c for c in self.closures if id(c) not in known]
        self.closures += [replace(closure, verdict=Verdict.UNPROVEN) for closure in closures]
        self._searched |= dict.fromkeys(refused, 0.0)
        ends = {(int(self.submaps.references[a]), int(self.submaps.references[b])) for a, b in refused}

        def others(edges: Edges) -> Edges:
            pairs = zip(edges.i.tolist(), edges.j.tolist(), edges.closes.tolist(), strict=True)
            return edges.chosen(
                np.array([not closes or (i, j) not in ends for i, j, closes in pairs], np.bool_)
            )

        if refused & self._accepted:
            self._accepted -= refused
            self.closing = others(self.closing)
            self.state = solved(others(self.state.edges), self.state.poses, ROBUST_STDS, self._slipped)

    def joint(self) -> JointCovariance:
        """Covariance of the submaps' poses; computed anew only where the graph or they have changed."""
        state, known = self.state, self._joint
        if known is None or known[0] is not state or len(known[1].poses) != len(self.submaps):
            self._joint = known = state, state.covariances().joint(self.submaps.references)
        return known[1]

    def sure(self) -> BoolArray:
        """(S, S) whether two submaps are known well enough against each other to align their keyframes."""
        if self._sure is None or self._sure[0] is not self.state:
            self._sure = self.state, _sure(self.joint())
            # Nothing is closed any more, and these are the largest things in memory.
            self._joint = None
            self.submaps.forget()
            give_back()
        return self._sure[1]

    def look_again(self) -> None:
        """Search the latest submaps' candidates anew that only lacked another to second them."""
        recent = len(self.submaps) - NEIGHBOURHOOD
        for closure in self.closures:
            pair = closure.candidate.earlier, closure.candidate.later
            if closure.verdict is Verdict.ALONE and pair[1] >= recent:
                self._searched.pop(pair, None)


def closed(track: LocalTrack, config: SlamConfig, on_round: OnRound) -> LoopCloser:
    """Close loops, from the nearly certain to the wide ones, the graph being solved after each round.

    In the end stretches that lie beside others and were not closed are looked at again: there the front end
    may have slipped by more than it knows.
    """
    closer = LoopCloser(config)
    closer.grow(track)
    number = 0

    def close(closer: LoopCloser, window_m: float, slip: Slip) -> int:
        nonlocal number
        number += 1
        searched, count = closer.close(window_m, slip)
        give_back()
        on_round(f"round {number}: {searched} searched, {count} closed")
        return count

    def close_all(closer: LoopCloser) -> None:
        for window_m in config.search_windows_m:
            close(closer, window_m, USUAL_SLIP)

    widest_m = max(config.search_windows_m)

    def close_far(closer: LoopCloser, window_m: float) -> None:
        close_all(closer)
        for _ in range(FAR_LOOPS):
            if not close(closer, window_m, FAR_SLIP):
                break
            close_all(closer)

    def tried(closer: LoopCloser) -> LoopCloser | None:
        trial = closer.copied()
        trial.forget(widest_m)
        if not close(trial, widest_m, TRIAL_SLIP):
            return None
        trial.forget(widest_m)
        close_far(trial, TRIAL_M)
        on_trial = [c for c in trial.closures[len(closer.closures) :] if is_on_trial(c)]
        doubtful = unproven(trial.closures[len(closer.closures) :])
        if len(doubtful) < len(on_trial):
            closer = trial
        closer.refuse(doubtful)
        return closer

    close_far(closer, widest_m)
    for _ in range(TRIALS):
        borne_out = tried(closer)
        if borne_out is None:
            break
        closer = borne_out
    for _ in range(SECOND_LOOKS):
        if not close(closer, SECOND_LOOK_M, LARGE_SLIP):
            break
    return closer


def weak_edges(track: LocalTrack) -> Edges:
    """Return the front end's edges as they count beside refined ones."""
    return track_edges(track, REFINED_TRACK)


def refined(
    closer: LoopCloser, clouds: Clouds, kept: Edges, rounds: int = REFINEMENTS, most: int = 0, since: int = 0
) -> Solved:
    """Align keyframes with all their neighbours that are surely neighbours, and solve; several times.

    Closures between stretches of which no two keyframes could be aligned stay: passes of a corridor in
    opposite directions see the same walls, but hardly from the same place.

    Parameters
    ----------
    kept
        Edges that count beside those of the alignments.
    most
        With it pairs that are not along the path are taken evenly, and about so many at most.
    since
        With it keyframes before it are aligned with those from it on alone.
    """
    state, submaps, sure = closer.state, closer.submaps, closer.sure()
    for _ in range(rounds):
        pairs = neighbours(state.poses, since)
        owner = _owners(submaps, state.poses.shape[0])
        pairs = pairs[sure[owner[pairs[:, 0]], owner[pairs[:, 1]]]]
        if most:
            along = pairs[:, 1] - pairs[:, 0] == 1
            every = -(-pairs.shape[0] // most)
            pairs = pairs[along | (np.arange(pairs.shape[0]) % every == 0)]
        edges = pair_edges(clouds, state.poses, pairs)
        edges = edges.and_more(kept).and_more(not_aligned(closer.closing, edges))
        state = solved(edges, state.poses, REFINED_STDS)
        give_back()
    return state


def _owners(submaps: Submaps, count: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """(K,) a submap of each keyframe, the one whose reference is nearest along the path."""
    middles = 0.5 * (submaps.references[1:] + submaps.references[:-1])
    return np.searchsorted(middles, np.arange(count)).astype(np.int64)


def _sure(joint: JointCovariance) -> BoolArray:
    """(C, C) whether two poses are known well enough against each other."""
    count = joint.poses.shape[0]
    out = np.eye(count, dtype=np.bool_)
    first, second = np.triu_indices(count, 1)
    std_m, std_rad = spread_between(joint, first, second)
    known = (std_m < SURE_M) & (std_rad < SURE_RAD) | (second - first <= 2)
    out[first, second] = out[second, first] = known
    return out
