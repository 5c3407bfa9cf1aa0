"""From factors to cells: one cell a setting, with the overrides that make it."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from pilotage.core.errors import InputError, nearest
from pilotage.core.whole_number import whole_number
from pilotage.experiments.studies.definition import CONFIGURATION, Configuration, StudyDefinition
from pilotage.experiments.studies.factors import Factor

Resolve = Callable[[Sequence[str]], Mapping[str, Any] | None]
"""Overrides to the mission's values in full, every default written out."""

MAX_CELLS = 10_000
"""Each of them is laid out and validated before the first trial."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One setting of a study.

    Attributes
    ----------
    name
        Short and unique, such as ``turning_radius_m=0.3`` or ``baseline``.
    values
        By factor, the value that this cell has; one-at-a-time cells name their own factor only.
    overrides
        ``KEY=VALUE`` each, as ``--set`` takes them.
    published
        By metric, what others found for it.
    label
        How it is called among the cells of its group, with units; empty: by its name.
    """

    index: int
    name: str
    values: Mapping[str, Any]
    overrides: tuple[str, ...]
    published: Mapping[str, float]
    label: str = ""

    @property
    def text(self) -> str:
        """How it is called on a page."""
        return self.label or self.name


def make_cells(definition: StudyDefinition, resolve: Resolve) -> tuple[Cell, ...]:
    """Lay out all cells of a study.

    Parameters
    ----------
    resolve
        Gives the mission's values in full under some overrides; a key that none of them knows is refused
        with the nearest right one, and factors that multiply take their bases from it. None of a study that
        is only read: keys were looked at when it ran, and what multiplies is left out of the overrides.

    Raises
    ------
    InputError
        An unknown key, something that cannot be multiplied, or published values of no cell.
    """
    rows = _combinations(definition.factors, definition.combine)
    count = len(rows) * max(1, len(definition.configurations))
    if count > MAX_CELLS:
        raise InputError(f"study '{definition.study}': expected at most {MAX_CELLS} cells, found {count}")
    common = as_overrides(definition.set)
    # With the names that it sets: another ground or localizer has keys of its own.
    _check_keys(definition.set, resolve(common), "set", lambda: resolve(()))
    cells: list[Cell] = []
    for configuration in definition.configurations or (None,):
        base = common if configuration is None else (*common, *as_overrides(configuration.set))
        resolved = resolve(base)
        if configuration is not None:
            where = f"configuration '{configuration.name}'"
            _check_keys(configuration.set, resolved, where, lambda: resolve(common))
        for row in rows:
            cells.append(_cell(len(cells), configuration, row, base, resolved, resolve))
    _unique(cells)
    return tuple(_with_published(definition, cells))


def as_overrides(settings: Mapping[str, Any]) -> tuple[str, ...]:
    """Keys and values as ``--set`` takes them; JSON is YAML on one line.

    Names of components come first: another name takes the parameters that were set before with it.
    """
    ordered = sorted(settings.items(), key=lambda item: not _names_component((item[0],)))
    return tuple(f"{key}={json.dumps(value)}" for key, value in ordered)


def _names_component(keys: Sequence[str]) -> bool:
    return any(key == "name" or key.endswith(".name") for key in keys)


def _combinations(factors: Sequence[Factor], combine: str) -> list[tuple[tuple[Factor, Any], ...]]:
    """For each cell, the factors that it sets and their values."""
    columns = [[(factor, value) for value in factor.settings()] for factor in factors]
    if not columns:
        return [()]
    if combine == "one-at-a-time":
        return [(pair,) for column in columns for pair in column]
    if combine == "zip":
        return list(zip(*columns, strict=True))
    if math.prod(map(len, columns)) > MAX_CELLS:
        raise InputError(f"factors: expected at most {MAX_CELLS} cells, found {math.prod(map(len, columns))}")
    return list(itertools.product(*columns))


