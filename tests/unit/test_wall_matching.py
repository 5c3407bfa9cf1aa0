"""Walls merged in normal form, their measurement model, and lines matched to them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import FloatArray, Pose2
from pilotage.experiments.build.charts import load_chart
from pilotage.kernels.filters.wall_line import innovation_distance, wall_innovation
from pilotage.kernels.lines import joint_association
from pilotage.kernels.lines.wall_candidates import BESIDE_M, overlap_share
from pilotage.maps.segment_map import SegmentMap, box_segments
from pilotage.maps.wall_lines import WallLines, normal_form
from pilotage.stack.localization.wall_matching import AMBIGUOUS, UNMATCHED, WallMatcher, WallMatchingConfig
from support.models import wall_line
from support.walls import extractor, scan_of

MOUNT = np.zeros(3)
MUSEUM = load_chart("museum").walls
TIGHT = np.diag([1e-4, 1e-4, 1e-5])


def floor_with(*walls: list[float]) -> SegmentMap:
    """A floor of ten metres each way with nothing but these walls."""
    return SegmentMap(np.array(walls), np.zeros((0, 3)), (-10.0, -10.0, 10.0, 10.0))


def matcher(world: SegmentMap, gate: float = 0.999) -> WallMatcher:
    """A matcher for a scanner at the robot's centre."""
    return WallMatcher(WallMatchingConfig(), gate, world, MOUNT)


# --- the walls of a map ---------------------------------------------------------------------------------


def test_touching_collinear_walls_are_one_and_a_gap_keeps_them_apart() -> None:
    world = SegmentMap.of(np.array([[0, 1, 2, 1], [4, 1, 2, 1], [5, 1, 6, 1], [0, 0, 0, 1]], dtype=float))
    walls = WallLines.of(world)
    assert len(walls) == 3
    spans = sorted(tuple(sorted((s[0], s[2]))) for s in walls.segments_m if abs(s[1] - s[3]) < 1e-9)
    assert spans == [pytest.approx((0.0, 4.0)), pytest.approx((5.0, 6.0))]
    assert np.unique(walls.line_of).shape[0] == 2


def test_the_museums_doubled_wall_is_one() -> None:
    walls = WallLines.of(MUSEUM)
    assert len(walls) == 31
    assert np.unique(walls.line_of).shape[0] < 31  # doorways leave walls on one line


def test_each_wall_lies_where_its_own_pieces_do_in_a_map_of_whole_millimetres() -> None:
    # A wall with a door, turned by 0.3 rad and rounded: its halves are on one line only to half a millimetre.
    c, s = math.cos(0.3), math.sin(0.3)
    along = np.array([[0.0, 7.0], [9.0, 10.5], [10.5, 12.0]])
    ends = np.column_stack([along[:, 0] * c, along[:, 0] * s, along[:, 1] * c, along[:, 1] * s])
    pieces = np.asarray(np.round(ends, 3), dtype=np.float64)
    walls = WallLines.of(SegmentMap.of(pieces))
    assert len(walls) == 2
    assert np.unique(walls.line_of).shape[0] == 1
    lengths = np.hypot(*(walls.segments_m[:, 2:] - walls.segments_m[:, :2]).T)
    alone, chain = int(np.argmax(lengths)), int(np.argmin(lengths))
    assert tuple(walls.normals[alone]) == pytest.approx(normal_form(pieces[0]), abs=1e-12)
    # The two that touch are one wall, between them: nearer to both than either is to the other's line.
    rho, alpha = walls.normals[chain]
    touching = pieces[1:].reshape(-1, 2)
    assert np.abs(touching @ np.array([math.cos(alpha), math.sin(alpha)]) - rho).max() < 5e-4
    for (rho, alpha), segment in zip(walls.normals, walls.segments_m, strict=True):
        assert segment.reshape(2, 2) @ np.array([math.cos(alpha), math.sin(alpha)]) == pytest.approx(rho)


@settings(max_examples=100)
@given(st.tuples(*[st.floats(-20, 20)] * 4))
def test_both_ends_obey_the_normal_form(segment: tuple[float, float, float, float]) -> None:
    x0, y0, x1, y1 = segment
    if math.hypot(x1 - x0, y1 - y0) < 0.1:
        return
    rho, alpha = normal_form(np.array(segment))
    assert rho >= 0.0
    for x, y in ((x0, y0), (x1, y1)):
        assert x * math.cos(alpha) + y * math.sin(alpha) == pytest.approx(rho, abs=1e-9)


# --- the measurement ------------------------------------------------------------------------------------


