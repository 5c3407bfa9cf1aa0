"""Where a recording lies in a map made before: stretches of it searched all over the map."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.types import BoolArray, FloatArray, IntArray
from pilotage.kernels.slam.frames import composed
from pilotage.kernels.slam.match_grid import scores_of
from pilotage.models.pose_graph_covariance import covariances, relative_jacobians
from pilotage.stack.mapping.slam.back_end import Solved
from pilotage.stack.mapping.slam.closures import (
    CLOSURE_FLOOR,
    CLOSURE_STD_M,
    USUAL_SLIP,
    Verdict,
    clique,
    judged_alone,
    spread,
    squared,
)
from pilotage.stack.mapping.slam.clouds import Clouds
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.earlier_map import EarlierMap
from pilotage.stack.mapping.slam.matching import Match, laid, lying
from pilotage.stack.mapping.slam.submaps import LEVELS, Submap, Submaps, drawn, path_lengths
from pilotage.stack.mapping.slam.uncertainty import (
    Edges,
    edge_information,
    relative_poses,
)

STRETCH, LEAST_STRETCHES = 3.0, 3.0
"""Length of a stretch over that of a submap: it must be told from all of a building, not from a window. A
short recording is cut into shorter ones, so many side by side at least."""
BUDGET = 3_000_000
MOST_SEARCHED = 40
"""Stretches that are searched, evenly along the path: a search takes about a second a 1000 m² of map."""
LEAST_AGREEING, RIVAL = 3, 0.5
"""So many stretches must agree where the recording lies, and no group half as large on another place."""
NOWHERE = Match(np.zeros(3), np.zeros((3, 3)), 0.0, 0.0, 0.0, 0.0, False)
MATCH_FLOOR = np.diag([0.05, 0.05, 0.01]) ** 2


@dataclass(frozen=True, slots=True)
class Places:
    """Stretches of a recording, searched in an earlier map.

    Attributes
    ----------
    keyframes
        (S,) their reference keyframes, and ``pieces`` (S,) of the track they belong to.
    matches
        Where each lies: ``relative`` is the pose of its reference in the map.
    sound
        (S,) which matches stand by themselves: alike enough, on walls, in one place only.
    agree
        (S, S) which pairs of sound matches lie to each other as the recording has them.
    searched
        How many of them were.
    whole, stretches
        The map and the stretches as they were laid on each other.
    """

    keyframes: IntArray
    pieces: IntArray
    matches: tuple[Match, ...]
    sound: BoolArray
    agree: BoolArray
    searched: int
    whole: Submap
    stretches: Submaps

    def poses(self) -> FloatArray:
        """(S, 3) where the matches have the reference keyframes in the map."""
        return np.array([match.relative for match in self.matches]).reshape(-1, 3)

    def agreeing(self, pieces: set[int]) -> tuple[IntArray, int]:
        """Return the largest group of stretches of some pieces that agree, and how many speak for another."""
        own = self.sound & np.isin(self.pieces, sorted(pieces))
        best = clique(self.agree & own[:, None] & own[None, :], own)
        # What merely could not be told from the group's place is no rival of it.
        against = own & ~best & ~self.agree[:, best].any(axis=1)
        other = clique(self.agree & against[:, None] & against[None, :], against)
        return np.flatnonzero(best), int(other.sum())

    def walls(self, poses: FloatArray) -> float:
        """Share of the stretches' points on walls of the map, of those that fall where it saw.

        Parameters
        ----------
        poses
            (K, 3) of the recording's keyframes in the map.
        """
        on_walls = seen = 0.0
        for k, keyframe in enumerate(self.keyframes.tolist()):
            points = self.stretches[k].fine
            agreement, overlap = lying(self.whole, self.stretches.cell_m, points, poses[keyframe])
            seen += overlap * len(points)
            on_walls += agreement * overlap * len(points)
        return on_walls / max(seen, 1.0)


def places(
    earlier: EarlierMap, clouds: Clouds, state: Solved, breaks: IntArray, config: SlamConfig
) -> Places:
    """Search a mapped recording's stretches all over an earlier map, with any heading."""
    cell_m = config.search_cell_m
    everything = np.arange(len(earlier))
    whole = drawn(earlier.clouds, earlier.poses, everything, np.zeros(3), cell_m)
    scores = scores_of(whole.grid, LEVELS, whole.corner_xy_m, cell_m)
    size_m = cell_m * np.array(whole.grid.shape[::-1], np.float64)
    middle = np.append(whole.corner_xy_m + 0.5 * size_m, 0.0)
    submap_m = config.submap_length_m
    length_m = np.clip(path_lengths(state.poses)[-1] / LEAST_STRETCHES, submap_m, STRETCH * submap_m)
    stretches = Submaps(config.model_copy(update={"submap_length_m": float(length_m)}))
    stretches.grow(clouds, state.poses, breaks)
    matches = [NOWHERE] * len(stretches)
    sound = np.zeros(len(stretches), np.bool_)
    chosen = np.unique(
        np.linspace(0, len(stretches) - 1, min(len(stretches), MOST_SEARCHED)).astype(np.int64)
    )
    for k in chosen.tolist():
        matches[k], everywhere = laid(
            whole,
            scores,
            stretches[k],
            middle,
            0.5 * float(size_m.max()),
            np.pi,
            config.least_score,
            config.most_ambiguity,
            BUDGET,
            # What does not count already needs no rivals.
            lambda found: judged_alone(found, config) is Verdict.ACCEPTED,
        )
        sound[k] = everywhere and judged_alone(matches[k], config) is Verdict.ACCEPTED
    alone = np.diag(sound)
    out = Places(
        stretches.references, stretches.pieces, tuple(matches), sound, alone, chosen.size, whole, stretches
    )
    return replace(out, agree=_agreeing_pairs(out, earlier, state, config))


