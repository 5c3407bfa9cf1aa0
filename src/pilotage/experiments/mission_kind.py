"""What every kind of mission offers: it builds, steps, judges and records its missions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

from pilotage.core.types import Event, FloatArray
from pilotage.experiments.progress import OnProgress
from pilotage.missions.mission import Mission


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
