"""What cells are called beside one another: values with their units, what a whole group shares left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from pilotage.evaluation.metric import words_and_unit
from pilotage.experiments.studies.cells import Cell
from pilotage.experiments.studies.definition import CONFIGURATION, StudyDefinition
from pilotage.experiments.studies.groups import CellGroup


def unit_of(definition: StudyDefinition, factor: str) -> str:
    """The unit of a factor's values; none where they multiply, or are of several kinds."""
    known = next((entry for entry in definition.factors if entry.title == factor), None)
    if known is None:
        return words_and_unit(factor)[1]
    units = {words_and_unit(key)[1] for key in known.keys}
    return units.pop() if len(units) == 1 and not known.multiply else ""


def labelled(
    definition: StudyDefinition, cells: Sequence[Cell], groups: Sequence[CellGroup]
) -> tuple[Cell, ...]:
    """The same cells with their labels."""
    factors = {factor.title: factor for factor in definition.factors}
    out = []
    for cell in cells:
        words = [str(cell.values[CONFIGURATION])] if CONFIGURATION in cell.values else []
        for title, value in cell.values.items():
            if title not in factors:
                continue
            unit = unit_of(definition, title)
            after = f"\u00a0{unit}" if unit else ""
            named = factors[title].levels is not None or isinstance(value, str)
            said = definition.said(title, value)
            words.append(said if named else f"{words_and_unit(title)[0]} {said}{after}")
        out.append(", ".join(words) or cell.name)
    for group in groups:
        parts = [out[index].split(", ") for index in group.cells]
        while min(map(len, parts)) >= 1 and max(map(len, parts)) > 1 and len({p[0] for p in parts}) == 1:
            if min(map(len, parts)) == 1:
                # The one that is nothing but what all share keeps its name.
                parts = [p if len(p) == 1 else p[1:] for p in parts]
                break
            parts = [p[1:] for p in parts]
        for index, part in zip(group.cells, parts, strict=True):
            out[index] = ", ".join(part)
    return tuple(replace(cell, label=label) for cell, label in zip(cells, out, strict=True))
