"""Along corridors scans tell nothing of how far a robot came: it is as unsure there as its wheels are."""

from __future__ import annotations

import numpy as np
import pytest

from pilotage.core.types import FloatArray
from pilotage.kernels.slam.frames import between
from pilotage.stack.mapping.slam.clouds import cloud_of
from pilotage.stack.mapping.slam.config import SlamConfig
from pilotage.stack.mapping.slam.online import OnlineSlam
from support.laser_rooms import along, recording, room

DISTANCE_VAR_M2_PER_M = 1.3e-4


def corridor() -> FloatArray:
    """Two rooms of 5 m with 40 m of a bare corridor between them."""
    west, east = room(0.0, 0.0, 5.0, 5.0), room(45.0, 0.0, 50.0, 5.0)
    doors = [(5.0, 0.0, 5.0, 1.5), (5.0, 3.5, 5.0, 5.0), (45.0, 0.0, 45.0, 1.5), (45.0, 3.5, 45.0, 5.0)]
    bare = [(5.0, 1.5, 45.0, 1.5), (5.0, 3.5, 45.0, 3.5)]
    return np.array([*west[:1], *west[2:], *east[:3], *doors, *bare, (1.0, 3.6, 1.8, 3.6)])


def driven(seed: int, scale: float) -> tuple[FloatArray, FloatArray]:
    """Errors (N, 3) and covariances (N, 3, 3) of a robot that drives there and back."""
    rng = np.random.default_rng(seed)
    path = along([(1.0, 2.5), (4.0, 1.2), (2.5, 2.5), (47.5, 2.5), (2.5, 2.5)])
    log = recording(corridor(), path, rng, range_std_m=0.003, drift=0.0)
    slam, errors, covariances = OnlineSlam(SlamConfig()), [], []
    for k in range(len(path)):
        step = between(path[max(0, k - 1)], path[k])
        chance = np.sqrt(DISTANCE_VAR_M2_PER_M * abs(step[0])) * rng.standard_normal()
        step[0] += scale * step[0] + chance
        slam.add(cloud_of(log, k, 25.0), step, 0.2)
        errors.append(between(between(path[0], path[k]), slam.pose))
        turn = between(path[0], path[k])[2]
        c, s = np.cos(turn), np.sin(turn)
        own = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        covariances.append(own @ slam.pose_covariance @ own.T)
    return np.array(errors), np.array(covariances)


@pytest.mark.parametrize("scale", [0.0, 0.02])
def test_a_corridor_is_as_long_as_wheels_tell_and_no_surer(scale: float) -> None:
    """Closures across the corridor made it sure along it: 0.2 m off after 90 m, and sure to 0.02 m."""
    errors, covariances = driven(1, scale)
    squares = np.einsum("ki,ki->k", errors, np.linalg.solve(covariances, errors[:, :, None])[:, :, 0])
    assert squares[1:].mean() < 6.0
    # Seven metres before its room, 80 m of chance behind it.
    returning = len(errors) - 120
    assert covariances[returning, 0, 0] > 0.5 * 80.0 * DISTANCE_VAR_M2_PER_M
    assert np.abs(errors[:, 1:]).max() < 0.05
