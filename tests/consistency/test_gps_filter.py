"""Consistency of `ekf-gps`, the filter on position fixes: with a compass, without, and told too little.

False-alarm rates: NEES of 40 drives at a step is chi-square with 120 degrees of freedom over 40; a band of
99.9 % at each of four steps alarms falsely in fewer than 1 of 250 draws of the seeds.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.stats import chi2

from pilotage.core.random import RandomStreams
from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.sensors.compass import CompassConfig
from pilotage.sensors.gps import GpsConfig
from pilotage.sensors.readings import GpsFix, OdometryIncrement, Reading, Readings
from pilotage.sensors.sensor import Mount, SensorConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.source import RobotSpec, Simulator
from pilotage.sim.worlds.world import World
from pilotage.stack.interface import Belief, BeliefStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.localization.ekf_gps import EkfGpsConfig, EkfGpsLocalizer

OPEN = WorldMap("open", (-500.0, -500.0, 500.0, 500.0))
DT_S, BODY, MOTION = 0.2, Footprint.disc(0.3), DifferentialDriveConfig(max_speed_m_s=2.0)
INITIAL = np.array([0.25, 0.25, 0.01])
WHEELS = WheelOdometryConfig(rate_hz=5.0, distance_var_m2_per_m=4e-4, angle_var_rad2_per_rad=4e-4)
GPS = GpsConfig(mount=Mount(x_m=0.4, y_m=-0.2))
SENSORS: dict[str, SensorConfig] = {"wheels": WHEELS, "gps": GPS, "compass": CompassConfig(rate_hz=5.0)}
RUNS, STEPS, LOOKED_AT = 40, 1500, (100, 400, 900, 1500)


@dataclass(frozen=True)
class Drive:
    """What was read in each step of a drive, and where the robot was at the steps looked at."""

    readings: list[Readings]
    truths: list[Pose2]


@pytest.fixture(scope="module")
def recorded() -> list[Drive]:
    """Forty drives that wind over open ground, driven once for all filters.

    What a sensor reads is drawn from a stream of its own: it is the same whichever others there are.
    """
    found = []
    for run in range(RUNS):
        rng = np.random.default_rng(1000 + run)
        start = Pose2.from_array(np.sqrt(INITIAL) * rng.standard_normal(3))
        robot = RobotSpec("robot", BODY, MOTION, SENSORS, start, RandomStreams(run))
        sim = Simulator(World.of(OPEN), [robot], DT_S)
        drive = Drive([], [])
        for step in range(1, STEPS + 1):
            drive.readings.append(sim.step([Twist(1.0, 0.3 * math.sin(0.01 * step))])[0])
            if step in LOOKED_AT:
                drive.truths.append(sim.bodies[0].pose)
        found.append(drive)
    return found


def localized(
    drives: Sequence[Drive], names: Collection[str], config: EkfGpsConfig
) -> tuple[FloatArray, FloatArray]:
    """(runs, 4) NEES and position errors [m] at the steps looked at, of robots with these sensors alone."""
    values, errors = np.empty((len(drives), 4)), np.empty((len(drives), 4))
    sensors = {name: SENSORS[name] for name in names}
    for run, drive in enumerate(drives):
        robot = RobotKnowledge(BODY, MOTION, sensors, DT_S, RandomStreams(run))
        belief = Belief(Pose2(0.0, 0.0, 0.0), np.diag(INITIAL))
        localizer = EkfGpsLocalizer(config, robot, OPEN, belief, Journal())
        for step, seen in enumerate(drive.readings, start=1):
            heard = {name: reading for name, reading in seen.by_sensor.items() if name in sensors}
            belief = localizer.step(Readings(seen.t_s, heard))
            if step in LOOKED_AT:
                k = LOOKED_AT.index(step)
                truth = drive.truths[k]
                off = np.array([belief.pose.x_m - truth.x_m, belief.pose.y_m - truth.y_m, 0.0])
                off[2] = math.remainder(belief.pose.theta_rad - truth.theta_rad, 2.0 * math.pi)
                values[run, k] = off @ np.linalg.solve(belief.cov, off)
                errors[run, k] = math.hypot(off[0], off[1])
    return values, errors


@pytest.mark.parametrize("compass", [True, False])
def test_it_knows_how_far_off_it_is(recorded: list[Drive], compass: bool) -> None:
    names = ["wheels", "gps", *(["compass"] if compass else [])]
    values, errors = localized(recorded, names, EkfGpsConfig())
    low, high = (float(chi2.ppf(share, 3 * RUNS)) / RUNS for share in (0.0005, 0.9995))
    assert (values.mean(axis=0) > low).all()
    assert (values.mean(axis=0) < high).all()
    assert errors.mean() < 1.0  # a receiver alone is off by 1.4 m


def test_who_takes_a_lasting_error_for_noise_is_too_sure(recorded: list[Drive]) -> None:
    """What the test above would see if the filter did not know of it."""
    values, _ = localized(recorded[:20], ["wheels", "gps"], EkfGpsConfig(bias_std_m=0.0))
    assert values[:, 1:].mean() > 6.0


def test_a_receiver_that_jumps_for_good_is_doubted_and_then_followed() -> None:
    """No word of the robot's says that it is localized while it is far from where it believes to be."""
    robot = RobotKnowledge(BODY, MOTION, {"wheels": WHEELS, "gps": GPS}, DT_S, RandomStreams(0))
    localizer = EkfGpsLocalizer(
        EkfGpsConfig(), robot, OPEN, Belief(Pose2(0, 0, 0), np.diag(INITIAL)), Journal()
    )
    lost = []
    for step in range(1, 1500):
        jump_m = 0.0 if step < 500 else 60.0
        readings: dict[str, Reading] = {
            "wheels": OdometryIncrement(0.2, 0.0),
            "gps": GpsFix(0.2 * step + 0.4, jump_m - 0.2),
        }
        belief = localizer.step(Readings(step * DT_S, readings))
        lost.append(belief.status is BeliefStatus.LOST)
    assert not any(lost[:500])
    assert any(lost[500:530])
    assert not any(lost[-500:])
    assert belief.pose.y_m == pytest.approx(60.0, abs=2.0)
