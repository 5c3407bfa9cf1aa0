"""The role: readings and belief in, additions to the robot's map out; and its registry."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from pilotage.core.checked import Gives, keeps
from pilotage.core.misfit import kept, told, unfit_array
from pilotage.core.registry import Registry
from pilotage.core.types import FloatArray
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief


class Mapper(Protocol):
    """Puts what was seen on the robot's own map.

    Built as ``cls(config, robot: RobotKnowledge, chart: WorldMap)``.
    """

    @property
    def circles_m(self) -> FloatArray:
        """(M, 3) x, y, radius of everything added so far."""

    def step(self, readings: Readings, belief: Belief) -> bool:
        """Take in one step; True where something was added."""


def _unfit_kept(mapper: Mapper) -> str:
    circles = kept(mapper, "circles_m")
    wrong = unfit_array(circles, 3)
    if not wrong and (circles[:, 2] < 0.0).any():
        wrong = f"a radius of {circles[:, 2].min()}"
    return f"circles_m {wrong}" if wrong else ""


def _unfit(added: object, mapper: Mapper, *_: object) -> str:
    return _unfit_kept(mapper) if isinstance(added, bool | np.bool_) else told(added)


MAPPERS: Registry[Mapper] = Registry(
    "mapper",
    "pilotage.stack.mapping",
    gives=(
        keeps("circles_m (M, 3) of finite numbers", _unfit_kept),
        Gives("step", "true or false, and circles_m (M, 3) of finite numbers", _unfit),
    ),
)
