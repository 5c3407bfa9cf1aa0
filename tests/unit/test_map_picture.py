"""The picture of a map: numbers of landmarks that can be read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import pilotage as pl
from pilotage.maps.landmarks import Landmarks
from pilotage.report.map_picture import landmark_labels


def test_landmarks_at_one_place_share_a_label() -> None:
    points = [[0.0, 0.0], [5.0, 0.0], [0.1, 0.0], [5.0, 4.0]]
    labels = landmark_labels(Landmarks(np.array([4, 7, 10, 2]), np.array(points)), apart_m=0.5)
    assert labels == [((0.0, 0.0), "4, 10"), ((5.0, 0.0), "7"), ((5.0, 4.0), "2")]


def test_a_crowd_of_landmarks_says_how_many_more() -> None:
    labels = landmark_labels(Landmarks(np.arange(1, 7), np.zeros((6, 2))), apart_m=0.1)
    assert labels == [((0.0, 0.0), "1, 2, 3 and 3 more")]


def test_the_labels_of_a_map_stand_apart_and_hold_every_landmark() -> None:
    rng = np.random.default_rng(5)
    labels = landmark_labels(Landmarks(np.arange(40), rng.uniform(0.0, 10.0, (40, 2))), apart_m=0.8)
    places = np.array([at for at, _ in labels])
    gaps = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1)) + 10.0 * np.eye(len(places))
    assert gaps.min() >= 0.8
    counted = sum(
        len(label.split(" and ")[0].split(", ")) + (int(label.split()[-2]) if "more" in label else 0)
        for _, label in labels
    )
    assert counted == 40


def test_a_map_is_drawn_beside_its_own_image(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A ROS map's image has the map's name, and a second drawing the first one's: both were refused."""
    cells = np.full((40, 60), 254, np.uint8)
    cells[[0, -1]] = 0
    Image.fromarray(cells).save(tmp_path / "hall.png")
    image = (tmp_path / "hall.png").read_bytes()
    (tmp_path / "hall.yaml").write_text("image: hall.png\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n")
    monkeypatch.chdir(tmp_path)
    assert [str(pl.draw("hall.yaml").path) for _ in range(2)] == ["hall-2.png", "hall-3.png"]
    assert (tmp_path / "hall.png").read_bytes() == image
