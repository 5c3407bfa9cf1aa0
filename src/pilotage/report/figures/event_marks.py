"""Where and when events happened, as marks that can be told apart: a run may have thousands of events."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes

from pilotage.core.types import FloatArray
from pilotage.records.run_data import RunData
from pilotage.report.event_kinds import event_kind
from pilotage.report.figures import layers

_WIDTH_PT, _NARROW_PT = 660.0, 0.2
_NEAR_PT = 7.0


@dataclass(frozen=True, slots=True)
class EventPlace:
    """Events of one colour at one place: where it is, and their numbers in the list."""

    x_m: float
    y_m: float
    colour: str
    numbers: list[int] = field(default_factory=list)

    @property
    def text(self) -> str:
        """The numbers short: 3–5, 9; only the first and the last where there are many."""
        runs: list[list[int]] = []
        for number in self.numbers:
            if runs and number == runs[-1][-1] + 1:
                runs[-1].append(number)
            else:
                runs.append([number])
        texts = [str(part[0]) if len(part) == 1 else f"{part[0]}–{part[-1]}" for part in runs]
        return ", ".join(texts) if len(texts) <= 3 else f"{texts[0]} … {texts[-1]}"


def event_places(run: RunData, points_per_m: float, of: Collection[int] | None = None) -> list[EventPlace]:
    """Return where events happened that a map marks, all or those ``of`` some indices; near ones as one."""
    places: list[EventPlace] = []
    # The places of each colour by square of the page, so that only neighbours are measured.
    squares: dict[tuple[str, float, float], list[int]] = {}
    for index, (event, (x_m, y_m)) in enumerate(zip(run.events, _places_m(run).tolist(), strict=True)):
        kind = event_kind(event.kind)
        if (of is not None and index not in of) or not kind.on_map or not math.isfinite(x_m + y_m):
            continue
        reach_m = _NEAR_PT / points_per_m
        column, row = x_m // reach_m, y_m // reach_m
        around = [(column + i, row + j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
        candidates = [each for square in around for each in squares.get((kind.colour, *square), ())]
        near = [i for i in candidates if math.dist((places[i].x_m, places[i].y_m), (x_m, y_m)) < reach_m]
        if near:
            places[min(near)].numbers.append(index + 1)
        else:
            squares.setdefault((kind.colour, column, row), []).append(len(places))
            places.append(EventPlace(x_m, y_m, kind.colour, [index + 1]))
    return places


def event_lines(axes: Axes, run: RunData) -> None:
    """Draw a thin line at the time of each event; of those that nobody could tell apart one."""
    narrow_s = max(float(np.ptp(run.trace.t_s)), 1e-9) * _NARROW_PT / _WIDTH_PT
    times: dict[str, dict[int, float]] = {}
    for event in run.events:
        if math.isfinite(event.t_s):
            place = round(min(max(event.t_s / narrow_s, -1e9), 1e9))
            times.setdefault(event_kind(event.kind).colour, {}).setdefault(place, event.t_s)
    for colour, of_colour in times.items():
        x = np.repeat(list(of_colour.values()), 3)
        y = np.tile([0.0, 1.0, np.nan], len(of_colour))
        across = axes.get_xaxis_transform()
        axes.plot(x, y, color=colour, linewidth=0.6, alpha=0.7, transform=across, scalex=False, scaley=False)


def _places_m(run: RunData) -> FloatArray:
    """Where the robot was at each event (n, 2), or believed to be; NaN where neither is known."""
    times = np.array([event.t_s for event in run.events])
    places = np.full((len(times), 2), np.nan)
    timed = np.flatnonzero(np.isfinite(times))
    if not run.trace.steps or not len(timed):
        return places
    steps = np.minimum(np.searchsorted(run.trace.t_s, times[timed]), run.trace.steps - 1)
    true, believed = layers.true_path(run)[steps], layers.estimated_path(run)[steps]
    places[timed] = np.where(np.isfinite(true).all(axis=1, keepdims=True), true, believed)
    return places
