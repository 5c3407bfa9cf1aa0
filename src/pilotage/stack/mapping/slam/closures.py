"""Loop closures: candidates by place, each verified alone, with the graph, and together with the others."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.slam.compatibility import compatible_pairs, innovation_covariances
from pilotage.models.pose_graph_covariance import JointCovariance, relative_jacobians
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.matching import Match, match
from pilotage.stack.mapping.slam.submaps import Submaps
from pilotage.stack.mapping.slam.uncertainty import (
    Edges,
    edge_information,
    errors_of,
    relative_poses,
)

LEAST_APART = 4
"""Submaps between the two of a candidate: nearer ones share keyframes or the front end's local map."""
NEAR_M = 3.0
WINDOW_STDS, MOST_TURN_RAD = 3.0, 0.8
AGAIN = 1.5
"""A pair is searched again once its window has shrunk by this factor."""
MOST_PER_LATER, MOST_PER_EARLIER = 3, 6
PAIRS_AT_ONCE = 4096
"""The covariances of all pairs at once would be the largest thing in memory."""
CLOSURE_STD_M = 0.1
LEAST_TOLD = 1e-4 * np.eye(3)
"""What a closure tells in any direction: nothing, but no zero."""
COURSE_RAD = 0.03
"""How well the direction of an open course is known."""
CLOSURE_FLOOR = 4.0 * np.diag([0.004**2, 0.004**2, 0.0015**2])
WIDE_M = 2.0
SECONDING, AGREEING = 0.65, 0.9
"""Share of the least score, and agreement of the walls, with which a match may second another."""
NEIGHBOURHOOD = 8
"""A wide search must be seconded by closures of submaps at most so far along the path, on both sides."""
LEAST_ON_TRIAL, LEAST_PROOFS, PROVING = 6, 3, 25
"""Closures across a corridor alone that must second one in a wide window, and full ones that must follow from
it, submaps at most so far along the path on both sides."""


@dataclass(frozen=True, slots=True)
class Slip:
    """What the front end may have slipped unnoticed anywhere: three standard deviations of it.

    It widens the windows and the gate with the graph. Two closures across the same slip still have to agree
    without it. ``support`` closures more than usual are needed. With ``far`` a window that would be larger
    than the round's is cut to it: after a long way the place is nearer to where the graph has it than the
    graph dares to say, or not in the window at all. On ``trial`` closures that leave their course open count
    there too.
    """

    shift_m: float
    turn_rad: float
    support: int = 0
    far: bool = False
    trial: bool = False

    def covariance(self) -> FloatArray:
        """(3, 3)."""
        return np.diag(np.array([self.shift_m, self.shift_m, self.turn_rad]) / WINDOW_STDS) ** 2


USUAL_SLIP = Slip(0.3, 0.04)
LARGE_SLIP = Slip(1.5, 0.3, 2)
"""For a second look at stretches that should have been closed and were not."""
FAR_SLIP = Slip(0.3, 0.04, 2, far=True)
FAR_FROM_M = 8.0
"""Half a window's side beyond which a search is one for such loops."""
TRIAL_SLIP = replace(FAR_SLIP, trial=True)
"""For loops so long that the graph would have them searched all over the building, and again in corridors."""


class Verdict(StrEnum):
    """What became of a candidate."""

    ACCEPTED = "accepted"
    ACROSS = "accepted across its course alone"
    NO_MATCH = "no match"
    LOW_SCORE = "low score"
    LITTLE_OVERLAP = "little overlap"
    WALLS_DISAGREE = "walls disagree"
    AMBIGUOUS = "ambiguous"
    AGAINST_GRAPH = "contradicts the graph"
    AGAINST_OTHERS = "contradicts other closures"
    ALONE = "no other closure seconds it"
    UNPROVEN = "no full closure followed from it"


COUNTING = (Verdict.ACCEPTED, Verdict.ACROSS)
"""Verdicts with which a closure is in the graph."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A pair of submaps worth a search, with half the side of its window."""

    earlier: int
    later: int
    half_m: float
    half_rad: float


