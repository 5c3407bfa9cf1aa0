"""Metric against difficulty: every course a point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from pilotage.evaluation.barn import BarnRun
from pilotage.report.style import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    WIDTH_PT,
    Illustration,
    Key,
    render,
)

COLOURS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY)
MARKS = "o^sDvP"
HEIGHT_PT = 260.0


def difficulty_figure(
    runs: Mapping[str, Sequence[BarnRun]], clearance_m: Mapping[int, float]
) -> Illustration:
    """Draw each course's mean metric over the room that its reference path has."""
    figure = Figure(figsize=(WIDTH_PT / 72.0, HEIGHT_PT / 72.0))
    axes = figure.add_axes((0.08, 0.17, 0.9, 0.78))
    keys = []
    for number, (name, member) in enumerate(runs.items()):
        worlds = sorted({run.world for run in member})
        metric = [np.mean([run.metric for run in member if run.world == world]) for world in worlds]
        colour = COLOURS[number % len(COLOURS)]
        axes.plot(
            [clearance_m[world] for world in worlds],
            metric,
            MARKS[number % len(MARKS)],
            color=colour,
            # Rings about each other: where controllers do as well as each other, all can be seen.
            markersize=4.0 + 3.0 * (len(runs) - 1 - number),
            fillstyle="full" if number == len(runs) - 1 else "none",
            alpha=0.8,
        )
        keys.append(Key(name, colour, "spot"))
    axes.set_xlabel("least distance between reference path and a post (m)")
    axes.set_ylabel("metric")
    axes.set_ylim(-0.02, 0.54)
    title, slug = "Difficulty", "difficulty"
    alt = "Metric of every course over the room on its reference path"
    caption = (
        "Each point is a course, the mean over its trials: to the left the courses whose reference path is "
        "tightest. 0.5 is the most that the metric gives."
    )
    return Illustration(slug, title, alt, caption, render(figure, slug, alt), tuple(keys))
