"""The simulated robot on its sheet: boxes, drive, sensors."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import Pose2, WheelSpeeds
from pilotage.kernels.bodies import wheels
from pilotage.maps.true_cells import SheetFile
from pilotage.models.motion.wheel_drive import WheelDriveConfig, WheelErrorsConfig
from pilotage.replicas.random_walk import RandomWalk, RandomWalkConfig
from pilotage.replicas.surround_check import SurroundCheck, SurroundCheckConfig
from pilotage.sensors.gyroscope import GyroscopeConfig
from pilotage.sensors.infrared import InfraredConfig
from pilotage.sensors.readings import EncoderCounts, GyroscopeRates, InfraredReading, LineReading
from pilotage.sensors.wheel_encoders import WheelEncodersConfig
from pilotage.sim.bodies.wheel_drive import true_wheels
from pilotage.stack.exploration.frontier import FrontierExplorer
from pilotage.stack.exploration.frontier_config import FrontierConfig
from support.sheets import OnSheet, ToldOfSheet, sheet_sensors, sheet_simulator

EXACT = WheelErrorsConfig(
    radius_difference=0.0, separation_error=(0.0, 0.0), slip=(0.0, 0.0), slip_std_m_sqrt_m=0.0
)
EMPTY = SheetFile(size_m=(4.0, 4.0), cells=(10, 10))
MIDDLE = Pose2(2.0, 2.0, 0.0)


def drive_for(sim: OnSheet, command: WheelSpeeds, seconds: float) -> np.ndarray:
    counts = np.zeros(2, dtype=np.int64)
    for _ in range(round(seconds * 100)):
        reading = sim.step(command).by_sensor["encoders"]
        assert isinstance(reading, EncoderCounts)
        counts += [int(reading.left.sum()), int(reading.right.sum())]
    return counts


def test_an_exact_robot_drives_what_its_encoders_say() -> None:
    sim = sheet_simulator(sheet_sensors(), RandomStreams(0), EMPTY, MIDDLE, EXACT)
    counts = drive_for(sim, WheelSpeeds(2.0, 2.0), 10.0)
    way = 2.0 * math.pi * 0.035 * counts.mean() / 1440
    assert counts[0] == counts[1]
    assert sim.truth.x_m - 2.0 == pytest.approx(way, abs=2 * math.pi * 0.035 / 1440)
    # Behind the command by the motors' lag: v (t - lag).
    assert way == pytest.approx(0.07 * (10.0 - 0.05), abs=3e-4)


def test_a_turn_on_the_spot_follows_the_separation() -> None:
    sim = sheet_simulator(sheet_sensors(), RandomStreams(0), EMPTY, MIDDLE, EXACT)
    counts = drive_for(sim, WheelSpeeds(-1.0, 1.0), 2.0)
    angle = 2.0 * math.pi * 0.035 * (counts[1] - counts[0]) / 1440 / 0.1421
    assert sim.truth.theta_rad == pytest.approx(angle, abs=2e-3)


def test_slip_and_unequal_wheels_are_drawn_within_what_is_stated() -> None:
    motion = WheelDriveConfig()
    drawn = np.array([true_wheels(motion, np.random.default_rng(seed)) for seed in range(200)])
    ratio = drawn[:, wheels.RADIUS_LEFT] / drawn[:, wheels.RADIUS_RIGHT] - 1.0
    assert np.allclose(np.abs(ratio), 0.005, atol=1e-4)
    assert (ratio > 0.0).any()
    assert (ratio < 0.0).any()
    off = np.abs(drawn[:, wheels.SEPARATION] / motion.wheel_separation_m - 1.0)
    assert ((off >= 0.01 - 1e-12) & (off <= 0.02 + 1e-12)).all()
    slip = drawn[:, [wheels.SLIP_LEFT, wheels.SLIP_RIGHT]]
    assert ((slip >= 0.01) & (slip <= 0.02)).all()


def test_the_body_stops_at_a_box_while_the_wheels_turn_on_and_can_back_off() -> None:
    sheet = SheetFile(size_m=(4.0, 4.0), cells=(10, 10), obstacles=((2.3, 1.5, 2.6, 2.5),))
    sim = sheet_simulator(sheet_sensors(), RandomStreams(0), sheet, MIDDLE, EXACT)
    counts = drive_for(sim, WheelSpeeds(3.0, 3.0), 6.0)
    assert sim.body.collisions == 1
    assert sim.body.touching
    assert -1e-9 <= sim.body.clearance_m < 1e-3
    assert 2.0 * math.pi * 0.035 * counts.mean() / 1440 > 0.5
    before = sim.truth.x_m
    drive_for(sim, WheelSpeeds(-3.0, -3.0), 1.0)
    assert sim.truth.x_m < before - 0.05
    assert not sim.body.touching


def test_there_is_no_wall_at_the_edge() -> None:
    sim = sheet_simulator(sheet_sensors(), RandomStreams(0), EMPTY, Pose2(3.8, 2.0, 0.0), EXACT)
    assert sim.on_sheet
    drive_for(sim, WheelSpeeds(3.0, 3.0), 4.0)
    assert not sim.on_sheet
    assert sim.body.collisions == 0


def test_the_gyroscope_has_a_bias_of_either_sign_and_a_scale_error() -> None:
    """False-alarm rate: below 1e-6 (six standard deviations of the mean)."""
    signs = set()
    for seed in range(12):
        sensors = sheet_sensors() | {"gyroscope": GyroscopeConfig(bias_walk_rad_s_sqrt_s=0.0)}
        sim = sheet_simulator(sensors, RandomStreams(seed), EMPTY, MIDDLE, EXACT)
        rates = []
        for _ in range(300):
            reading = sim.step(WheelSpeeds(0.0, 0.0)).by_sensor["gyroscope"]
            assert isinstance(reading, GyroscopeRates)
            rates += reading.rates_rad_s.tolist()
        mean = float(np.mean(rates))
        assert abs(abs(mean) - math.radians(1.0)) < 6.0 * math.radians(0.15) / math.sqrt(600)
        signs.add(mean > 0.0)
    assert signs == {True, False}


def test_infrared_errors_grow_with_the_range() -> None:
    """Standard deviation 3.5 % of the range; 400 readings, band of 6 standard errors."""
    for x in (1.9, 2.05):
        sheet = SheetFile(size_m=(4.0, 4.0), cells=(10, 10), obstacles=((2.3, 1.5, 2.6, 2.5),))
        sensors = sheet_sensors() | {"ir": InfraredConfig()}
        sim = sheet_simulator(sensors, RandomStreams(3), sheet, Pose2(x, 2.0, 0.0), EXACT)
        found: list[float] = []
        while len(found) < 400:
            reading = sim.step(WheelSpeeds(0.0, 0.0)).by_sensor.get("ir")
            if isinstance(reading, InfraredReading):
                found.append(reading.range_m)
        std = float(np.std(found)) / (2.3 - x)
        assert abs(std - 0.035) < 6.0 * 0.035 / math.sqrt(2 * 400)
        assert abs(float(np.mean(found)) - (2.3 - x)) < 6.0 * 0.035 * (2.3 - x) / 20.0


def test_line_sensors_see_tape_and_the_dark_floor() -> None:
    sheet = SheetFile(size_m=(4.0, 4.0), cells=(10, 10), lines=(((2.5, 1.0), (2.5, 3.0)),))
    sim = sheet_simulator(sheet_sensors(), RandomStreams(0), sheet, MIDDLE, EXACT)
    dark = []
    while sim.truth.x_m < 2.7:
        reading = sim.step(WheelSpeeds(3.0, 3.0)).by_sensor.get("line_left")
        if isinstance(reading, LineReading) and reading.dark:
            dark.append(sim.truth.x_m + 0.07)
    assert dark
    assert all(abs(x - 2.5) < 0.5 * 0.015 + 6e-3 for x in dark)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"encoders": WheelEncodersConfig(rate_hz=150.0)}, "multiple of 100 Hz"),
        (
            {"encoders": WheelEncodersConfig(rate_hz=300.0), "gyroscope": GyroscopeConfig(rate_hz=200.0)},
            "a whole part of 300 Hz",
        ),
        ({"ir_left": InfraredConfig(rate_hz=30.0)}, "whole fraction"),
    ],
)
def test_rates_that_do_not_fit_are_told(change: dict[str, Any], complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        sheet_simulator(sheet_sensors() | change, RandomStreams(0))


def test_a_slower_gyroscope_beside_the_encoders_reads_means() -> None:
    sensors = sheet_sensors() | {"gyroscope": GyroscopeConfig(rate_hz=100.0, rate_std_rad_s=0.0)}
    reading = sheet_simulator(sensors, RandomStreams(0)).step(WheelSpeeds(1.0, 1.0)).by_sensor["gyroscope"]
    assert isinstance(reading, GyroscopeRates)
    assert len(reading.rates_rad_s) == 1


@pytest.mark.parametrize("count", [0, 2])
@pytest.mark.parametrize(
    ("explorer", "config"),
    [
        (RandomWalk, RandomWalkConfig()),
        (SurroundCheck, SurroundCheckConfig()),
        (FrontierExplorer, FrontierConfig()),
    ],
)
def test_an_explorer_needs_its_encoders_once(explorer: Any, config: Any, count: int) -> None:
    others = {k: s for k, s in sheet_sensors().items() if not isinstance(s, WheelEncodersConfig)}
    told = ToldOfSheet(sensors=others | {f"encoders-{k}": WheelEncodersConfig() for k in range(count)})
    with pytest.raises(InputError, match=f"expected one wheel-encoders among robot.sensors, found {count}"):
        told.explorer(explorer, config)


def test_cells_too_small_to_look_at_are_refused() -> None:
    """A beam was followed in steps of a fraction of a cell of 40 fm."""
    with pytest.raises(ValueError, match=r"expected cells at least 0\.001 m wide, found 1e-12 m for 25"):
        SheetFile(size_m=(1e-12, 4.0))
    SheetFile(size_m=(0.025, 4.0))
