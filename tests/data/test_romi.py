"""The real Romi: its printed maps against the published scores, and the film of it on its map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pilotage.evaluation.cell_map_score import score_cell_map
from pilotage.maps.cell_map import CellState
from pilotage.maps.cell_map_text import read_cell_map
from pilotage.maps.true_cells import read_true_map

DATA = Path(__file__).resolve().parents[3] / "shared" / "data" / "romi"

pytestmark = pytest.mark.skipif(
    not DATA.is_dir(), reason="the recordings of the Romi are not on this machine"
)

CORNERS_PX = ((438.0, 848.0), (1572.0, 815.0), (1283.0, 258.0), (539.5, 228.5))
"""Marked by eye on enlarged frames: lower left, lower right, upper right, upper left."""

CENTRES_PX = {
    20: (985.0, 470.8),
    75: (985.0, 470.6),
    110: (982.5, 469.6),
    150: (976.3, 432.4),
    190: (968.5, 402.9),
    230: (990.4, 403.9),
    270: (1069.4, 408.8),
    310: (1073.7, 412.2),
    340: (1080.9, 451.5),
    375: (1082.1, 474.4),
    420: (1046.4, 474.2),
    480: (979.9, 471.6),
}
"""Middle of the disc, marked by eye on enlarged frames that showed no estimate."""


def test_the_true_map_has_the_published_number_of_cells() -> None:
    truth = read_true_map(DATA / "map.yaml")
    assert np.count_nonzero(truth.cells.holds(CellState.OBSTACLE)) == 72
    assert np.count_nonzero(truth.cells.holds(CellState.LINE)) == 38


@pytest.mark.parametrize(
    ("name", "features", "of", "free_of"),
    [
        ("WithoutSensorFusion_WithoutObstacleAvoidance", 11, 75, 285),
        ("WithSensorFusion_WithoutObstacleAvoidance_V2", 25, 76, 292),
        ("WithoutSensorFusion_WithObstacleAvoidance", 9, 81, 287),
        ("WithSensorFusion_WithObstacleAvoidance", 16, 70, 268),
        ("Base", 10, 24, 68),
    ],
)
def test_the_printed_maps_score_as_published(name: str, features: int, of: int, free_of: int) -> None:
    printed = read_cell_map(DATA / "robot_maps" / f"{name}.txt")
    score = score_cell_map(printed, read_true_map(DATA / "map.yaml"))
    assert (score.features.correct, score.features.of) == (features, of)
    assert score.free.of == free_of


def test_the_film_is_tracked() -> None:
    pytest.importorskip("cv2", reason="OpenCV is not installed (pilotage[vision])")
    from pilotage.tracking.scene import TrackOptions, learn_scene
    from pilotage.tracking.track import follow

    film = DATA / "romi_on_map.mp4"
    track = follow(film, learn_scene(film, TrackOptions()))
    assert track.frames == 518
    assert len(track.path.frames) >= 0.99 * 518
    assert np.abs(track.scene.sheet.corners_px - np.array(CORNERS_PX)).max() < 4.0
    index = {int(frame): i for i, frame in enumerate(track.path.frames)}
    off_px = [np.hypot(*(track.path.points_px[index[frame]] - at)) for frame, at in CENTRES_PX.items()]
    assert np.median(off_px) < 3.0
    assert max(off_px) < 12.0
    truth = read_true_map(DATA / "map.yaml")
    score = score_cell_map(track.scene.marks.cells, truth)
    assert score.observable.ratio > 0.85
