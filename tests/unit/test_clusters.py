"""Clusters of scan points: the fast way gives exactly what the single-linkage tree gives."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.types import Pose2
from pilotage.experiments.build.charts import load_chart
from pilotage.kernels.lines.clustering import DROPPED, beam_directions, scan_clusters
from pilotage.sensors.lidar import LidarConfig
from support.linkage import linkage_clusters
from support.walls import scan_of

MUSEUM = load_chart("museum").walls


@settings(max_examples=200)
@given(
    st.integers(0, 100_000),
    st.sampled_from([0.2, 1.0, math.radians(90), math.radians(270), math.radians(350), 2 * math.pi]),
    st.integers(1, 60),
    st.sampled_from([0.05, 0.3, 0.5, 2.0]),
    st.sampled_from([0.6, 3.0, 25.0]),
    st.integers(2, 5),
)
def test_window_and_tree_agree_on_any_scan(
    seed: int, field: float, beams: int, cutoff: float, reach: float, least: int
) -> None:
    """Also where near points reach across the blind sector, or most readings are no returns."""
    rng = np.random.default_rng(seed)
    lidar = LidarConfig(beams=beams, field_of_view_rad=field)
    ranges = rng.uniform(0.0, reach, beams)
    angles = lidar.beam_angles_rad()
    points = beam_directions(float(angles[0]), lidar.beam_step_rad, beams) * ranges[:, None]
    fast = scan_clusters(ranges, points, lidar.beam_step_rad, 19.9, cutoff, least)
    assert (fast == linkage_clusters(ranges, points, 19.9, cutoff, least)).all()


def test_window_and_tree_agree_in_the_museum() -> None:
    rng = np.random.default_rng(3)
    lidar = LidarConfig()
    directions = beam_directions(float(lidar.beam_angles_rad()[0]), lidar.beam_step_rad, lidar.beams)
    for _ in range(40):
        x, y, theta = rng.uniform([0.3, 0.3, -3.1], [39.7, 24.7, 3.1])
        ranges = scan_of(MUSEUM, Pose2(x, y, theta), rng)
        points = directions * ranges[:, None]
        fast = scan_clusters(ranges, points, lidar.beam_step_rad, 19.9, 0.5, 10)
        assert (fast == linkage_clusters(ranges, points, 19.9, 0.5, 10)).all()


def test_far_readings_and_small_clusters_are_dropped() -> None:
    ranges = np.array([1.0, 1.0, 1.0, 19.95, 5.0, 5.0])
    points = beam_directions(0.0, 0.01, 6) * ranges[:, None]
    labels = scan_clusters(ranges, points, 0.01, 19.9, 0.5, 3)
    assert labels.tolist() == [0, 0, 0, DROPPED, DROPPED, DROPPED]


def test_a_scan_without_returns_has_no_clusters() -> None:
    ranges = np.full(9, 20.0)
    points = beam_directions(0.0, 0.01, 9) * ranges[:, None]
    assert (scan_clusters(ranges, points, 0.01, 19.9, 0.5, 1) == DROPPED).all()
    assert (linkage_clusters(ranges, points, 19.9, 0.5, 1) == DROPPED).all()
