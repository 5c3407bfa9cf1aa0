"""What an odometry tells beside alignments: as sure as it was, nothing where it slipped, to the last word."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from pilotage.core.types import FloatArray, IntArray
from pilotage.kernels.slam.frames import between, composed
from pilotage.stack.mapping.slam.back_end import track_edges, weak_edges
from pilotage.stack.mapping.slam.clouds import Clouds
from pilotage.stack.mapping.slam.odometry_record import OdometryRecord, ToldByOdometry
from pilotage.stack.mapping.slam.tracker import LocalTrack
from pilotage.stack.mapping.slam.uncertainty import Edges, fused, relative_poses

WALL, CORNER = np.diag([0.5, 90.0, 60.0]), np.diag([40.0, 90.0, 60.0])
"""Hessians along x: a bare wall, which holds there by chance alone, and walls all round."""
STEP = np.array([0.25, 0.0, 0.0])
SURE = np.diag([1e4, 1e4, 1e4])


def driven(count: int, rng: np.random.Generator) -> list[FloatArray]:
    """Poses (3,) each of a robot on its way, 5 cm from scan to scan."""
    poses = [np.zeros(3)]
    for turn in 0.05 * rng.standard_normal(count - 1):
        poses.append(np.asarray(composed(poses[-1], np.array([0.05, 0.0, turn]))))
    return poses


def recorded(poses: list[FloatArray], off: FloatArray, std: FloatArray, seed: int) -> OdometryRecord:
    """What a record holds of an odometry that is always off by shares (3,) and by chance (3,) a scan."""
    rng, record = np.random.default_rng(seed), OdometryRecord()
    for a, b in pairwise(poses):
        step = between(a, b)
        told = step * (1.0 + off[0]) + [0.0, 0.0, off[1] * step[0] + (off[2] - off[0]) * step[2]]
        record.add(told + std * rng.standard_normal(3))
    return record


def two(hessian: FloatArray, aligned: FloatArray, told: FloatArray, alone: bool = False) -> LocalTrack:
    """A track of two keyframes by their alignment, and what the odometry told."""
    edges = Edges(np.zeros(1, np.int64), np.ones(1, np.int64), told[None], SURE[None], np.zeros(1, np.bool_))
    return LocalTrack(
        np.array([np.zeros(3), aligned]),
        np.arange(2),
        np.arange(2),
        Clouds.of([]),
        np.array([hessian, hessian]),
        np.zeros((2, 3, 3)),
        np.zeros(0, np.int64),
        odometry=ToldByOdometry(edges, np.array([alone])),
    )


def test_the_last_word_takes_all_that_an_odometry_tells() -> None:
    """Beside alignments of all with all it counted a fiftieth: maps of a short laser were bent."""
    track = two(WALL, STEP, STEP)
    assert (np.linalg.eigvalsh(weak_edges(track).information[0] - SURE) > 0.0).all()
    # Where the track hangs by the odometry already it counts once, not twice.
    alone = two(np.zeros((3, 3)), STEP, STEP, alone=True)
    assert weak_edges(alone).information[0, 0, 0] < 1.1 * SURE[0, 0]
    assert track_edges(alone).information[0, 0, 0] < 0.1 * SURE[0, 0]


def test_odometry_leads_along_a_bare_wall_and_is_left_out_where_walls_all_round_contradict_it() -> None:
    """Along a bare wall an alignment jumped by 1.8 m and was believed; a wheel may spin in a room."""
    jumped = np.array([1.4, 0.0, 0.0])
    np.testing.assert_allclose(track_edges(two(WALL, jumped, STEP)).relative[0], STEP, atol=0.08)
    alone = replace(two(CORNER, jumped, STEP), odometry=None)
    np.testing.assert_allclose(
        track_edges(two(CORNER, jumped, STEP)).relative, track_edges(alone).relative, atol=1e-12
    )
    np.testing.assert_allclose(
        track_edges(two(CORNER, jumped, STEP)).information, track_edges(alone).information
    )


def test_on_the_way_an_odometry_does_not_add_its_noise_to_what_walls_all_round_hold() -> None:
    """An explorer of the museum ended 0.12 m from its start, and 0.03 m without it."""
    near = np.array([0.26, 0.0, 0.002])
    track = two(CORNER, STEP, near)
    np.testing.assert_allclose(track_edges(track).relative[0], STEP, atol=1e-12)
    assert np.abs(weak_edges(track).relative[0] - near).max() < 0.5 * 0.01


def test_two_edges_in_one_are_their_mean_by_information() -> None:
    at: IntArray = np.zeros(1, np.int64)
    a = Edges(at, at + 1, np.array([[1.0, 0.5, 3.1]]), np.diag([1e4, 4e4, 1e4])[None], at.astype(np.bool_))
    b = replace(a, relative=np.array([composed(a.relative[0], np.array([0.01, 0.02, 0.1]))]))
    both = fused(a, replace(b, information=3.0 * a.information))
    np.testing.assert_allclose(
        relative_poses(a.relative, both.relative), [[0.0075, 0.015, 0.075]], atol=1e-12
    )
    np.testing.assert_allclose(both.information, 4.0 * a.information)
    assert -np.pi <= both.relative[0, 2] < np.pi


@pytest.mark.parametrize("share", [0.0, 0.04])
def test_what_an_odometry_is_always_off_by_is_righted_where_it_is_no_chance(share: float) -> None:
    """Who rights what is right adds the error of what was learnt, and that adds up over a long way."""
    poses, off = driven(4000, np.random.default_rng(1)), np.array([share, share, share])
    record = recorded(poses, off, np.array([0.002, 0.0, 0.001]), 2)
    edges = record.told(np.arange(0, 4000, 5), poses).edges
    true = np.array([poses[k] for k in range(0, 4000, 5)])
    raw = np.array([record.poses[k] for k in range(0, 4000, 5)])
    assert np.allclose(edges.relative, relative_poses(raw[:-1], raw[1:])) == (share == 0.0)
    left = relative_poses(relative_poses(true[:-1], true[1:]), edges.relative)
    # Chance alone leaves 0.13 m and 0.06 rad of 200 m and 200 rad (one standard deviation).
    assert abs(left[:, 0].sum()) < 0.5
    assert abs(left[:, 2].sum()) < 0.25
    squares = np.einsum("mi,mij,mj->m", left, edges.information, left)
    assert 0.1 < squares.mean() < 3.0


def test_lengths_may_be_off_by_what_wheels_are_until_stretches_say_less() -> None:
    """A corridor was as long as the odometry's chance alone left it, whatever its wheels."""
    poses, off = driven(4000, np.random.default_rng(1)), np.array([0.04, 0.0, 0.0])
    record = recorded(poses, off, np.array([0.002, 0.0, 0.001]), 2)
    stds = [record.told(np.arange(0, k, 5), poses[:k]).scale_std for k in (6, 600, 3900)]
    assert stds[0] == pytest.approx(0.03)
    assert stds[0] > 3.0 * stds[1] > 3.0 * stds[2]
    assert stds[2] < 0.003


