"""The kinds of missions: what turns a mission of each kind into a run, its numbers and its files.

A kind is loaded when a mission asks for it: the rover's terrain costs a museum run nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

from pilotage.core.errors import InputError, unknown_name
from pilotage.core.types import Event, FloatArray
from pilotage.experiments.progress import OnProgress
from pilotage.missions.mission import DEFAULT_KIND, Mission


class Record(Protocol):
    """A finished run in memory."""

    @property
    def mission(self) -> Mission:
        """The mission with its random places drawn: run again, it gives the same run."""
        ...

    @property
    def trace(self) -> Mapping[str, FloatArray]:
        """Columns by name, one row a step."""
        ...

    @property
    def events(self) -> list[Event]:
        """What happened, in order."""
        ...


class Aspect(StrEnum):
    """What a metric speaks of."""

    ACCURACY = "accuracy"
    TIME = "time"
    SAFETY = "safety"


@dataclass(frozen=True, slots=True)
class Cost:
    """A metric as a cost: of what, and whether less of it is better.

    Attributes
    ----------
    whole_only
        It compares only where both runs came to their end: a run that fails early is not fast.
    """

    aspect: Aspect
    less_is_better: bool = True
    whole_only: bool = False


TIME_COST = Cost(Aspect.TIME, whole_only=True)
ERROR = Cost(Aspect.ACCURACY)
WAY = Cost(Aspect.TIME, whole_only=True)
ROOM = Cost(Aspect.SAFETY, less_is_better=False)
SHARE = Cost(Aspect.ACCURACY, less_is_better=False)


class Kind(Protocol):
    """One kind of mission."""

    @property
    def schema(self) -> type[Mission]:
        """The model that validates its files."""
        ...

    @property
    def metric_names(self) -> frozenset[str]:
        """Every number that its runs can give, nested ones by one level of names."""
        ...

    def warm_up(self, mission: Mission) -> None:
        """Compile or load what a run of the mission needs, so that its times are not a compiler's."""
        ...

    def simulate(self, mission: Mission, on_progress: OnProgress | None = None) -> Record:
        """Build a mission and step it to its end.

        Raises
        ------
        InputError
            Where the mission asks for something that does not exist or cannot be.
        """
        ...

    def oracles(self, mission: Mission) -> Mapping[str, str]:
        """The oracles that ``run.oracles`` can name in this mission, and what each one does."""
        ...

    def costs(self, mission: Mission) -> Mapping[str, Cost]:
        """The metrics that say what a module costs this mission, beside success; what matters most first."""
        ...

    def metrics(self, record: Any) -> dict[str, object]:
        """The numbers of a run by their JSON keys; ``success`` among them."""
        ...

    def write_files(self, record: Any, folder: Path) -> None:
        """Write what this kind keeps beside mission, trace, events and metrics into ``folder``."""
        ...

    def inline(self, record: Any, values: dict[str, Any]) -> None:
        """Put what the mission took from files into its values, so that they alone run it again."""
        ...


def _floor() -> Kind:
    from pilotage.experiments.floor.kind import FLOOR

    return FLOOR


def _sheet() -> Kind:
    from pilotage.experiments.sheet.kind import SHEET

    return SHEET


def _terrain() -> Kind:
    from pilotage.experiments.terrain.kind import TERRAIN

    return TERRAIN


KINDS: dict[str, Callable[[], Kind]] = {
    "floor": _floor,
    "sheet": _sheet,
    "terrain": _terrain,
}
"""Each kind's loader by the ``world.kind`` of its missions."""


def kind_name(values: Mapping[str, Any]) -> str:
    """The kind that a mission's values name.

    Raises
    ------
    InputError
        If there is no such kind.
    """
    world = values.get("world")
    name = world.get("kind", DEFAULT_KIND) if isinstance(world, Mapping) else DEFAULT_KIND
    if not isinstance(name, str):
        raise InputError(f"world.kind: expected one of {', '.join(KINDS)}, found {name}")
    if name not in KINDS:
        raise unknown_name("world.kind", name, KINDS)
    return name


def kind_of(mission: Mission) -> Kind:
    """The kind of a validated mission."""
    for load in KINDS.values():
        kind = load()
        if isinstance(mission, kind.schema):
            return kind
    raise TypeError(f"expected a mission of a kind in {', '.join(KINDS)}, found {type(mission).__name__}")


def check_oracles(kind: Kind, mission: Mission) -> None:
    """Refuse an oracle that the mission has no place for.

    Raises
    ------
    InputError
        With those that it has.
    """
    known = kind.oracles(mission)
    for name in mission.run.oracles:
        if name not in known:
            offered = f"one of {', '.join(known)}" if known else "none"
            raise InputError(
                f"run.oracles: expected {offered} in the mission '{mission.mission}', found '{name}'"
            )
