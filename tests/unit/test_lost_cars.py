"""Cars that do not know where they are drive about until they do, ahead and back in turn."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from pilotage.core.types import STOP, Twist
from pilotage.experiments.mission import load_mission
from pilotage.experiments.run import run_mission
from pilotage.models.motion.bicycle import BicycleConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.sensor import Mount
from pilotage.stack.control.shunting import LEG_M, Shunting
from support.robots import told_of

CAR = BicycleConfig(wheelbase_m=0.6, max_steering_rad=0.6)
ALL_ROUND = LidarConfig(beams=360, field_of_view_rad=2.0 * math.pi)
AHEAD = LidarConfig(beams=181, field_of_view_rad=math.pi)


def shunting(allows: Callable[[Twist], bool], *lasers: LidarConfig) -> Shunting:
    sensors = {str(k): laser for k, laser in enumerate(lasers or (ALL_ROUND,))}
    return Shunting(replace(told_of().robot, motion=CAR, sensors=sensors), allows)


def anything(command: Twist) -> bool:
    return command != STOP


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_it_backs_first_and_turns_in_one_sense_all_the_while(sense: float) -> None:
    found = shunting(anything)
    found.begin()
    legs: list[float] = []
    for _ in range(300):
        command = found.step(sense)
        assert command.w_rad_s * sense == pytest.approx(abs(command.v_m_s) / CAR.least_turning_radius_m)
        if not legs or legs[-1] * command.v_m_s < 0.0:
            legs.append(0.0)
        legs[-1] += command.v_m_s * 0.1
    assert len(legs) > 3
    assert legs[0] < 0.0 < legs[1]
    assert max(map(abs, legs)) <= LEG_M + 0.1


def test_a_leg_that_is_not_free_ends_and_arcs_of_the_other_side_will_do() -> None:
    found = shunting(lambda command: command.v_m_s > 0.0)
    found.begin()
    assert found.step(1.0).v_m_s > 0.0
    to_the_right = shunting(lambda command: command.v_m_s < 0.0 and command.w_rad_s <= 0.0)
    to_the_right.begin()
    assert to_the_right.step(1.0) == Twist(-0.3, 0.0)
    nowhere = shunting(lambda _: False)
    nowhere.begin()
    assert nowhere.step(1.0) == STOP


def test_it_backs_only_where_a_laser_looks() -> None:
    seeing_back = AHEAD.model_copy(update={"mount": Mount(theta_rad=3.0)})
    for lasers, backs in (((AHEAD,), False), ((AHEAD, seeing_back), True), ((ALL_ROUND,), True)):
        found = shunting(anything, *lasers)
        found.begin()
        ways = {math.copysign(1.0, found.step(1.0).v_m_s) for _ in range(200)}
        assert ways == ({1.0, -1.0} if backs else {1.0})


@pytest.mark.parametrize("localizer", ["ekf-walls", "particle-filter"])
@pytest.mark.parametrize("initial", ["{known: false}", "{x_var_m2: 0.5, y_var_m2: 0.5, theta_var_rad2: 0.3}"])
def test_a_car_that_is_lost_at_the_start_finds_itself_and_parks(localizer: str, initial: str) -> None:
    """Nose to the yard's wall: told nothing it was refused, told vaguely it stood to the end."""
    changes = [f"stack.initial={initial}", f"stack.localizer={localizer}", "world.start.theta_rad=3.1416"]
    metrics = run_mission(load_mission("car-park", changes), save=False).metrics
    assert metrics["collisions"] == 0
    assert metrics["success"], metrics["reason"]
