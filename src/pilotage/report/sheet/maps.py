"""The robot's map beside the truth (exploration report, fig. 6 and 7) and as the robot would print it."""

from __future__ import annotations

from collections import Counter

import numpy as np
from matplotlib.axes import Axes

from pilotage.core.types import BoolArray
from pilotage.maps.cell_map import FEATURES, CellState
from pilotage.records.cells import SheetData
from pilotage.records.numbers import number
from pilotage.records.run_data import RunData
from pilotage.report import quantities
from pilotage.report.sheet.panels import draw_grid, draw_things, fill_cells, sheet_panels
from pilotage.report.style import BLUE, GREEN, INK, ORANGE, PURPLE, SKY, VERMILLION, Illustration, Key, render

_LIGHT = "#cfe3f1"
_PALE = "#d9dde2"
_STATES = (
    (CellState.OBSTACLE, "O obstacle", INK, "obstacle"),
    (CellState.LINE, "L line", PURPLE, "line"),
    (CellState.BORDER, "B border", "#f2c879", "border"),
    (CellState.RFID, "R RFID", GREEN, "rfid"),
    (CellState.VISITED, ". visited", SKY, "visited"),
    (CellState.EXPLORED, "* explored", "#dcebf5", "explored"),
)

_REASON_COLOURS = (VERMILLION, BLUE, ORANGE, PURPLE, GREEN)


ACCURACY_KEYS = (
    Key("right", BLUE, "band", layer="right", opacity=1.0),
    Key("there, but not on the map", _LIGHT, "band", layer="missed", opacity=1.0),
    Key("on the map, but not there", ORANGE, "band", layer="wrong", opacity=0.75),
    Key("the wrong letter", VERMILLION, "band", layer="letter", opacity=0.75),
)


def accuracy_figure(run: RunData) -> Illustration:
    """Visited cells and features: what is right, what was missed, what is wrong."""
    slug, title = "accuracy", "What the robot's map got right"
    sheet = run.sheet
    if sheet is None:
        return Illustration(slug, title, "", "The run left no cells.npz.")
    figure, (left, right) = sheet_panels(sheet, ["visited cells", "features"])
    draw_visits(left, sheet)
    draw_features(right, sheet)
    shares = [
        f"{name} {quantities.share(number(run.metrics.get(key)))}"
        for key, name in (
            ("visited_accuracy", "visited cells right"),
            ("feature_precision", "features right"),
            ("feature_recall", "observable features found"),
        )
        if np.isfinite(number(run.metrics.get(key)))
    ]
    caption = (
        "Left: the cells that the robot was in, and its own visited layer, which line and border marks do "
        "not overwrite. Right: its OBSTACLE and LINE cells against the true ones."
        + (f" In numbers: {', '.join(shares)}." if shares else "")
    )
    alt = "Two maps of cells: visited and feature cells that the robot's map has right, missed and wrong"
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), ACCURACY_KEYS)


def draw_visits(axes: Axes, sheet: SheetData) -> None:
    """Cells that the robot was in, against its own visited layer."""
    both = sheet.visited & sheet.own_visited
    fill_cells(axes, sheet, both, BLUE, "right")
    fill_cells(axes, sheet, sheet.visited & ~both, _LIGHT, "missed")
    fill_cells(axes, sheet, sheet.own_visited & ~both, ORANGE, "wrong", 0.75)
    draw_grid(axes, sheet)
    draw_things(axes, sheet, filled=False)


def draw_features(axes: Axes, sheet: SheetData) -> None:
    """Its OBSTACLE and LINE cells against the true ones."""
    mapped, real = _features(sheet.states), _features(sheet.true_states)
    correct = mapped & (sheet.states == sheet.true_states)
    fill_cells(axes, sheet, correct, BLUE, "right")
    fill_cells(axes, sheet, real & ~correct, _LIGHT, "missed")
    fill_cells(axes, sheet, mapped & ~correct & ~real, ORANGE, "wrong", 0.75)
    fill_cells(axes, sheet, mapped & ~correct & real, VERMILLION, "letter", 0.75)
    draw_grid(axes, sheet)
    draw_things(axes, sheet, filled=False)


def printed_figure(run: RunData) -> Illustration:
    """The cell map as the robot would print it, with the true things as outlines."""
    slug, title = "printed-map", "The map as the robot would print it"
    sheet = run.sheet
    if sheet is None:
        return Illustration(slug, title, "", "The run left no cells.npz.")
    figure, (axes,) = sheet_panels(sheet, [""])
    keys = [Key("# unknown", _PALE, "band", opacity=1.0)]
    fill_cells(axes, sheet, sheet.states == CellState.UNKNOWN, _PALE, "unknown", z=0.2)
    for state, name, colour, layer in _STATES:
        cells = np.asarray(sheet.states == state)
        if cells.any():
            fill_cells(axes, sheet, cells, colour, layer, z=0.3)
            keys.append(Key(name, colour, "band", layer=layer, opacity=1.0))
    draw_grid(axes, sheet)
    draw_things(axes, sheet, filled=False)
    for k, reason in enumerate(dict.fromkeys(str(reason) for reason in sheet.left_reasons)):
        where = np.asarray([str(other) == reason for other in sheet.left_reasons], dtype=np.bool_)
        cells = np.zeros(sheet.shape, dtype=np.bool_)
        cells[sheet.left[where, 0], sheet.left[where, 1]] = True
        colour, layer = _REASON_COLOURS[k % len(_REASON_COLOURS)], f"left-{k}"
        fill_cells(axes, sheet, cells, colour, layer, 0.35, 0.6)
        keys.append(Key(f"left: {reason}", colour, "band", layer, 0.35))
    reasons = Counter(sheet.left_reasons)
    told = ", ".join(f"{count} {reason}" for reason, count in reasons.most_common())
    caption = (
        "cells.txt holds this map in the robot's own characters, map.yaml and map.pgm for ROS. Outlines are "
        "the true boxes and tapes." + (f" Cells left unvisited: {told}." if told else "")
    )
    alt = "The robot's own cell map with its states"
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), tuple(keys))


def _features(states: np.ndarray[tuple[int, int], np.dtype[np.uint8]]) -> BoolArray:
    return np.asarray(np.isin(states, FEATURES))