@dataclass(frozen=True, slots=True)
class Closure:
    """A candidate that was searched and judged.

    ``chi_square`` has three degrees of freedom, NaN where nothing matched; ``support`` counts the closures
    of the same round and neighbourhood that agree.
    """

    candidate: Candidate
    match: Match
    chi_square: float
    support: int
    verdict: Verdict


def moved(closure: Closure, by: int) -> Closure:
    """Return a closure whose submaps are numbered on from so many others."""
    c = closure.candidate
    return replace(closure, candidate=replace(c, earlier=c.earlier + by, later=c.later + by))


def spread(covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Greatest standard deviation of position and that of heading, (M,) each, of covariances (M, 3, 3)."""
    xx, yy, xy = covariance[:, 0, 0], covariance[:, 1, 1], covariance[:, 0, 1]
    largest = 0.5 * (xx + yy) + np.sqrt(0.25 * (xx - yy) ** 2 + xy**2)
    return np.sqrt(np.maximum(largest, 0.0)), np.sqrt(np.maximum(covariance[:, 2, 2], 0.0))


def spread_between(
    joint: JointCovariance, first: IntArray, second: IntArray
) -> tuple[FloatArray, FloatArray]:
    """``spread`` of poses (M,) as seen from others (M,)."""
    std_m, std_rad = np.empty(first.size), np.empty(first.size)
    for start in range(0, first.size, PAIRS_AT_ONCE):
        some = slice(start, start + PAIRS_AT_ONCE)
        std_m[some], std_rad[some] = spread(joint.relative(first[some], second[some]))
    return std_m, std_rad


def candidates(
    joint: JointCovariance,
    pieces: IntArray,
    window_m: float,
    searched: dict[tuple[int, int], float],
    slip: Slip,
) -> list[Candidate]:
    """Pairs of submaps that may overlap and whose window is no larger than given.

    Parameters
    ----------
    joint, pieces
        Of the submaps' reference keyframes (C,), and (C,) which piece of the track each belongs to.
    """
    poses = joint.poses
    reach_m = window_m if slip.far else min(window_m, 2.0)
    first, second = np.triu_indices(poses.shape[0], 1)
    distance = np.hypot(*(poses[first, :2] - poses[second, :2]).T)
    torn = pieces[first] != pieces[second]
    close = (distance < NEAR_M + reach_m) & (torn | (second - first >= LEAST_APART))
    first, second, distance, torn = first[close], second[close], distance[close], torn[close]
    std_m, std_rad = spread_between(joint, first, second)
    half_m = WINDOW_STDS * std_m + slip.shift_m
    most_rad = np.where(torn, np.pi, MOST_TURN_RAD)
    half_rad = np.minimum(WINDOW_STDS * std_rad + slip.turn_rad, most_rad)
    wanted = half_m > min(window_m, FAR_FROM_M) if slip.far else half_m <= window_m
    half_m = np.minimum(half_m, window_m)
    wanted &= distance < NEAR_M + np.minimum(half_m, reach_m)
    of_later: dict[int, int] = {}
    of_earlier: dict[int, int] = {}
    chosen = []
    for k in np.lexsort((distance, second)):
        a, b = int(first[k]), int(second[k])
        if not wanted[k] or searched.get((a, b), np.inf) < AGAIN * half_m[k]:
            continue
        if of_later.get(b, 0) >= MOST_PER_LATER or of_earlier.get(a, 0) >= MOST_PER_EARLIER:
            continue
        of_later[b] = of_later.get(b, 0) + 1
        of_earlier[a] = of_earlier.get(a, 0) + 1
        chosen.append(Candidate(a, b, float(half_m[k]), float(half_rad[k])))
    return sorted(chosen, key=lambda c: (c.earlier, c.later))


def judge(
    submaps: Submaps,
    joint: JointCovariance,
    found: list[Candidate],
    config: SlamConfig,
    slip: Slip,
) -> tuple[list[Closure], Edges]:
    """Search candidates and judge what was found.

    Parameters
    ----------
    joint
        Of the submaps' reference keyframes.

    Returns
    -------
    All closures with their verdicts, and the accepted ones as edges between keyframes.
    """
    closures, poses = [], joint.poses
    for c in found:
        predicted = relative_poses(poses[c.earlier][None], poses[c.later][None])[0]
        found_match = match(submaps, c.earlier, c.later, predicted, c.half_m, c.half_rad)
        closures.append(Closure(c, found_match, np.nan, 0, judged_alone(found_match, config)))
    pieces = submaps.pieces
    across = [
        int(pieces[closure.candidate.later] - pieces[closure.candidate.earlier]) for closure in closures
    ]
    sound = [k for k, closure in enumerate(closures) if closure.verdict in COUNTING]
    weak = [k for k, closure in enumerate(closures) if across[k] and _may_second(closure, config)]
    edges = _edges([closures[k] for k in sound + weak])
    if not sound:
        return closures, edges.chosen(np.zeros(len(weak), np.bool_))
    chi_square, consistent = _joint_test(edges, joint, config.gate_probability, slip)
    gate = chi_square_quantile(config.gate_probability, 3)
    fits = chi_square <= gate
    taken = clique(consistent & fits[:, None] & fits[None, :], fits)
    full = np.array([closures[k].verdict is not Verdict.ACROSS for k in sound + weak])
    support = np.where(full, _support(edges, taken & fits & full), _support(edges, taken & fits))
    for n, k in enumerate(sound):
        closure = replace(closures[k], chi_square=float(chi_square[n]), support=int(support[n]))
        # Beside a break the window is wide because the heading is open, not because the place is.
        wide = closure.candidate.half_m > WIDE_M and across[k] != 1
        needed = config.least_support - 1 + (1 if wide else 0) + slip.support
        if not fits[n]:
            verdict = Verdict.AGAINST_GRAPH
        elif not taken[n]:
            verdict = Verdict.AGAINST_OTHERS
        elif support[n] < needed:
            verdict = Verdict.ALONE
        elif not (full[n] or closure.candidate.half_m <= WIDE_M or _on_trial(slip, int(support[n]))):
            # The next corridor may look the same across, and nothing along says no.
            verdict = Verdict.AMBIGUOUS
        else:
            verdict = closure.verdict
        closures[k] = replace(closure, verdict=verdict)
    edges = edges.chosen(np.arange(len(edges)) < len(sound))
    edges = edges.chosen(np.array([closures[k].verdict in COUNTING for k in sound]))
    references = submaps.references
    return closures, replace(edges, i=references[edges.i], j=references[edges.j])


def _on_trial(slip: Slip, support: int) -> bool:
    """Whether a closure across its course alone may count in a wide window until others prove it."""
    return slip.trial and support >= LEAST_ON_TRIAL


def is_on_trial(closure: Closure) -> bool:
    """Whether a closure counts that leaves its course open in a wide window."""
    return closure.verdict is Verdict.ACROSS and closure.candidate.half_m > WIDE_M


def unproven(closures: list[Closure]) -> list[Closure]:
    """Return those on trial that no full closures near them confirm."""
    full = [c.candidate for c in closures if c.verdict is Verdict.ACCEPTED]
    earlier = np.array([c.earlier for c in full], np.int64)
    later = np.array([c.later for c in full], np.int64)

    def proofs(candidate: Candidate) -> int:
        near = np.abs(earlier - candidate.earlier) <= PROVING
        return int(np.count_nonzero(near & (np.abs(later - candidate.later) <= PROVING)))

    return [c for c in closures if is_on_trial(c) and proofs(c.candidate) < LEAST_PROOFS]


def judged_alone(found: Match, config: SlamConfig) -> Verdict:
    """Judge a match by itself."""
    if found.score <= 0.0 or not found.aligned:
        return Verdict.NO_MATCH
    if found.score < config.least_score:
        return Verdict.LOW_SCORE
    if found.overlap < config.least_overlap:
        return Verdict.LITTLE_OVERLAP
    if found.agreement < config.least_agreement:
        return Verdict.WALLS_DISAGREE
    if found.second > config.most_ambiguity * found.score:
        return Verdict.AMBIGUOUS
    return Verdict.ACROSS if found.course.any() else Verdict.ACCEPTED


def _may_second(closure: Closure, config: SlamConfig) -> bool:
    """Whether a match across a break, too weak to count itself, may speak for another."""
    found = closure.match
    return (
        closure.verdict is Verdict.LOW_SCORE
        and found.score >= SECONDING * config.least_score
        and found.agreement >= AGREEING
        and found.second <= config.most_ambiguity * found.score
    )


def _edges(closures: list[Closure]) -> Edges:
    """Edges between submaps, by their numbers."""
    relative = np.array([c.match.relative for c in closures]).reshape(-1, 3)
    hessian = np.array([c.match.hessian for c in closures]).reshape(-1, 3, 3)
    # Across an open course a match is as sure as the course's direction over what it may be off along it.
    course = np.array([c.match.course * COURSE_RAD * c.candidate.half_m for c in closures]).reshape(-1, 2)
    c, s = np.cos(relative[:, 2]), np.sin(relative[:, 2])
    across = np.zeros((len(closures), 3))
    across[:, 0] = -c * course[:, 1] + s * course[:, 0]
    across[:, 1] = s * course[:, 1] + c * course[:, 0]
    floor = CLOSURE_FLOOR + across[:, :, None] * across[:, None, :]
    return Edges(
        np.array([c.candidate.earlier for c in closures], np.int64),
        np.array([c.candidate.later for c in closures], np.int64),
        relative,
        edge_information(hessian, relative[:, 2], CLOSURE_STD_M, floor, LEAST_TOLD),
        np.ones(len(closures), np.bool_),
    )


def _joint_test(
    edges: Edges, joint: JointCovariance, probability: float, slip: Slip
) -> tuple[FloatArray, BoolArray]:
    """Chi-square (M,) of each closure with the graph, and (M, M) which pairs agree.

    Two closures agree where each one's innovation is probable given the other's: joint compatibility
    (Neira and Tardos, 2001) pair by pair, as in pairwise consistency maximization (Mangelson et al., 2018).
    """
    count, poses = len(edges), joint.poses
    innovation = errors_of(edges, poses)
    a, b = relative_jacobians(poses[edges.i], poses[edges.j], edges.relative[:, 2])
    used, at = np.unique(np.concatenate([edges.i, edges.j]), return_inverse=True)
    measured = a, b, joint.among(used), at[:count], at[count:]
    own = innovation_covariances(*measured) + np.linalg.inv(edges.information)
    chi_square = squared(innovation, own + slip.covariance())
    gate = chi_square_quantile(probability, 3)
    agree = compatible_pairs(*measured, innovation, own, np.linalg.inv(own), gate)
    if slip.support:
        # Of a large slip only closures around it can tell the size: far ones need not agree on it.
        agree |= ~_near(edges)
    np.fill_diagonal(agree, False)
    return np.asarray(chi_square), agree


def squared(errors: FloatArray, covariance: FloatArray) -> FloatArray:
    """Squared Mahalanobis distances (M,) of errors (M, n) under covariances (M, n, n)."""
    return np.asarray(np.einsum("ki,ki->k", errors, np.linalg.solve(covariance, errors[..., None])[..., 0]))


def clique(agree: BoolArray, fits: BoolArray) -> BoolArray:
    """A large set in which all agree: greedily, the one that agrees with most first."""
    degree = agree.sum(axis=1)
    taken = np.zeros(fits.size, np.bool_)
    for k in np.argsort(-degree, kind="stable"):
        if fits[k] and agree[k][taken].all():
            taken[k] = True
    return taken


def _support(edges: Edges, taken: BoolArray) -> IntArray:
    """(M,) how many other closures taken lie near along the path on both sides."""
    near = _near(edges) & taken[None, :]
    np.fill_diagonal(near, False)
    return np.asarray(near.sum(axis=1), np.int64)


def _near(edges: Edges) -> BoolArray:
    """(M, M) which closures lie near each other along the path on both sides."""
    # There may be thousands of them: no wider numbers than needed.
    i, j = edges.i.astype(np.int32), edges.j.astype(np.int32)
    near_i = np.abs(i[:, None] - i[None, :]) <= NEIGHBOURHOOD
    near_j = np.abs(j[:, None] - j[None, :]) <= NEIGHBOURHOOD
    return np.asarray(near_i & near_j)