def _agreeing_pairs(found: Places, earlier: EarlierMap, state: Solved, config: SlamConfig) -> BoolArray:
    """(S, S) pairs of sound matches that lie to each other as they do in the recording."""
    out = np.diag(found.sound)
    chosen = np.flatnonzero(found.sound)
    if chosen.size < 2:
        return out
    own = found.keyframes[chosen]
    placed = found.poses()[chosen]
    near, at = np.unique(
        scipy.spatial.cKDTree(earlier.poses[:, :2]).query(placed[:, :2])[1], return_inverse=True
    )
    in_map = covariances(earlier.edges.graph(earlier.poses)).joint(near)
    a, b = np.triu_indices(chosen.size, 1)
    told = relative_poses(state.poses[own[a]], state.poses[own[b]])
    seen = relative_poses(placed[a], placed[b])
    off = seen - told
    off[:, 2] = (off[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    covariance = state.covariances().relative(own[a], own[b]) + USUAL_SLIP.covariance()
    std_m, std_rad = spread(in_map.relative(at[a], at[b]))
    k = np.arange(3)
    covariance[:, k, k] += np.column_stack([std_m, std_m, std_rad]) ** 2
    hessian = np.array([found.matches[n].hessian for n in chosen])
    # Kept in the map's axes: a heading of zero turns nothing.
    each = np.linalg.inv(edge_information(hessian, np.zeros(chosen.size), CLOSURE_STD_M, MATCH_FLOOR))
    by_first, by_second = relative_jacobians(placed[a], placed[b])
    covariance += by_first @ each[a] @ by_first.transpose(0, 2, 1)
    covariance += by_second @ each[b] @ by_second.transpose(0, 2, 1)
    fits = squared(off, covariance) <= chi_square_quantile(config.gate_probability, 3)
    out[chosen[a], chosen[b]] = out[chosen[b], chosen[a]] = fits
    return np.asarray(out)


def links(found: Places, chosen: IntArray, earlier: EarlierMap) -> Edges:
    """Edges from the map's keyframes nearest to chosen stretches to the stretches' own, by their numbers."""
    placed = found.poses()[chosen]
    near = np.asarray(scipy.spatial.cKDTree(earlier.poses[:, :2]).query(placed[:, :2])[1], np.int64)
    relative = relative_poses(earlier.poses[near], placed)
    hessian = np.array([found.matches[n].hessian for n in chosen])
    information = edge_information(hessian, placed[:, 2], CLOSURE_STD_M, CLOSURE_FLOOR)
    return Edges(near, found.keyframes[chosen], relative, information, np.ones(chosen.size, np.bool_))


def carried_to(found: Places, chosen: IntArray, poses: FloatArray) -> FloatArray:
    """(K, 3) the recording's keyframes in the map, each hung on the chosen stretch nearest along the path."""
    order = np.argsort(found.keyframes[chosen], kind="stable")
    anchors, placed = found.keyframes[chosen][order], found.poses()[chosen][order]
    middles = 0.5 * (anchors[1:] + anchors[:-1])
    owner = np.searchsorted(middles, np.arange(poses.shape[0]))
    ahead = relative_poses(poses[anchors][owner], poses)
    return np.array([composed(placed[n], step) for n, step in zip(owner, ahead, strict=True)])
