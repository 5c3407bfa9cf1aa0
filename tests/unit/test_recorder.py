"""What a robot's trace has of its commands."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, ClassVar

import pytest

from pilotage.experiments.recorder import Recorder
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.models.motion.motion import MotionConfig
from pilotage.models.motion.omnidirectional import OmnidirectionalConfig


class Crab(MotionConfig):
    """A stranger's data sheet, which derives from none of ours."""

    drives_sideways: ClassVar[bool] = True

    @property
    def top_speed_m_s(self) -> float:
        """Ahead."""
        return 1.0

    @property
    def top_turn_rate_rad_s(self) -> float:
        """On the spot."""
        return 1.0


MOTIONS = [(OmnidirectionalConfig(), True), (Crab(), True), (DifferentialDriveConfig(), False)]


@pytest.mark.parametrize(("motion", "sideways"), MOTIONS)
def test_a_lateral_command_is_recorded_of_whoever_follows_one(motion: MotionConfig, sideways: bool) -> None:
    """Of motions from outside it was not."""
    journal, known = SimpleNamespace(units={}), SimpleNamespace(sensors={}, motion=motion)
    member: Any = SimpleNamespace(stack=None, journal=journal, known=known)
    task: Any = SimpleNamespace(columns={})
    body: Any = None
    names = Recorder(member, body, task, 0, thinned=False).names
    assert ("lateral_cmd_m_s" in names) is sideways