def _cell(
    index: int,
    configuration: Configuration | None,
    row: tuple[tuple[Factor, Any], ...],
    base: tuple[str, ...],
    resolved: Mapping[str, Any] | None,
    resolve: Resolve,
) -> Cell:
    values: dict[str, Any] = (
        {} if configuration is None else {CONFIGURATION: configuration.name, **configuration.values}
    )
    overrides = base
    # Levels and names first: they may change a component whose parameter another factor varies.
    for factor, value in sorted(
        row, key=lambda pair: pair[0].levels is None and not _names_component(pair[0].keys)
    ):
        if factor.levels is not None:
            before = partial(resolve, overrides)
            overrides = (*overrides, *as_overrides(factor.levels[value]))
            resolved = resolve(overrides)
            _check_keys(factor.levels[value], resolved, f"level '{value}'", before)
            continue
        if factor.multiply and resolved is None:
            continue
        for key in factor.keys:
            place = _check_key(key, resolved, "factor")
            setting = _times(place, value, key) if factor.multiply else value
            overrides = (*overrides, *as_overrides({key: setting}))
    values |= {factor.title: value for factor, value in row}
    words = [str(values[CONFIGURATION])] if configuration is not None else []
    words += [
        str(value) if factor.levels is not None else f"{factor.title}={factor.said(value)}"
        for factor, value in row
    ]
    return Cell(index, ", ".join(words) or "mission", values, overrides, {})


def _times(base: Any, factor: float, key: str) -> Any:
    if isinstance(base, bool) or not isinstance(base, int | float):
        raise InputError(f"factor '{key}': expected a number in the mission to multiply, found {base}")
    return base * factor


def _check_keys(
    settings: Mapping[str, Any],
    resolved: Mapping[str, Any] | None,
    where: str,
    before: Callable[[], Mapping[str, Any] | None],
) -> None:
    """Refuse keys that the mission does not know; what is taken off (null) it has to know ``before``."""
    for key, value in settings.items():
        try:
            _check_key(key, resolved, where)
        except InputError:
            if value is not None:
                raise
            _check_key(key, before(), where)


def _check_key(key: str, resolved: Mapping[str, Any] | None, where: str) -> Any:
    """What a key holds in the mission in full; InputError with the nearest name where there is no such."""
    place: Any = resolved
    parts = key.split(".")
    for depth, part in enumerate(parts):
        if isinstance(place, Mapping):
            if part not in place:
                known = [str(name) for name in place]
                close = nearest(part, known)
                hint = f"did you mean '{'.'.join([*parts[:depth], close])}'?" if close else f"known: {known}"
                raise InputError(f"{where} '{key}': unknown key '{part}'; {hint}")
            place = place[part]
        elif isinstance(place, list | tuple):
            index = whole_number(part)
            if index is None or index >= len(place):
                raise InputError(f"{where} '{key}': expected an index below {len(place)}, found '{part}'")
            place = place[index]
        elif place is None:
            return None  # an optional section that the mission does without: its model checks the rest
        else:
            raise InputError(f"{where} '{key}': '{'.'.join(parts[:depth])}' is a value, it has no keys")
    return place


def _unique(cells: list[Cell]) -> None:
    seen: dict[str, int] = {}
    for cell in cells:
        if cell.name in seen:
            raise InputError(f"study: two cells are called '{cell.name}'; give the factors other names")
        seen[cell.name] = cell.index


def _with_published(definition: StudyDefinition, cells: list[Cell]) -> list[Cell]:
    found: dict[int, dict[str, float]] = {}
    for number, entry in enumerate(definition.published):
        picked = [cell for cell in cells if _is_meant(cell, entry.cell)]
        if not picked:
            what = entry.cell if isinstance(entry.cell, str) else dict(entry.cell)
            close = nearest(str(what), [cell.name for cell in cells])
            hint = f"; did you mean '{close}'?" if close else ""
            raise InputError(f"published.{number}: expected a cell of the study, found {what}{hint}")
        for cell in picked:
            found.setdefault(cell.index, {}).update(entry.metrics)
    return [
        Cell(cell.index, cell.name, cell.values, cell.overrides, found.get(cell.index, {})) for cell in cells
    ]


def _is_meant(cell: Cell, wanted: str | Mapping[str, Any]) -> bool:
    if isinstance(wanted, str):
        return cell.name == wanted
    return all(name in cell.values and cell.values[name] == value for name, value in wanted.items())
