"""A small table that prints itself in a terminal and in a notebook."""

from __future__ import annotations

import html
import importlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pilotage.core.errors import InputError
from pilotage.core.shown import visible


@dataclass(frozen=True, slots=True)
class Table:
    """Rows under named columns.

    Attributes
    ----------
    columns
        Their names.
    rows
        One tuple a row, a value a column.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Mapping[str, Any]]:
        """Row by row, as mappings from column to value."""
        return iter([dict(zip(self.columns, row, strict=True)) for row in self.rows])

    def __getitem__(self, column: str) -> list[Any]:
        """One column's values."""
        if column not in self.columns:
            raise InputError(f"table: expected a column among {', '.join(self.columns)}, found '{column}'")
        index = self.columns.index(column)
        return [row[index] for row in self.rows]

    def __str__(self) -> str:
        cells = [self.columns, *(tuple(_text(value) for value in row) for row in self.rows)]
        widths = [max(len(row[i]) for row in cells) for i in range(len(self.columns))]
        right = [_numeric([row[i] for row in self.rows]) for i in range(len(self.columns))]
        lines = [_line(row, widths, right) for row in cells]
        return "\n".join([lines[0], "-" * min(len(lines[0]), 100), *lines[1:]])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{html.escape(name)}</th>" for name in self.columns)
        body = "".join(
            "<tr>" + "".join(f"<td>{html.escape(_text(value))}</td>" for value in row) + "</tr>"
            for row in self.rows
        )
        return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"

    def to_pandas(self) -> Any:
        """Return a pandas DataFrame; InputError where pandas is not installed."""
        return pandas().DataFrame(list(self.rows), columns=list(self.columns))


def pandas() -> Any:
    """The pandas module, which is no dependency.

    Raises
    ------
    InputError
        Where it is not installed.
    """
    try:
        return importlib.import_module("pandas")
    except ImportError:
        raise InputError(
            "to_pandas: expected pandas to be installed, found none; pip install pandas"
        ) from None


def _line(row: Sequence[str], widths: Sequence[int], right: Sequence[bool]) -> str:
    cells = (t.rjust(w) if r else t.ljust(w) for t, w, r in zip(row, widths, right, strict=True))
    return "  ".join(cells).rstrip()


def _numeric(values: Sequence[Any]) -> bool:
    return bool(values) and all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if math.isfinite(value) else "-"
    return visible(str(value))