@settings(max_examples=200)
@given(
    st.tuples(st.floats(-20, 20), st.floats(-20, 20), st.floats(-3.1, 3.1)),
    st.tuples(st.floats(0, 20), st.floats(-3.1, 3.1)),
    st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-1, 1)),
    st.floats(-3.1, 3.1),
)
def test_jacobian_against_central_differences(
    pose: tuple[float, float, float],
    wall: tuple[float, float],
    mount: tuple[float, float, float],
    seen: float,
) -> None:
    line, arm = np.array(wall), np.array(mount)
    z, H = wall_line(Pose2(*pose), line, arm, seen)
    if abs(math.cos(z[1] - seen)) < 1e-3:
        return  # between the two normals the choice jumps
    for k in range(3):
        ends = []
        for sign in (1.0, -1.0):
            moved = np.array(pose)
            moved[k] += sign * 1e-6
            ends.append(wall_line(Pose2.from_array(moved), line, arm, seen)[0])
        slope = np.array([ends[0][0] - ends[1][0], wrap_to_pi(ends[0][1] - ends[1][1])]) / 2e-6
        assert H[:, k] == pytest.approx(slope, abs=1e-6)


def test_a_wall_ahead_reads_its_distance_and_direction() -> None:
    z, _ = wall_line(Pose2(1.0, 5.0, math.pi / 2), np.array([8.0, math.pi / 2]), np.zeros(3), 0.0)
    assert z == pytest.approx([3.0, 0.0])
    behind, _ = wall_line(Pose2(1.0, 9.0, math.pi / 2), np.array([8.0, math.pi / 2]), np.zeros(3), math.pi)
    assert behind[0] == pytest.approx(1.0)  # seen from the other side, by its other normal
    assert abs(behind[1]) == pytest.approx(math.pi)
    wrong_side, _ = wall_line(Pose2(1.0, 9.0, math.pi / 2), np.array([8.0, math.pi / 2]), np.zeros(3), 0.0)
    assert wrong_side[0] == pytest.approx(-1.0)


