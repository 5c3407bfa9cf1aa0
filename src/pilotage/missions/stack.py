"""What would run on the robot: one component for each role."""

from __future__ import annotations

from typing import Any

from pilotage.core.config import Config
from pilotage.missions.choice import ComponentChoice
from pilotage.sensors.sensor import NonNegative


class InitialConfig(Config):
    """What the robot believes at the start: the start pose with an error drawn from this covariance."""

    x_var_m2: NonNegative = 0.01
    y_var_m2: NonNegative = 0.01
    theta_var_rad2: NonNegative = 0.01
    known: bool = True
    """False: the robot is told nothing, and the variances do not count."""


class StackConfig(Config):
    """One component for each role; None where the mission does without."""

    map: str = "given"
    """The robot's own map: ``given``, the world's as it was drawn; ``none``, its extent alone; or a file."""
    initial: InitialConfig = InitialConfig()
    navigator: ComponentChoice
    localizer: ComponentChoice | None = None
    heading: ComponentChoice | None = None
    """Of a robot that dead-reckons on a sheet by its wheels; None: the exploration report's."""
    planner: ComponentChoice | None = None
    smoother: ComponentChoice | None = None
    local_planner: ComponentChoice | None = None
    controller: ComponentChoice | None = None
    local_controller: ComponentChoice | None = None
    """Finds its way by the laser alone, beside or without a plan."""
    reactive: ComponentChoice | None = None
    mapper: ComponentChoice | None = None
    escape: ComponentChoice | None = None

    def roles(self) -> dict[str, Any]:
        """Role to choice, of those that are filled."""
        return {
            name: choice
            for name in type(self).model_fields
            if isinstance(choice := getattr(self, name), ComponentChoice)
        }
