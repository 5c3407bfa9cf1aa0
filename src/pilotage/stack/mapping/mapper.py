"""The role: readings and belief in, additions to the robot's map out; and its registry."""

from __future__ import annotations

from typing import Protocol

from pilotage.core.checked import Gives, unfit_array
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
        ...

    def step(self, readings: Readings, belief: Belief) -> bool:
        """Take in one step; True where something was added."""
        ...


def _unfit(added: object, mapper: Mapper, *_: object) -> str:
    return unfit_array(mapper.circles_m, 3) if added else ""


MAPPERS: Registry[Mapper] = Registry(
    "mapper",
    "pilotage.stack.mapping",
    gives=(Gives("step", "circles_m (M, 3) of finite numbers", _unfit),),
)
