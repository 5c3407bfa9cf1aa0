"""What every mission file holds, whatever its world: a name, a world of some kind, robot, stack, run.

Components of the stack are named here but configured where they live: a mission holds each
component's ``name`` and its parameters, and the room that registers the name validates them.
"""

from __future__ import annotations

import math
from typing import Any

from pydantic import ConfigDict, Field, field_validator, model_validator

from pilotage.core.config import Config
from pilotage.core.shown import visible
from pilotage.sensors.sensor import NonNegative, Positive

TOP_KEYS = ("mission", "description", "world", "robot", "stack", "run")
DEFAULT_KIND = "floor"
LARGEST_SEED = 2**63 - 1
"""As a database holds whole numbers."""
LONGEST_NAME = 100
"""Characters of a mission's name, which becomes a part of its folders' names."""

Point = tuple[float, float]


class ComponentChoice(Config):
    """A registered name and, beside it, the parameters of that component."""

    model_config = ConfigDict(extra="allow", frozen=True)

    name: str

    @model_validator(mode="before")
    @classmethod
    def _bare_name(cls, data: Any) -> Any:
        """A bare name stands for the component with its defaults."""
        return {"name": data} if isinstance(data, str) else data

    @property
    def parameters(self) -> dict[str, Any]:
        """All keys but the name."""
        return dict(self.model_extra or {})


class PoseConfig(Config):
    """A start pose."""

    x_m: float
    y_m: float
    theta_rad: float = Field(default=0.0, ge=-2 * math.pi, le=2 * math.pi)


class InitialConfig(Config):
    """What the robot believes at the start: the start pose with an error drawn from this covariance."""

    x_var_m2: NonNegative = 0.01
    y_var_m2: NonNegative = 0.01
    theta_var_rad2: NonNegative = 0.01
    known: bool = True
    """False: the robot is told nothing, and the variances do not count."""


class RunConfig(Config):
    """Time step, time limit and seed."""

    dt_s: float = Field(default=0.1, ge=1e-4, le=10.0)
    time_limit_s: Positive = 600.0
    seed: int = Field(default=0, ge=0, le=LARGEST_SEED)
    settle_s: NonNegative = 1.0
    """Errors count after this long: the start error is drawn, not earned."""
    oracles: tuple[str, ...] = ()
    """Modules that know the truth in this run, to find out what the real ones cost."""

    @field_validator("oracles")
    @classmethod
    def _every_oracle_once(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        for i, name in enumerate(names):
            if name in names[:i]:
                raise ValueError(f"expected every oracle once, found '{name}' twice")
        return names


class Mission(Config):
    """What missions of all kinds have in common; ``world.kind`` says which kind it is.

    Each kind is a subclass in a module of its own that adds ``world``, ``robot`` and ``stack``.
    """

    mission: str = Field(min_length=1, max_length=LONGEST_NAME)
    description: str = ""
    run: RunConfig = RunConfig()

    @field_validator("mission")
    @classmethod
    def _can_be_shown(cls, name: str) -> str:
        if visible(name) != name:
            raise ValueError(f"expected a name without control characters, found '{visible(name)}'")
        return name

    @model_validator(mode="after")
    def _steps(self) -> Mission:
        if self.run.time_limit_s < self.run.dt_s:
            raise ValueError("run.time_limit_s must be at least run.dt_s")
        return self
