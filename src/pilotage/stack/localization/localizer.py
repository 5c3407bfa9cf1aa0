"""The role: readings in, belief out; and the registry of those who fill it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Protocol

from pilotage.core.checked import Gives, keeps
from pilotage.core.errors import InputError
from pilotage.core.misfit import kept
from pilotage.core.registry import Registry
from pilotage.core.types import FloatArray
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief, BeliefStatus, unfit_belief
from pilotage.stack.mapping.scan_grid import ScanGrid


class Localizer(Protocol):
    """Estimates the pose.

    Built as ``cls(config, robot: RobotKnowledge, chart: WorldMap, initial: Belief, journal: Journal)``. It
    declares its telemetry in the journal at construction and tells it at every step; an update that it can
    explain it puts into ``journal.update``.

    One that senses enough to correct what a robot's commands foretell says ``BY_COMMANDS = True`` on its
    class: a robot without wheel odometry then has one by its commands.

    What it may have besides stands in ``Abilities``, by the same names; whether it has is asked once, when
    the stack is put together.
    """

    @property
    def belief(self) -> Belief:
        """The current belief."""

    def step(self, readings: Readings) -> Belief:
        """Take in one step's readings and return the belief after them."""


def _anywhere() -> float | None:
    return None


def _to_nobody(mates: FloatArray) -> None:
    del mates


def _no_loops() -> int:
    return 0


def _nothing() -> None:
    return None


@dataclass(frozen=True, slots=True)
class Abilities:
    """What a localizer may have besides its role, and what stands in where it has not.

    Attributes
    ----------
    look_bearing_rad
        Where to drive to while it is lost, in the robot's frame; None where any direction is as good.
    tell_mates
        Told before each step where mates say that they are, (K, 4) as of ``ScanFit.mates_in_sight``.
    scan_grid
        The map that it draws; None where it draws none.
    corrects
        Whether anything that it senses corrects what it reckons.
    on_map
        Whether what it senses tells where on the robot's map it is; else what it began with stays wrong.
    close_loops, refine
        Of one that draws a map: look for loops here and now, how many closed; align all of it once more.
    """

    look_bearing_rad: Callable[[], float | None] = _anywhere
    tell_mates: Callable[[FloatArray], None] = _to_nobody
    scan_grid: ScanGrid | None = None
    corrects: bool = True
    on_map: bool = True
    close_loops: Callable[[], int] = _no_loops
    refine: Callable[[], None] = _nothing

    @classmethod
    def of(cls, localizer: Localizer) -> Abilities:
        """Those of a localizer."""
        names = (field.name for field in fields(cls))
        return cls(**{name: getattr(localizer, name) for name in names if hasattr(localizer, name)})


class WrappedLocalizer:
    """A localizer inside another one, which says what it believes and can do besides what it can."""

    def __init__(self, localizer: Localizer) -> None:
        self._localizer, able = localizer, Abilities.of(localizer)
        self.look_bearing_rad, self.tell_mates = able.look_bearing_rad, able.tell_mates
        self.scan_grid, self.corrects, self.on_map = able.scan_grid, able.corrects, able.on_map
        self.close_loops, self.refine = able.close_loops, able.refine

    @property
    def belief(self) -> Belief:
        """The localizer's."""
        return self._localizer.belief

    def step(self, readings: Readings) -> Belief:
        """Take in one step's readings."""
        return self._localizer.step(readings)


def require_walls(chart: WorldMap, name: str) -> None:
    """Refuse a map without a straight wall.

    Raises
    ------
    InputError
        If no beam can end at a line that is on the map: the filter would dead-reckon for ever.
    """
    walls = chart.reflectors
    if not len(walls.segments_m):
        among = ", or take localizer particle-filter among discs" if len(walls.circles_m) else ""
        raise InputError(
            f"{name}: expected walls that are straight on the robot's map, found none that a beam ends at on "
            f"'{chart.name}'; see stack.map{among}"
        )


class StartNeededError(InputError):
    """A localizer that cannot find its pose by itself was told none."""


def require_initial_pose(initial: Belief, name: str) -> None:
    """Refuse a start without a pose.

    Raises
    ------
    StartNeededError
        If the initial pose is unknown; said by localizers that cannot find it by themselves.
    """
    if initial.status is BeliefStatus.LOST:
        raise StartNeededError(
            f"{name}: expected an initial pose, found stack.initial.known = false; set it to true or take "
            "a localizer that finds its pose by itself, such as ekf-walls"
        )


def _unfit_kept(localizer: Localizer) -> str:
    wrong = unfit_belief(kept(localizer, "belief"))
    return f"belief {wrong}" if wrong else ""


def _unfit(given: object, localizer: Localizer, *_: object) -> str:
    return unfit_belief(given) or ("" if kept(localizer, "belief") is given else _unfit_kept(localizer))


LOCALIZERS: Registry[Localizer] = Registry(
    "localizer",
    "pilotage.stack.localization",
    "pilotage.replicas",
    gives=(
        keeps("as belief a Belief of finite pose and positive covariance (3, 3)", _unfit_kept),
        Gives("step", "a Belief of finite pose and positive covariance (3, 3)", _unfit),
    ),
)
