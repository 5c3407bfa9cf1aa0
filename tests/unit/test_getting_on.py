"""Who gets no nearer to where it is to go is noticed, standing or driving about; and where walls are."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.kernels.grids.most_room import most_room
from pilotage.sensors.lidar import LidarConfig
from pilotage.stack.mapping.scan_grid import BeamEnds, ScanGrid, echoes
from pilotage.stack.navigator.floor_explorer.getting_on import GettingOn
from support.laser_rooms import furnished, ranges

TARGET = np.array([10.0, 0.0])


def straight(here: np.ndarray, target: np.ndarray = TARGET) -> np.ndarray:
    return np.linspace(here, target, 50)


def test_who_drives_to_and_fro_gets_on_no_more_than_who_stands() -> None:
    """A door that the local controller took for closed and the path for open held one for minutes."""
    standing, swaying, driving = (GettingOn(np.zeros(2), 1.0) for _ in range(3))
    for k in range(31):
        here = np.array([2.0, 0.0])
        stood_s = standing.stalled_s(float(k), here, TARGET, straight(here))
        here = np.array([2.0 - 0.9 * (k % 2), 0.0])
        swayed_s = swaying.stalled_s(float(k), here, TARGET, straight(here))
        here = np.array([0.2 * k, 0.0])
        drove_s = driving.stalled_s(float(k), here, TARGET, straight(here))
    assert stood_s == 30.0
    assert swayed_s == 15.0
    assert drove_s <= 2.0
    swaying.stall(30.0)
    assert swaying.stalls == 1
    assert swaying.stalled_s(31.0, here, TARGET, straight(np.array([1.1, 0.0]))) <= 1.0
    assert swaying.stalls == 1
    swaying.stalled_s(32.0, here, TARGET, straight(np.array([3.0, 0.0])))
    assert swaying.stalls == 0


def test_a_way_that_grows_with_the_map_and_another_target_count_anew() -> None:
    for later in (np.concatenate([straight(np.zeros(2)), straight(TARGET, np.array([10.0, 9.0]))]), None):
        watch = GettingOn(np.zeros(2), 1.0)
        for k in range(21):
            here = np.array([0.5 * (k % 2), 0.0])
            watch.stalled_s(float(k), here, TARGET, straight(here))
        other = np.array([5.0, 8.0])
        path = straight(here, other) if later is None else later
        assert watch.stalled_s(21.0, here, other if later is None else TARGET, path) < 2.0


def test_the_place_with_the_most_room_is_as_far_from_points_as_it_is_from_all_of_them() -> None:
    rng = np.random.default_rng(353)
    points, middles = rng.uniform(0.0, 4.0, (300, 2)), rng.uniform(-0.5, 4.5, (200, 2))
    offsets = rng.uniform(-0.05, 0.05, (20, 2))
    away = np.hypot(*np.moveaxis((middles[:, None] + offsets)[:, :, None] - points, 3, 0)).min(axis=2)
    np.testing.assert_allclose(most_room(middles, offsets, 3.0, points, 0.1), away.max(axis=1), atol=1e-12)
    near = most_room(middles, offsets, 0.05, points, 0.1)
    alone = np.hypot(*np.moveaxis(middles[:, None] - points, 2, 0)).min(axis=1) > 0.05
    np.testing.assert_array_equal(np.isinf(near), alone)
    assert np.isinf(most_room(middles, offsets, 3.0, np.zeros((0, 2)), 0.1)).all()


def test_where_beams_ended_is_the_same_scan_by_scan_and_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """And each scan is looked at once: all of them anew took a tenth of a second whenever one was added."""
    looked_at: list[int] = []
    add = BeamEnds._add

    def counted(self: BeamEnds, ranges_m: np.ndarray, poses: np.ndarray) -> None:
        looked_at.append(len(ranges_m))
        add(self, ranges_m, poses)

    monkeypatch.setattr(BeamEnds, "_add", counted)
    scanner = LidarConfig(beams=180, max_range_m=12.0)
    walls, angles = furnished(), scanner.beam_angles_rad()
    poses = np.array([[2.0, 3.5, 0.2], [8.0, 2.0, 2.0], [5.0, 3.5, -2.0], [4.0, 5.0, 1.0]])
    moved = poses - [30.0, 20.0, 0.3]

    def grid_of(kept: np.ndarray, asked: bool) -> ScanGrid:
        grid = ScanGrid(scanner, 0.05)
        for pose, at in zip(kept, poses, strict=False):
            seen = ranges(walls, at, angles)
            grid.add(echoes(np.where(np.isfinite(seen), seen, 12.0), scanner), pose)
            if asked:
                grid.wall_points()
        return grid

    def rows(grid: ScanGrid) -> np.ndarray:
        points = np.round(grid.wall_points(), 9)
        return points[np.lexsort(points.T)]

    grown = grid_of(poses, asked=True)
    assert looked_at == [1, 1, 1, 1]
    np.testing.assert_array_equal(rows(grown), rows(grid_of(poses, asked=False)))
    grown.move(moved)
    assert len(rows(grown)) > 100
    np.testing.assert_array_equal(rows(grown), rows(grid_of(moved, asked=False)))
    grown.keep(2)
    np.testing.assert_array_equal(rows(grown), rows(grid_of(moved[:2], asked=False)))
