"""A numbered badge: the number is the event's in the list, its colour the kind's."""

from __future__ import annotations

from matplotlib.axes import Axes

RADIUS_PT = 6.0


def badge(axes: Axes, x: float, y: float, text: str, colour: str, zorder: float = 20.0) -> None:
    """Draw a badge at a place in the axes' data coordinates; wider than a disc where the text is longer."""
    if len(text) <= 2:
        axes.plot(
            [x],
            [y],
            "o",
            markersize=2.0 * RADIUS_PT,
            markerfacecolor="white",
            markeredgecolor=colour,
            markeredgewidth=1.3,
            clip_on=False,
            zorder=zorder,
        )
    axes.text(
        x,
        y,
        text,
        ha="center",
        va="center_baseline",
        fontsize=7.5,
        fontweight="bold",
        zorder=zorder + 1,
        bbox=None
        if len(text) <= 2
        else {"boxstyle": "round,pad=0.25", "facecolor": "white", "edgecolor": colour, "linewidth": 1.3},
    )
