"""The picture of a map: numbers of landmarks that can be read."""

from __future__ import annotations

import numpy as np

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
