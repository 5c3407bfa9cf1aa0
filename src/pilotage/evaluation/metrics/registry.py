"""The metrics there are: looked up by key, asked by task, extended by plugins."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

from pilotage.core.checked import require_taken
from pilotage.core.errors import InputError, nearest
from pilotage.core.misfit import told, unfit_number
from pilotage.core.plugins import giver, load_plugins, take
from pilotage.core.types import FloatArray
from pilotage.evaluation.metric import Clock, Compute, Metric, unnamed


class Metrics:
    """Metrics by key, in the order in which they were declared.

    Parameters
    ----------
    table
        The metrics that come with pilotage.
    decisive
        By task, the keys that judge its runs beside success, what matters most first.
    """

    def __init__(self, table: Iterable[Metric], decisive: Mapping[str, tuple[str, ...]]) -> None:
        self._by_key: dict[str, Metric] = {}
        self._decisive = dict(decisive)
        for metric in table:
            self.add(metric)

    def __iter__(self) -> Iterator[Metric]:
        return iter(self._by_key.values())

    def __contains__(self, key: object) -> bool:
        return key in self._by_key

    def add(self, metric: Metric) -> Metric:
        """Declare a metric that runs give under its key, or that its ``compute`` gives.

        Raises
        ------
        InputError
            Where the key is taken.
        """
        if metric.key in self._by_key:
            raise InputError(f"metric '{metric.key}': expected a new key, found it declared already")
        self._by_key[metric.key] = metric
        return metric

    def computed_by(self, metric: Metric) -> Callable[[Compute], Compute]:
        """Declare a metric with the decorated function, from (trace, metrics so far) to its value."""

        def register(compute: Compute) -> Compute:
            self.add(replace(metric, compute=compute))
            take(compute.__module__)
            return compute

        return register

    def judge_task(self, task: str, keys: Iterable[str]) -> None:
        """Say which metrics judge the runs of a task, what matters most first.

        Raises
        ------
        InputError
            Where a key is no declared metric.
        """
        chosen = tuple(keys)
        for key in chosen:
            if key not in self._by_key:
                close = nearest(key, list(self._by_key))
                hint = f"; did you mean '{close}'?" if close else ""
                raise InputError(f"task '{task}': expected declared metrics, found '{key}'{hint}")
        self._decisive[task] = chosen

    def find(self, key: str) -> Metric:
        """The metric of a key; of one that nobody declared, words and unit by the key itself."""
        if key not in self._by_key:
            load_plugins()
        return self._by_key.get(key) or unnamed(key)

    def given_by(self, task: str, has: frozenset[str] | None = None) -> frozenset[str]:
        """The keys that runs of a task can give; ``has`` is what the mission has (None: everything)."""
        return frozenset(metric.key for metric in self if metric.is_given_by(task, has))

    def costs_of(self, task: str, given: Iterable[str]) -> tuple[Metric, ...]:
        """The metrics that judge a task beside success, of those given; what matters most first.

        Of a task that nobody told of: every given one with a direction, in the table's order; none of the
        clock on the wall.
        """
        names = frozenset(given)
        if task in self._decisive:
            return tuple(self._by_key[key] for key in self._decisive[task] if key in names)
        known = (metric for metric in self if metric.key in names and metric.clock is not Clock.WALL)
        return tuple(metric for metric in known if metric.less_is_better is not None)

    def is_wall_clock(self, key: str) -> bool:
        """Whether a metric is never the same twice, for it is one of the clock on the wall."""
        return self.find(key).clock is Clock.WALL

    def computed(
        self,
        task: str,
        trace: Mapping[str, FloatArray],
        metrics: Mapping[str, object],
        lacking: dict[str, str] | None = None,
    ) -> dict[str, object]:
        """What the declared functions give for a run; left out what gives None, or asks for a column that the
        run has not, which is put into ``lacking`` by the metric's key.

        Raises
        ------
        InputError
            Where one gives something else than a finite number or None.
        """
        found: dict[str, object] = {}
        trace, metrics = _to_look_at(trace), MappingProxyType(dict(metrics))
        for metric in self:
            if metric.compute is None or not metric.is_given_by(task):
                continue
            try:
                value = metric.compute(trace, metrics)
            except NoColumnError as error:
                if lacking is not None:
                    lacking[metric.key] = error.args[0]
                continue
            except TypeError:
                require_taken(metric.compute, _whose(metric), "take", (trace, metrics), {})
                raise
            if value is None:
                continue
            if unfit_number(value):
                raise InputError(
                    f"{_whose(metric)}: expected a finite number, or None of a run that does not give it, "
                    f"found {told(value)}"
                )
            found[metric.key] = float(value)
        return found


def _whose(metric: Metric) -> str:
    assert metric.compute is not None
    return f"metric '{metric.key}' of {giver(metric.compute.__module__)}"


class NoColumnError(KeyError):
    """A run's trace has no such column."""


class _Columns(dict[str, FloatArray]):
    def __missing__(self, name: str) -> FloatArray:
        raise NoColumnError(name)


def _to_look_at(trace: Mapping[str, FloatArray]) -> Mapping[str, FloatArray]:
    """Columns that whoever is handed them cannot write into: they are the run's record."""
    views = _Columns((name, column.view()) for name, column in trace.items())
    for view in views.values():
        view.flags.writeable = False
    return MappingProxyType(views)
