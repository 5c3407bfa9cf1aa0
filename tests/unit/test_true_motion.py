"""A body that does not move as its data sheet says."""

from __future__ import annotations

import pytest

from pilotage.core.errors import InputError
from pilotage.core.types import Twist
from pilotage.experiments.build.build import build
from pilotage.experiments.mission import load_mission
from pilotage.models.motion.differential_drive import DifferentialDriveConfig


def test_a_motion_may_truly_be_other_than_its_data_sheet_says() -> None:
    mission = load_mission("barn-course", ["robot.true_motion.max_acceleration_m_s2=0.7"])
    experiment = build(mission)
    told = experiment.team[0].known.motion
    assert isinstance(told, DifferentialDriveConfig)
    assert told.max_acceleration_m_s2 == 3.0
    experiment.simulator.step([Twist(2.0, 0.0)])
    assert experiment.simulator.bodies[0].twist.v_m_s == pytest.approx(0.7 * 0.05)


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("max_acceleration", "did you mean 'max_acceleration_m_s2'"),
        ("name", "parameters of the motion 'differential-drive' alone"),
    ],
)
def test_what_the_motion_does_not_have_is_refused(key: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_mission("barn-course", [f"robot.true_motion.{key}=1"])