def test_updating_one_after_the_other_is_updating_jointly() -> None:
    """With the scanner at the centre the model is linear, so the joint distance is the stacked one."""
    rng = np.random.default_rng(0)
    pose, cov = np.array([1.0, 0.5, 0.2]), np.diag([0.01, 0.02, 0.003])
    walls = np.array([[4.0, 0.0], [3.0, math.pi / 2], [4.0, -math.pi], [3.0, -math.pi / 2]])
    lines = np.array([wall_line(Pose2.from_array(pose), w, MOUNT, w[1] - 0.2)[0] for w in walls])
    lines += rng.normal(scale=0.05, size=lines.shape)
    covs = np.array([np.diag([1e-3, 2e-3]) + 5e-4 * (np.ones((2, 2)) - np.eye(2)) for _ in walls])
    v, H, R = np.empty(8), np.empty((8, 3)), np.zeros((8, 8))
    for i, wall in enumerate(walls):
        z, H[2 * i : 2 * i + 2] = wall_line(Pose2.from_array(pose), wall, MOUNT, lines[i, 1])
        v[2 * i : 2 * i + 2] = lines[i, 0] - z[0], wrap_to_pi(lines[i, 1] - z[1])
        R[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = covs[i]
    S = H @ cov @ H.T + R
    expected = pose + cov @ H.T @ np.linalg.solve(S, v), cov - cov @ H.T @ np.linalg.solve(S, H @ cov)
    nis = np.empty(4)
    total = joint_association.update_walls(pose, cov, MOUNT, lines, covs, walls, np.arange(4), nis)
    assert total == pytest.approx(v @ np.linalg.solve(S, v), rel=1e-9)
    assert pose == pytest.approx(expected[0], abs=1e-12)
    assert cov == pytest.approx(expected[1], abs=1e-12)
    first = innovation_distance(np.diag([0.01, 0.02, 0.003]), H[:2], v[:2], covs[0])
    assert first == pytest.approx(nis[0], rel=1e-12)


# --- matching -------------------------------------------------------------------------------------------


def walls_nearest(walls: WallLines, points: FloatArray) -> set[int]:
    """Infinite lines of the walls that pass within 5 cm of all points."""
    found = set()
    for k, (rho, alpha) in enumerate(walls.normals):
        if (np.abs(points @ np.array([math.cos(alpha), math.sin(alpha)]) - rho) < 0.05).all():
            found.add(int(walls.line_of[k]))
    return found


def test_in_the_museum_every_match_is_right_from_a_disturbed_pose() -> None:
    rng = np.random.default_rng(2)
    match = matcher(MUSEUM)
    matched = seen = 0
    while seen < 400:
        pose = Pose2(*rng.uniform([0.5, 0.5, -3.1], [39.5, 24.5, 3.1]))
        if MUSEUM.distance_m(pose.x_m, pose.y_m) < 0.4:
            continue
        lines = extractor(seen).extract(scan_of(MUSEUM, pose, rng))
        guess = pose.as_array() + rng.normal(size=3) * np.array([0.1, 0.1, 0.1])
        matches = match.match(guess, np.diag([0.01, 0.01, 0.01]), lines)
        c, s = math.cos(pose.theta_rad), math.sin(pose.theta_rad)
        for i, wall in enumerate(matches.walls):
            seen += 1
            if wall < 0:
                continue
            matched += 1
            ends = lines.ends_m[i].reshape(2, 2) @ np.array([[c, s], [-s, c]]) + [pose.x_m, pose.y_m]
            assert int(match.walls.line_of[wall]) in walls_nearest(match.walls, ends)
    assert matched / seen > 0.9


def test_an_unexpected_wall_is_left_out() -> None:
    room = SegmentMap.of(box_segments(0.0, 0.0, 8.0, 6.0, 0.0))
    world = room.with_obstacles(np.array([[2.0, -1.0, 2.0, 1.0]]), np.zeros((0, 3)))
    lines = extractor().extract(scan_of(world, Pose2(0.0, 0.0, 0.0), np.random.default_rng(0)))
    matches = matcher(room).match(np.zeros(3), TIGHT, lines)
    obstacle = np.flatnonzero(np.abs(lines.rho_alpha[:, 0] - 2.0) < 0.05)
    assert matches.walls[obstacle].tolist() == [UNMATCHED]
    assert matches.count == len(lines) - 1


def test_a_line_must_overlap_its_wall() -> None:
    """The same infinite line, but the map's wall ends before the detected one begins."""
    world = SegmentMap.of(np.array([[-1.0, 2.0, 1.0, 2.0], [3.0, -2.0, 3.0, 1.5]]))
    known = SegmentMap.of(np.array([[4.0, 2.0, 6.0, 2.0], [3.0, -2.0, 3.0, 1.5]]))
    lines = extractor().extract(scan_of(world, Pose2(0.0, 0.0, 0.5), np.random.default_rng(0)))
    matches = matcher(known).match(np.array([0.0, 0.0, 0.5]), TIGHT, lines)
    straight_up = np.abs(lines.rho_alpha[:, 0] - 2.0) < 0.05
    assert straight_up.sum() == 1
    assert matches.walls[straight_up].tolist() == [UNMATCHED]
    assert (matches.walls[~straight_up] >= 0).all()


def test_a_wall_hidden_by_another_is_not_matched() -> None:
    """Where the map says that a nearer wall stands in the way, the farther one cannot be what was seen."""
    far, near = [4.0, -3.0, 4.0, 3.0], [2.0, -3.0, 2.1, 3.0]
    lines = extractor().extract(scan_of(floor_with(far), Pose2(0.0, 0.0, 0.0), np.random.default_rng(0)))
    assert matcher(floor_with(far)).match(np.zeros(3), TIGHT, lines).count == 1
    assert matcher(floor_with(far, near)).match(np.zeros(3), TIGHT, lines).count == 0


def test_two_walls_that_explain_a_line_equally_make_it_ambiguous() -> None:
    """A short wall ahead, a pose known to a metre, and two walls in sight that it may be."""
    seen, left, right = [3.0, -0.5, 3.0, 0.5], [3.25, 0.7, 3.25, 3.0], [2.75, -3.0, 2.75, -0.7]
    lines = extractor().extract(scan_of(floor_with(seen), Pose2(0.0, 0.0, 0.0), np.random.default_rng(0)))
    unsure = np.diag([1.0, 1.0, 1e-4])
    assert matcher(floor_with(left)).match(np.zeros(3), unsure, lines).count == 1
    assert matcher(floor_with(right)).match(np.zeros(3), unsure, lines).count == 1
    both = matcher(floor_with(left, right)).match(np.zeros(3), unsure, lines)
    assert both.walls.tolist() == [AMBIGUOUS]
    # A pose that knows its place sideways tells them apart.
    sure = matcher(floor_with(left, right)).match(
        np.array([0.0, 1.5, 0.0]), np.diag([1.0, 1e-4, 1e-4]), lines
    )
    assert sure.walls.tolist() != [AMBIGUOUS]
    assert sure.count == 1


def test_matching_jointly_refuses_what_each_line_alone_would_allow() -> None:
    """Two walls, each off by two sigma of the prior in ways no single pose explains."""
    known = SegmentMap.of(np.array([[3.0, -2.0, 3.0, 2.0], [-3.0, -2.0, -3.0, 2.0], [-2.5, 2.5, 2.5, 2.5]]))
    world = SegmentMap.of(np.array([[3.1, -2.0, 3.1, 2.0], [-3.1, -2.0, -3.1, 2.0], [-2.5, 2.5, 2.5, 2.5]]))
    lines = extractor().extract(scan_of(world, Pose2(0.0, 0.0, math.pi / 2), np.random.default_rng(0)))
    prior = np.array([0.0, 0.0, math.pi / 2])
    matches = matcher(known).match(prior, np.diag([0.01, 0.01, 1e-4]), lines)
    sides = np.abs(lines.rho_alpha[:, 0] - 3.1) < 0.02
    assert sides.sum() == 2
    assert (matches.walls[sides] >= 0).sum() <= 1


def test_matching_changes_neither_pose_nor_covariance() -> None:
    pose, cov = np.array([1.0, 1.0, 0.0]), np.diag([0.01, 0.01, 0.01])
    lines = extractor().extract(scan_of(MUSEUM, Pose2(1.0, 1.0, 0.0), np.random.default_rng(0)))
    matcher(MUSEUM).match(pose, cov, lines)
    assert pose.tolist() == [1.0, 1.0, 0.0]
    assert (cov == np.diag([0.01, 0.01, 0.01])).all()


def _is_beside(pose: FloatArray, cov: FloatArray, normal: FloatArray, end: FloatArray) -> bool:
    """Whether both ends of a line, in the sensor's frame, are near a wall; the sensor is at the axle."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    points = pose[:2] + end.reshape(2, 2) @ np.array([[c, s], [-s, c]])
    away = np.abs(points @ [math.cos(normal[1]), math.sin(normal[1])] - normal[0]).max()
    reach2 = (end.reshape(2, 2) ** 2).sum(axis=1).max()
    spread = math.sqrt(cov[0, 0] + cov[1, 1] + reach2 * cov[2, 2])
    return bool(away <= BESIDE_M + WallMatchingConfig().sigmas * spread)


@pytest.mark.parametrize(("away", "placed"), [(1.5, 0), (0.2, 1)])
def test_what_stands_in_a_room_is_beside_no_wall(away: float, placed: int) -> None:
    """A box in front of a wall says nothing against a belief; a wall seen 0.2 m off does."""
    hidden = floor_with([0.0, 0.0, 10.0, 0.0], [4.0, away, 5.0, away])
    lines = extractor().extract(scan_of(hidden, Pose2(4.5, 3.0, 0.0), np.random.default_rng(0)))
    sides = np.abs(lines.rho_alpha[:, 0] - (3.0 - away)) < 0.05
    assert sides.sum() == 1
    known = matcher(floor_with([0.0, 0.0, 10.0, 0.0])).match(np.array([4.5, 3.0, 0.0]), TIGHT, lines)
    assert known.walls[sides] == UNMATCHED
    assert known.placed - known.count == placed


@pytest.mark.parametrize("seed", range(6))
def test_walls_that_an_angle_alone_rules_out_change_no_distance(seed: int) -> None:
    """The least of all walls that a line may be or lies beside, however they are ordered."""
    rng = np.random.default_rng(seed)
    true = Pose2(1.0 + 0.3 * seed, 1.0, rng.uniform(-3.0, 3.0))
    lines = extractor(seed).extract(scan_of(MUSEUM, true, rng))
    pose, cov = true.as_array() + rng.normal(0.0, [0.1, 0.1, 0.05]), np.diag([0.02, 0.02, 0.002])
    config, found = WallMatchingConfig(), matcher(MUSEUM)
    matches, walls = found.match(pose, cov, lines), found.walls
    for k, (seen, R, end) in enumerate(zip(lines.rho_alpha, lines.covs, lines.ends_m, strict=True)):
        least = math.inf
        for normal, segment in zip(walls.normals, walls.segments_m, strict=True):
            z, H, v = np.empty(2), np.empty((2, 3)), np.empty(2)
            wall_innovation(pose, MOUNT, normal, seen, z, H, v)
            share = overlap_share(pose, cov, MOUNT, end, normal[1], segment, config.slack_m, config.sigmas)
            nis = innovation_distance(cov, H, v, R)
            if share >= config.overlap and (nis <= found.gate or _is_beside(pose, cov, normal, end)):
                least = min(least, nis)
        assert matches.distances[k] == least
    assert matches.count == (matches.walls >= 0).sum() > 0
    assert matches.farthest == matches.distances[matches.walls >= 0].max()
    assert matches.placed == (np.isfinite(matches.distances) & (matches.walls != AMBIGUOUS)).sum()