def test_who_turns_on_the_spot_learns_nothing_of_lengths() -> None:
    """Its stretches are off by nothing along its way: eleven of them made chance look like a scale of 1 %."""
    rng, poses = np.random.default_rng(7), driven(60, np.random.default_rng(6))
    for _ in range(2000):
        poses.append(np.asarray(composed(poses[-1], np.array([0.0002, 0.0, 0.05]))))
    record, record.poses = OdometryRecord(), [np.zeros(3)]
    for k, (a, b) in enumerate(pairwise(poses)):
        step = between(a, b)
        record.add(step + np.array([0.004 * rng.standard_normal() * (k < 60), 0.0, 0.0]))
    alone = recorded(poses[:60], np.zeros(3), np.array([0.004, 0.0, 0.0]), 7)
    least = alone.told(np.arange(0, 60, 5), poses[:60]).edges.information[0, 0, 0]
    told = record.told(np.arange(0, 60, 5), poses)
    assert told.edges.information[0, 0, 0] < 3.0 * least
    assert told.scale_std > 0.005


def test_stretches_that_scans_leave_open_do_not_speak_for_the_odometry() -> None:
    """Along a bare wall a scan is found where the odometry led it: it was as sure as to the millimetre."""
    poses = driven(1000, np.random.default_rng(3))
    record = recorded(poses, np.zeros(3), np.array([0.004, 0.0, 0.001]), 4)
    for scan in range(100, 1000):
        record.leave_open(scan)
    found = [*poses[:100]]
    for k in range(100, 1000):
        found.append(np.asarray(composed(found[-1], between(record.poses[k - 1], record.poses[k]))))
    held = 1.0 / record.told(np.arange(0, 1000, 5), found).edges.information[0, 0, 0]
    # In truth 0.004 m a scan, 1.8 cm a metre; 100 scans that held tell it to a factor.
    assert held > 0.3 * 5 * 0.004**2


def test_a_scan_that_fits_nowhere_though_it_should_tells_nothing_of_the_odometry() -> None:
    poses = driven(200, np.random.default_rng(5))
    record = recorded(poses, np.zeros(3), np.full(3, 0.001), 6)
    record.lose(103)
    record.slip(153, STEP, poses[:153])
    told = record.told(np.arange(0, 200, 10), poses)
    untold = ~told.edges.information.any(axis=(1, 2))
    assert np.flatnonzero(untold).tolist() == [10]
    assert np.flatnonzero(told.alone).tolist() == [15]
