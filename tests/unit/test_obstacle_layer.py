"""The obstacle layer: what it sees through it forgets, what stands it keeps."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.core.random import RandomStreams
from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.scans.rays import fan_ranges
from pilotage.kernels.scans.unexpected import seen_through
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, Readings
from pilotage.stack.interface import Belief
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.mapping.obstacle_layer import ObstacleLayer, ObstacleLayerConfig

LIDAR = LidarConfig(beams=271, max_range_m=8.0)
ROBOT = RobotKnowledge(
    Footprint.disc(0.3), DifferentialDriveConfig(), {"lidar": LIDAR}, 0.1, RandomStreams(0, "robot")
)
WALLS = np.array([[6.0, -6.0, 6.0, 6.0]])
BELIEF = Belief(Pose2(0.0, 0.0, 0.0), 1e-6 * np.eye(3))


def scanned(layer: ObstacleLayer, circles: FloatArray, count: int) -> int:
    """So many scans of a wall and discs; how many discs are on the map then."""
    angles = LIDAR.beam_angles_rad()
    ranges = fan_ranges(0.0, 0.0, float(angles[0]), LIDAR.beam_step_rad, 271, 8.0, WALLS, circles)
    for k in range(count):
        layer.step(Readings(0.1 * k, {"lidar": LidarScan(ranges)}), BELIEF)
    return len(layer.circles_m)


@pytest.mark.parametrize("forget_scans", [3, 0])
def test_who_walks_on_is_forgotten_and_what_stands_is_kept(forget_scans: int) -> None:
    chart = WorldMap("floor", (-7.0, -7.0, 7.0, 7.0))
    layer = ObstacleLayer(ObstacleLayerConfig(forget_scans=forget_scans), ROBOT, chart)
    post, person = np.array([[2.0, 0.5, 0.1]]), np.array([[1.5, -0.6, 0.25]])
    both = scanned(layer, np.vstack([post, person]), 5)
    alone = scanned(ObstacleLayer(ObstacleLayerConfig(), ROBOT, chart), post, 5)
    assert both > alone > 0
    assert scanned(layer, post, 2) == both  # not at once
    assert scanned(layer, post, 40) == (alone if forget_scans else both)
    if forget_scans:
        assert np.hypot(*(layer.circles_m[:, :2] - post[0, :2]).T).max() < 0.2
        assert scanned(layer, np.vstack([post, person]), 5) == both  # and found again
        behind = np.array([[-1.5, 0.0, 0.25]])
        count = scanned(layer, np.vstack([post, person, behind]), 5)
        assert count == both  # the laser does not see it


def test_a_laser_that_is_wrong_now_and_then_puts_nothing_on_the_map() -> None:
    """A twentieth of its beams, anywhere nearer than what they meet: many a cell is hit thrice in the end."""
    chart, rng = WorldMap("floor", (-7.0, -7.0, 7.0, 7.0)), np.random.default_rng(0)
    angles = LIDAR.beam_angles_rad()
    post = np.array([[2.0, 0.5, 0.1]])
    truly_m = fan_ranges(0.0, 0.0, float(angles[0]), LIDAR.beam_step_rad, 271, 8.0, WALLS, post)
    layer, keeps = (ObstacleLayer(ObstacleLayerConfig(forget_scans=scans), ROBOT, chart) for scans in (3, 0))
    most = 0
    for k in range(600):
        wrong = rng.random(271) < 0.05
        ranges_m = np.where(wrong, np.maximum(truly_m - rng.uniform(0.0, 3.0, 271), 0.0), truly_m)
        for one in (layer, keeps):
            one.step(Readings(0.1 * k, {"lidar": LidarScan(ranges_m)}), BELIEF)
        most = max(most, int((np.hypot(*(layer.circles_m[:, :2] - post[0, :2]).T) > 0.3).sum()))
    assert most == 0
    assert len(layer.circles_m) > 2
    assert (np.hypot(*(keeps.circles_m[:, :2] - post[0, :2]).T) > 0.3).sum() > 5


def test_nothing_stands_in_the_robot() -> None:
    layer = ObstacleLayer(ObstacleLayerConfig(), ROBOT, WorldMap("floor", (-7.0, -7.0, 7.0, 7.0)))
    ranges_m = np.full(271, 5.0)
    ranges_m[::9] = 0.0
    for k in range(4):
        layer.step(Readings(0.1 * k, {"lidar": LidarScan(ranges_m)}), BELIEF)
        assert not (np.hypot(*layer.circles_m[:, :2].T) < 1.0).any()


def test_a_pole_that_few_beams_meet_is_believed_all_the_same() -> None:
    """2 cm thick, 2.5 m away, between beams 4.4 cm apart there: the robot comes nearer."""
    chart, pole = WorldMap("floor", (-7.0, -7.0, 7.0, 7.0)), np.array([[2.5, 0.02, 0.01]])
    layer, angles = ObstacleLayer(ObstacleLayerConfig(), ROBOT, chart), LIDAR.beam_angles_rad()
    for k in range(40):
        x = 0.03 * k
        ranges_m = fan_ranges(x, 0.0, float(angles[0]), LIDAR.beam_step_rad, 271, 8.0, WALLS, pole)
        belief = Belief(Pose2(x, 0.0, 0.0), 1e-6 * np.eye(3))
        layer.step(Readings(0.1 * k, {"lidar": LidarScan(ranges_m)}), belief)
    assert (np.hypot(*(layer.circles_m[:, :2] - pole[0, :2]).T) < 0.05).any()


def test_only_what_all_beams_pass_is_seen_through() -> None:
    disc = np.array([[2.0, 0.0, 0.03]])

    def gone(ranges: list[float], discs: FloatArray = disc, spread: float = 0.0) -> bool:
        return bool(
            seen_through(discs, np.array(ranges), 0.0, 0.0, -0.02, 0.01, 5.0, 0.3, spread, 0.0, 20.0)[0]
        )

    assert gone([9.0] * 5)
    assert not gone([2.0] * 5)
    assert not gone([2.2] * 5)  # too near behind it
    assert not gone([9.0, 9.0, 9.0, 1.0, 9.0])  # something in front of a part of it
    assert gone([1.0, 9.0, 9.0, 9.0, 1.0])  # beside it
    assert not gone([1.0, 9.0, 9.0, 9.0, 1.0], spread=0.01)  # which may be where it is
    assert not gone([9.0] * 5, np.array([[2.0, 1.0, 0.03]]))  # no beam goes there
    assert not gone([9.0] * 5, np.array([[-2.0, 0.0, 0.03]]))
    assert not gone([9.0] * 5, np.array([[5.5, 0.0, 0.03]]))  # out of reach
