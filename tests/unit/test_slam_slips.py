"""What the front end may have slipped: along a bare corridor, and nowhere where the walls hold the scan."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.slips import add_slip
from pilotage.models.pose_graph_covariance import JointCovariance
from pilotage.stack.mapping.slam.closures import (
    FAR_SLIP,
    LEAST_PROOFS,
    USUAL_SLIP,
    Candidate,
    Closure,
    Verdict,
    candidates,
    unproven,
)
from pilotage.stack.mapping.slam.matching import Match
from pilotage.stack.mapping.slam.refinement import BESIDE, not_aligned
from pilotage.stack.mapping.slam.uncertainty import Edges

POINTS = 150.0


class Slips:
    """Of scans that lie where they were guessed, on walls with the same normals (K, 2) in the map."""

    def __init__(self) -> None:
        self.total, self.held = np.zeros((3, 3)), np.zeros((3, 3))

    def add(self, normals: FloatArray, heading: float, by_odometry: bool) -> None:
        hessian = np.diag([0.0, 0.0, 1500.0])
        hessian[:2, :2] = normals.T @ normals * POINTS / len(normals)
        pose = np.array([3.0, 1.0, heading])
        add_slip(self.total, self.held, pose, pose, hessian, POINTS, 0.03, by_odometry)

    def covariance(self) -> FloatArray:
        return self.total + self.held @ self.held.T


@pytest.mark.parametrize("heading", [0.0, 0.7])
@pytest.mark.parametrize("by_odometry", [True, False])
def test_a_corridor_leaves_its_course_open_and_nothing_else(heading: float, by_odometry: bool) -> None:
    slips = Slips()
    noise = np.random.default_rng(0).normal(0.0, 0.1, 200)
    for _ in range(16):
        slips.add(np.column_stack([noise, np.sqrt(1.0 - noise**2)]), heading, by_odometry)
    # The corridor runs along x of the map; what is told is in the scanner's frame.
    covariance = slips.covariance()
    course = np.array([np.cos(heading), -np.sin(heading), 0.0])
    across = np.array([np.sin(heading), np.cos(heading), 0.0])
    scans = 4.0 if by_odometry else 16.0
    assert 0.5 * scans * 0.03 < np.sqrt(course @ covariance @ course) <= scans * 0.03
    assert np.sqrt(across @ covariance @ across) < 0.002
    assert np.sqrt(covariance[2, 2]) < 0.002


def test_walls_on_all_sides_leave_nothing_open() -> None:
    slips = Slips()
    for _ in range(16):
        slips.add(np.array([[1.0, 0.0], [0.0, 1.0]]), 0.3, False)
    assert np.sqrt(np.linalg.eigvalsh(slips.covariance())[-1]) < 0.002


def test_a_loop_that_is_too_long_is_searched_in_a_window_that_is_cut() -> None:
    poses = np.array([[0.0, 0.0, 0.0], *([50.0, 5.0 * k, 0.0] for k in range(4)), [6.0, 0.0, 0.0]])

    def joint(std: float) -> JointCovariance:
        """All as sure as can be but the last."""
        columns = np.zeros((6, 9))
        columns[-1, [0, 4, 8]] = std * np.array([10.0, 10.0, 0.1])
        return JointCovariance(poses, np.arange(7), np.arange(6), columns)

    unsure = joint(1.0)
    pieces = np.zeros(6, np.int64)
    assert candidates(unsure, pieces, 8.0, {}, USUAL_SLIP) == []
    (found,) = candidates(unsure, pieces, 8.0, {}, FAR_SLIP)
    assert (found.earlier, found.later, found.half_m) == (0, 5, 8.0)
    # Once it was searched so, it is not again; what the usual windows hold is left to them.
    assert candidates(joint(0.01), pieces, 8.0, {}, FAR_SLIP) == []
    assert candidates(unsure, pieces, 8.0, {(0, 5): 8.0}, FAR_SLIP) == []


def test_closures_stay_where_no_keyframes_could_be_aligned() -> None:
    def edges(pairs: list[tuple[int, int]], closes: bool) -> Edges:
        i, j = np.array(pairs).T
        count = len(pairs)
        return Edges(i, j, np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1)), np.full(count, closes))

    closing = edges([(10, 100), (40, 130), (60, 150)], True)
    aligned = edges([(10 + BESIDE, 100 - BESIDE), (40 + BESIDE + 1, 130)], True)
    along = edges([(149, 150), (60, 62)], False)
    kept = not_aligned(closing, aligned.and_more(along))
    assert list(zip(kept.i.tolist(), kept.j.tolist(), strict=True)) == [(40, 130), (60, 150)]
    assert len(not_aligned(closing, along)) == 3


def test_what_is_closed_across_a_corridor_alone_must_be_borne_out() -> None:
    def closure(earlier: int, later: int, half_m: float, verdict: Verdict) -> Closure:
        found = Match(np.zeros(3), np.eye(3), 0.8, 0.0, 1.0, 1.0, True, np.array([1.0, 0.0]))
        return Closure(Candidate(earlier, later, half_m, 0.1), found, 1.0, 8, verdict)

    across = [closure(10 * k, 100 + 10 * k, 8.0, Verdict.ACROSS) for k in (0, 20)]
    narrow = closure(200, 300, 1.0, Verdict.ACROSS)
    full = [closure(k, 100 + k, 1.0, Verdict.ACCEPTED) for k in range(LEAST_PROOFS)]
    assert unproven([*across, narrow, *full]) == across[1:]
    assert unproven([*across, narrow, *full[1:]]) == across
