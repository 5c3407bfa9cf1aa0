"""A robot learns how hard it brakes before it has to."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from pilotage.core.types import STOP, Pose2, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.models.motion.bicycle import BicycleConfig
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.models.motion.omnidirectional import OmnidirectionalConfig
from pilotage.sensors.readings import Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.source import Simulator
from pilotage.sim.worlds.world import World
from pilotage.stack.control.brakes import Brakes
from support.robots import told_of
from support.worlds import robot

DT_S = 0.1
SAID_M_S2 = 0.8
ODOMETRY = {"odometry": WheelOdometryConfig(rate_hz=10.0)}
FAR = WorldMap("far", (-500.0, -500.0, 500.0, 500.0))
AHEAD, ASIDE = Twist(0.9, 0.2), Twist(0.0, 0.0, 0.9)
Kind = type[DifferentialDriveConfig] | type[OmnidirectionalConfig] | type[BicycleConfig]


def driven(
    kind: Kind, truly_m_s2: float, commands: Iterable[Twist], delay_s: float = 0.0
) -> Iterator[Brakes]:
    """What is known of the brakes after each command; one and the same object."""
    said, does = (kind(max_acceleration_m_s2=most, delay_s=delay_s) for most in (SAID_M_S2, truly_m_s2))
    sim = Simulator(World.of(FAR), [robot(ODOMETRY, motion=does, start=Pose2(0.0, 0.0, 0.0))], DT_S)
    brakes = Brakes(replace(told_of().robot, motion=said, sensors=ODOMETRY, dt_s=DT_S))
    readings = Readings(0.0, {})
    for command in commands:
        brakes.take_in(readings)
        brakes.sent(command)
        readings = sim.step([command])[0]
        yield brakes


@pytest.mark.parametrize("share", [0.3, 0.45, 0.6, 0.85])
@pytest.mark.parametrize(
    ("kind", "command"),
    [
        (DifferentialDriveConfig, AHEAD),
        (OmnidirectionalConfig, AHEAD),
        (OmnidirectionalConfig, ASIDE),
        (BicycleConfig, AHEAD),
    ],
)
def test_weak_brakes_are_known_by_how_it_speeds_up(kind: Kind, command: Twist, share: float) -> None:
    """Told 0.9 m/s, it comes to 0.36 to 0.9 m/s in 1.5 s."""
    truly_m_s2 = share * SAID_M_S2
    *_, brakes = driven(kind, truly_m_s2, [command] * 15)
    assert brakes.likely_m_s2 == pytest.approx(truly_m_s2, abs=0.11 * SAID_M_S2)
    assert brakes.sure_m_s2 <= truly_m_s2 + 1e-9


def test_a_steady_speed_makes_nothing_forgotten() -> None:
    """After 10 s of it half the brakes were taken for whole ones."""
    learned = [b.likely_m_s2 for b in driven(DifferentialDriveConfig, 0.4, [AHEAD] * 600)]
    assert max(learned[15:]) < 0.6 * SAID_M_S2 + 1e-9


@pytest.mark.parametrize("delay_s", [0.0, 0.2])
def test_brakes_as_they_are_said_to_be_are_taken_so(delay_s: float) -> None:
    """By 6,000 steps to random speeds; 22 of 30,292 other ones took them for 0.9, none for less."""
    rng = np.random.default_rng(5)
    speeds = [Twist(*rng.uniform(-1.0, 1.0, 2)) for _ in range(600)]
    told = [speed for speed in speeds for _ in range(rng.integers(1, 20))]
    taken = driven(DifferentialDriveConfig, SAID_M_S2, told, delay_s)
    sure = np.array([brakes.sure_m_s2 for brakes in taken]) / SAID_M_S2
    assert (sure < 1.0).mean() < 0.005
    assert sure.min() > 0.75


def test_who_was_not_told_of_every_step_begins_anew() -> None:
    """As on patrol, where it is asked now and then: what was driven meanwhile was not told."""
    *_, brakes = driven(DifferentialDriveConfig, 0.4, [AHEAD] * 15)
    brakes.take_in(Readings(10.0, {}))
    assert brakes.rates_m_s == (0.0, 0.0)


def test_who_stops_within_a_step_has_nothing_to_learn() -> None:
    motion = DifferentialDriveConfig(max_acceleration_m_s2=20.0)
    brakes = Brakes(replace(told_of().robot, motion=motion, sensors=ODOMETRY, dt_s=DT_S))
    brakes.take_in(Readings(0.0, {}))
    brakes.sent(STOP)
    assert brakes.likely_m_s2 == brakes.sure_m_s2 == motion.top_speed_m_s / DT_S
