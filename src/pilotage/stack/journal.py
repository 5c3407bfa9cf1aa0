"""What a stack has to tell besides its command: events, plans, counts, maps and telemetry."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from pilotage.core.types import Event
from pilotage.stack.interface import ExplainableUpdate, PlannedPath


class Channel:
    """A component's columns of the telemetry: declared once, told at each step.

    What was told last stands until it is told anew.
    """

    __slots__ = ("_begin", "_end", "_row")

    def __init__(self, row: array[float], begin: int, end: int) -> None:
        self._row, self._begin, self._end = row, begin, end

    def tell(self, *values: float) -> None:
        """Say the numbers of this step, in the order in which they were declared."""
        told = array("d", values)
        if len(told) != self._end - self._begin:
            raise ValueError(f"telemetry: expected {self._end - self._begin} numbers, found {len(told)}")
        self._row[self._begin : self._end] = told

    def shift(self, columns: int) -> None:
        """Make room for columns declared before these; for the journal."""
        self._begin, self._end = self._begin + columns, self._end + columns


@dataclass(slots=True)
class Journal:
    """One robot's journal. The stack writes; whoever runs it reads.

    Attributes
    ----------
    events
        What happened, in order.
    plans
        Every plan adopted, in order.
    counts
        What was counted, by name: attempts, replans, escapes.
    planning_time_s
        Wall time spent planning globally, queries without a path included.
    units
        Telemetry columns by name with their units, in the order of ``row``.
    row
        The last numbers told.
    outbox
        What it sends by radio in this step; whoever runs it takes it out.
    update
        The last step's sensor update where it can be explained; whoever reads it sets it back to None.
    silenced
        Whether nothing that it says or counts is kept: a robot that failed does neither.
    """

    events: list[Event] = field(default_factory=list)
    plans: list[PlannedPath] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    planning_time_s: float = 0.0
    units: dict[str, str] = field(default_factory=dict)
    row: array[float] = field(default_factory=lambda: array("d"))
    outbox: list[object] = field(default_factory=list)
    update: ExplainableUpdate | None = None
    silenced: bool = False
    _results: dict[str, Callable[[], object]] = field(default_factory=dict)
    _by_the_way: set[str] = field(default_factory=set)
    _channels: list[Channel] = field(default_factory=list)

    def say(self, t_s: float, kind: str, text: str) -> None:
        """Tell that something happened.

        Raises
        ------
        ValueError
            For a time that is no finite number, and words that are no text.
        """
        if self.silenced:
            return
        if t_s != t_s:
            raise ValueError(f"event: expected a finite time, found {t_s!r} of {kind!r}")
        self.events.append(Event(t_s, kind, text))

    def count(self, name: str) -> int:
        """Count one more of ``name``; returns how many there are now."""
        self.counts[name] = self.counts.get(name, 0) + (0 if self.silenced else 1)
        return self.counts[name]

    def channel(self, columns: Mapping[str, str], *, first: bool = False) -> Channel:
        """Declare telemetry: column names with their units; to be done at construction.

        Parameters
        ----------
        first
            Before all columns declared so far: a stack's own stand before those of its parts, which are
            made before it.

        Raises
        ------
        ValueError
            If a name is declared twice; where names or units are no texts.
        """
        for name, unit in columns.items():
            if not isinstance(name, str) or not isinstance(unit, str):
                raise ValueError(f"telemetry: expected names and units as texts, found {name!r}: {unit!r}")
            if name in self.units:
                raise ValueError(f"telemetry: the column '{name}' is declared twice")
        untold = array("d", [float("nan")] * len(columns))
        if first:
            for channel in self._channels:
                channel.shift(len(columns))
            self.row[:0] = untold
            self.units = {**columns, **self.units}
        else:
            self.row.extend(untold)
            self.units.update(columns)
        begin = 0 if first else len(self.row) - len(columns)
        self._channels.append(Channel(self.row, begin, begin + len(columns)))
        return self._channels[-1]

    def result(self, name: str, make: Callable[[], object], *, by_the_way: bool = False) -> None:
        """Offer something that is wanted once, at the end of the run: a map, what was found.

        ``by_the_way``: by a part that makes it for its own use, whatever the robot is to do.
        """
        self._results[name] = make
        (self._by_the_way.add if by_the_way else self._by_the_way.discard)(name)

    @property
    def offered(self) -> frozenset[str]:
        """The names of what is offered, but for what is so by the way."""
        return frozenset(self._results) - self._by_the_way

    def results(self) -> dict[str, object]:
        """Everything offered, made now."""
        return {name: make() for name, make in self._results.items()}
