"""Which cells of a study are judged together, and against which of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pilotage.core.errors import InputError, nearest
from pilotage.experiments.studies.cells import Cell
from pilotage.experiments.studies.definition import Group, StudyDefinition


@dataclass(frozen=True, slots=True)
class CellGroup:
    """Cells that are judged together, by their index.

    ``name`` is empty where the study is one group; ``baselines`` holds, one a cell of the group, the cell
    that it is held against, or None.
    """

    name: str
    cells: tuple[int, ...]
    baselines: tuple[int | None, ...]

    @property
    def baseline(self) -> int | None:
        """The one cell of the group that all others of it are held against; None where there is none such."""
        found = {base for base in self.baselines if base is not None}
        if len(found) != 1:
            return None
        (only,) = found
        return only if only in self.cells and self.baselines.count(only) == len(self.cells) - 1 else None


def cell_groups(definition: StudyDefinition, cells: Sequence[Cell]) -> tuple[CellGroup, ...]:
    """The groups that a definition names; without any, all cells are one group.

    The baseline is then the one that the definition names, else the first configuration. Factors that are
    varied one at a time, each alone, are a group each.

    Raises
    ------
    InputError
        A group of no cell, a cell of no group or of two, a baseline that is no cell of its group.
    """
    if not definition.groups:
        return _by_itself(definition, cells)
    home: dict[int, str] = {}
    found = []
    for group in definition.groups:
        members: list[int] = []
        for pattern in group.cells:
            chosen = [cell.index for cell in cells if _is_meant(cell.name, pattern)]
            if not chosen:
                raise _no_cell(f"group '{group.name}'", pattern, cells)
            members += [index for index in chosen if index not in members]
        for index in members:
            if index in home:
                where = f"'{home[index]}' and '{group.name}'"
                raise InputError(f"groups: expected every cell in one, '{cells[index].name}' is in {where}")
            home[index] = group.name
        found.append(CellGroup(group.name, tuple(members), _baselines(group, members, cells)))
    left = next((cell.name for cell in cells if cell.index not in home), None)
    if left is not None:
        raise InputError(f"groups: expected every cell in one, '{left}' is in none")
    return tuple(found)


def baselines(groups: Sequence[CellGroup], cells: int) -> list[int | None]:
    """One a cell of the study: the cell that it is held against, or None."""
    out: list[int | None] = [None] * cells
    for group in groups:
        for index, base in zip(group.cells, group.baselines, strict=True):
            out[index] = base
    return out


def _baselines(group: Group, members: Sequence[int], cells: Sequence[Cell]) -> tuple[int | None, ...]:
    where = f"group '{group.name}', baseline"
    if group.baseline is None:
        return (None,) * len(members)
    if isinstance(group.baseline, str):
        return _all_against(_named(group.baseline, [cells[index] for index in members], where), members)
    inside = [cells[index] for index in members]
    pairs = {_named(cell, inside, where): _named(base, cells, where) for cell, base in group.baseline.items()}
    return tuple(pairs.get(index) for index in members)


def _all_against(base: int, members: Sequence[int]) -> tuple[int | None, ...]:
    return tuple(None if index == base else base for index in members)


def _by_itself(definition: StudyDefinition, cells: Sequence[Cell]) -> tuple[CellGroup, ...]:
    everything = tuple(cell.index for cell in cells)
    if definition.baseline is not None:
        base = _named(definition.baseline, cells, "baseline")
        return (CellGroup("", everything, _all_against(base, everything)),)
    if definition.configurations:
        return (CellGroup("", everything, _all_against(0, everything)),)
    if definition.combine == "one-at-a-time" and len(definition.factors) > 1:
        titles = [factor.title for factor in definition.factors]
        alone = {title: tuple(cell.index for cell in cells if title in cell.values) for title in titles}
        return tuple(CellGroup(title, found, (None,) * len(found)) for title, found in alone.items())
    return (CellGroup("", everything, (None,) * len(everything)),)


def _is_meant(name: str, pattern: str) -> bool:
    return name.startswith(pattern[:-1]) if pattern.endswith("*") else name == pattern


def _named(name: str, cells: Sequence[Cell], where: str) -> int:
    for cell in cells:
        if cell.name == name:
            return cell.index
    raise _no_cell(where, name, cells)


def _no_cell(where: str, name: str, cells: Sequence[Cell]) -> InputError:
    close = nearest(name, [cell.name for cell in cells])
    hint = f"; did you mean '{close}'?" if close else ""
    return InputError(f"{where}: expected the name of a cell, found '{name}'{hint}")
