"""What an odometry is always off by is learnt from scans, and does not bend a track."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.frames import between, composed
from pilotage.kernels.slam.wheels import (
    A_METRE_STD_RAD,
    CREDIBLE_STDS,
    SCALE_STD,
    learn_wheels,
    righted,
    unknown_wheels,
)
from pilotage.stack.mapping.slam.clouds import cloud_of_beams
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.tracker import Tracker
from support.laser_rooms import ranges

OFF = np.array([-0.04, 0.05, -0.03])


def told(motion: FloatArray) -> FloatArray:
    """What wheels tell of a motion that are off by ``OFF``."""
    x = motion[0] / (1.0 + OFF[0])
    return np.array([x, motion[1] / (1.0 + OFF[0]), (motion[2] - OFF[1] * x) / (1.0 + OFF[2])])


def test_what_is_always_off_is_learnt() -> None:
    rng, wheels = np.random.default_rng(0), unknown_wheels()
    for _ in range(600):
        motion = np.array([rng.uniform(0.0, 0.2), 0.0, rng.choice([0.0, rng.uniform(-0.2, 0.2)])])
        seen = motion + rng.standard_normal(3) * (0.005, 0.005, 0.002)
        learn_wheels(wheels, righted(wheels, told(motion)), seen, True)
    np.testing.assert_allclose(wheels.off, OFF, atol=0.004)
    motion = np.array([0.3, 0.01, 0.1])
    np.testing.assert_allclose(righted(wheels, told(motion)), motion, atol=0.003)


def test_wrong_stamps_are_no_lengths() -> None:
    # By least squares these motions and turns are 0.3 too long: no wheels are, so none is righted.
    rng, wheels = np.random.default_rng(2), unknown_wheels()
    late = 0.6 * rng.standard_normal(3001)
    for k in range(3000):
        motion = np.array([0.05, 0.0, 0.04 * np.sin(0.02 * k)])
        wrong = 1.0 + late[k + 1] - late[k]
        learn_wheels(wheels, righted(wheels, told(wrong * motion)), motion, True)
        assert np.abs(wheels.off / (SCALE_STD, A_METRE_STD_RAD, SCALE_STD)).max() <= CREDIBLE_STDS
    assert (wheels.off == 0.0).all()


def test_a_length_that_no_wall_tells_is_not_learnt_nor_is_a_slip() -> None:
    wheels = unknown_wheels()
    for _ in range(100):
        learn_wheels(wheels, np.array([0.1, 0.0, 0.0]), np.array([0.09, 0.0, 0.001]), False)
        learn_wheels(wheels, np.array([0.1, 0.0, 0.0]), np.array([0.1, 0.0, 0.4]), True)
    assert wheels.off[0] == 0.0
    assert wheels.off[1] > 0.005
    assert abs(wheels.off[2]) < 0.005


def corridor(length_m: float) -> FloatArray:
    """Walls of a corridor 2 m wide with doors in niches, no two distances alike."""
    rng, walls = np.random.default_rng(3), []
    for y, out in ((-1.0, -0.2), (1.0, 0.2)):
        corners, x = [(-2.0, y)], -2.0
        while x < length_m:
            x += float(rng.uniform(1.5, 4.0))
            corners += [(x, y), (x, y + out), (x + 1.0, y + out), (x + 1.0, y)]
            x += 1.0
        walls += [(*a, *b) for a, b in pairwise([*corners, (length_m + 6.0, y)])]
    return np.array([*walls, (length_m + 6.0, -1.0, length_m + 6.0, 1.0)])


def test_wheels_that_turn_aside_do_not_bend_a_corridor() -> None:
    # Without what is learnt a twentieth of their turn stays in the track: 0.05 rad after 40 m.
    rng, walls, angles = np.random.default_rng(1), corridor(40.0), np.radians(np.arange(-90.0, 91.0))
    tracker, pose = Tracker(SlamConfig()), np.zeros(3)
    step = np.array([0.25, 0.0, 0.0])
    for k in range(161):
        seen = ranges(walls, pose, angles) + 0.01 * rng.standard_normal(angles.size)
        cloud = cloud_of_beams(seen, angles, float(angles[1] - angles[0]), 25.0)
        tracker.add(cloud, told(step) if k else np.zeros(3), 0.5, 0.5)
        pose = composed(pose, step)
    off = between(composed(np.zeros(3), 160 * step), tracker.pose)
    assert abs(off[2]) < 0.015
    assert abs(off[1]) < 0.3
