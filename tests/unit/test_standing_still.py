"""Localizers of robots that stand: scans from one place err alike."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pilotage.core.config import Config
from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.sensors.readings import LidarScan
from pilotage.sim.source import Simulator
from pilotage.sim.worlds.world import World
from pilotage.stack.localization.ekf_walls import EkfWallsConfig, EkfWallsLocalizer
from pilotage.stack.localization.localizer import Localizer
from pilotage.stack.localization.particle_filter import MclConfig, ParticleFilterLocalizer
from support.robots import sensors, told_of
from support.worlds import ROOM_MAP, robot


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("factory", "config"),
    [(ParticleFilterLocalizer, MclConfig()), (EkfWallsLocalizer, EkfWallsConfig())],
    ids=["particle-filter", "ekf-walls"],
)
def test_who_stands_is_told_nothing_new_by_walls(
    factory: Callable[..., Localizer], config: Config, seed: int
) -> None:
    """Each of hundreds of scans counted: it was sure to 0.1 mm, and off by as much or more."""
    told = told_of(start=Pose2(2.0, 2.0 + seed, 0.0), variances=(1e-4, 1e-4, 1e-4), seed=seed)
    localizer = told.localizer(factory, config)
    body = robot(sensors(), start=told.initial.pose, seed=seed)
    disc = np.array([[3.2, 2.6 + seed, 0.2]])
    sim = Simulator(World.of(ROOM_MAP, obstacle_circles_m=disc), [body], told.robot.dt_s)
    beliefs = [localizer.step(sim.step([Twist(0.3 * (k < 20), 0.0)])[0]) for k in range(300)]
    error = sim.bodies[0].pose.as_array() - beliefs[-1].pose.as_array()
    assert (beliefs[-1].cov >= 0.999 * beliefs[60].cov)[np.diag_indices(3)].all()
    assert error @ np.linalg.solve(beliefs[-1].cov, error) < 16.3
    assert np.hypot(error[0], error[1]) < 2e-3


def test_who_stands_takes_in_what_was_hidden_and_what_odometry_does_not_tell() -> None:
    """Walls that somebody hid are new to a robot that stands, and scans where its odometry is silent."""
    told = told_of(start=Pose2(2.0, 2.0, 0.0), variances=(1e-4, 1e-4, 1e-4))
    localizer = told.localizer(EkfWallsLocalizer, EkfWallsConfig())
    sim = Simulator(World.of(ROOM_MAP), [robot(sensors(), start=told.initial.pose)], told.robot.dt_s)

    def spreads(steps: int, *, hidden: bool = False, silent: bool = False) -> FloatArray:
        for _ in range(steps):
            readings = sim.step([Twist(0.0, 0.0)])[0]
            by_sensor = dict(readings.by_sensor)
            if silent:
                del by_sensor["odometry"]
            scan = by_sensor.get("lidar")
            if hidden and isinstance(scan, LidarScan):
                # Somebody stands before all beams but those to one wall.
                ranges_m = scan.ranges_m.copy()
                ranges_m[len(ranges_m) // 3 :] = np.nan
                by_sensor["lidar"] = replace(scan, ranges_m=ranges_m)
            belief = localizer.step(replace(readings, by_sensor=by_sensor))
        return np.sqrt(np.diag(belief.cov))

    before = spreads(60, hidden=True)
    assert spreads(60, hidden=True) == pytest.approx(before)
    after = spreads(60)
    assert (after < 0.7 * before).any()
    assert (after <= before).all()
    assert spreads(60) == pytest.approx(after)
    assert (spreads(5, silent=True) < 20.0 * after).all()
    assert (spreads(60) < 3.0 * after).all()
