"""What a run recorded, step by step: columns by name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pilotage.core import given
from pilotage.core.errors import InputError, unknown_name
from pilotage.core.files.parquet import arrow_table
from pilotage.core.types import FloatArray
from pilotage.face.tables import pandas
from pilotage.records.trace import ROBOT_COLUMN
from pilotage.records.trace import Trace as Recorded


class UnknownColumnError(InputError, KeyError):
    """There is no such column."""

    __str__ = Exception.__str__


class Trace(Mapping[str, FloatArray]):
    """Columns by name, each (N,) float64: one value a step, or a step and robot.

    Names end in their unit: ``t_s``, ``true_x_m``, ``est_theta_rad``, ``cov_xx_m2``. What a run did not know
    at a step is nan.

    Examples
    --------
    >>> import pilotage as pl
    >>> run = pl.run("museum-route", seed=4, save=False)
    >>> float(run.trace["t_s"][0]), run.trace["true_x_m"].shape == run.trace["est_x_m"].shape
    (0.1, True)
    >>> run.trace.to_arrow().num_rows == len(run.trace["t_s"])
    True
    """

    def __init__(self, recorded: Recorded) -> None:
        self._recorded = recorded

    def __getitem__(self, column: str) -> FloatArray:
        found = self._recorded.columns.get(column) if isinstance(column, str) else None
        if found is None:
            error = unknown_name("column", str(column), self._recorded.columns)
            raise UnknownColumnError(str(error))
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(self._recorded.columns)

    def __len__(self) -> int:
        return len(self._recorded.columns)

    def __repr__(self) -> str:
        of = f" of {len(self.robots)} robots" if self.robots else ""
        return f"Trace({self.rows} rows{of}: {', '.join(self)})"

    @property
    def rows(self) -> int:
        """How many rows there are."""
        return self._recorded.steps

    @property
    def robots(self) -> tuple[str, ...]:
        """The robots' names; none where there is one robot only."""
        return self._recorded.robots

    def of(self, robot: int | str) -> Trace:
        """One robot's rows, by its name or its number.

        Raises
        ------
        InputError
            Where there is no such robot.
        """
        names = self.robots
        if isinstance(robot, str):
            if robot not in names:
                raise unknown_name("robot", robot, names)
            robot = names.index(robot)
        if not 0 <= given.whole("robot", robot) < max(len(names), 1):
            raise InputError(f"robot: expected a number from 0 to {max(len(names), 1) - 1}, found {robot}")
        return Trace(self._recorded.of(robot))

    def to_arrow(self) -> Any:
        """Return a ``pyarrow.Table``; of several robots with the column ``robot``."""
        columns: dict[str, Any] = dict(self._recorded.columns)
        if self._recorded.robot is not None:
            columns = {ROBOT_COLUMN: self._recorded.robot, **columns}
        return arrow_table(columns)

    def to_pandas(self) -> Any:
        """Return a pandas DataFrame; InputError where pandas is not installed."""
        pandas()
        return self.to_arrow().to_pandas()
