"""Robots on patrol reckon with the brakes that they have, and with a speed good enough to brake by."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from pilotage.core.types import STOP, Twist
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import mission_of
from pilotage.kernels.control.safe_stop import toward
from pilotage.models.odometry import increment_variances
from pilotage.sensors.readings import OdometryIncrement, Readings
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from support.two_rooms import DOOR_Y_M, two_rooms

DT_S, STEPS = 0.1, 120
AHEAD = Twist(1.0, 0.0)


def driven(said_m_s2: float, truly_m_s2: float) -> Iterator[tuple[Any, float, float]]:
    """The context of a robot told to go, to stop and to go again: with its speed, and as that is told."""
    values = two_rooms(DOOR_Y_M)
    values["robot"]["motion"]["max_acceleration_m_s2"] = said_m_s2
    stack: Any = build(mission_of(values, seed=0)).team[1].stack
    context, rng, v_m_s = stack._context, np.random.default_rng(1), 0.0
    densities = WheelOdometryConfig(rate_hz=10).densities
    for step in range(1, STEPS + 1):
        command = AHEAD if step % 60 < 30 else STOP
        context.sent(command)
        before, v_m_s = v_m_s, toward(v_m_s, command.v_m_s, truly_m_s2 * DT_S)
        way_m = 0.5 * (before + v_m_s) * DT_S
        told_m = way_m + rng.normal(0.0, math.sqrt(increment_variances(way_m, 0.0, *densities)[0]))
        readings = Readings(DT_S * step, {"odometry": OdometryIncrement(told_m, 0.0)})
        context.take_in(readings, stack.belief, lost=False)
        yield context, v_m_s, told_m / DT_S


def test_weak_brakes_go_by_what_was_told_as_well() -> None:
    """Of 0.3 m/s^2: in a step its speed changes by less than an odometry is off."""
    errors = np.array([(context.twist.v_m_s - v, raw - v) for context, v, raw in driven(0.3, 0.3)])
    by_both, raw = np.sqrt((errors[20:] ** 2).mean(axis=0))
    assert by_both < 0.7 * raw


def test_good_brakes_go_by_the_odometry_alone() -> None:
    assert all(context.twist.v_m_s == raw for context, _, raw in driven(2.0, 2.0))


@pytest.mark.parametrize("share", [0.5, 1.0])
@pytest.mark.parametrize("said_m_s2", [0.5, 2.0])
def test_stops_are_reckoned_by_the_brakes_that_have_proved(said_m_s2: float, share: float) -> None:
    *_, (context, _, _) = driven(said_m_s2, share * said_m_s2)
    context.motion.watch(lost=False)
    limits = context.motion._limits
    assert limits[2] <= share * said_m_s2 + 1e-9
    assert limits[2] >= (share - 0.21) * said_m_s2
    assert (limits[2] == said_m_s2) == (share == 1.0)
