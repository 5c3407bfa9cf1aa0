"""A small picture of a patrol: `python benchmarks/patrol_picture.py RUN docs/images/museum-patrol.png`.

The floor by the time since it was last seen at the end, each robot, and where it was in the last minute.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from pilotage.records.run_data import read_run
from pilotage.report.team import colour_of

LAST_S = 60.0


def draw(folder: Path, out: Path) -> None:
    """Draw a run folder's patrol into a PNG."""
    first = read_run(folder)
    if first.patrol is None or first.world is None:
        raise SystemExit(f"{folder}: expected a run of task 'patrol', found another")
    figure = Figure(figsize=(6.0, 6.0), dpi=100, layout="tight")
    axes = figure.add_subplot()
    cells, half = first.patrol.cells_xy_m, 0.5 * first.patrol.cell_m
    columns = np.round((cells[:, 0] - cells[:, 0].min()) / (2 * half)).astype(int)
    rows = np.round((cells[:, 1] - cells[:, 1].min()) / (2 * half)).astype(int)
    image = np.full((rows.max() + 1, columns.max() + 1), np.nan)
    end_s = float(first.trace["t_s"][-1])
    image[rows, columns] = end_s - first.patrol.last_seen_s
    low, high = cells.min(axis=0) - half, cells.max(axis=0) + half
    shown = axes.imshow(
        image, origin="lower", extent=(low[0], high[0], low[1], high[1]), cmap="YlOrBr", vmin=0.0, vmax=LAST_S
    )
    axes.add_collection(LineCollection(first.world.segments_m.reshape(-1, 2, 2).tolist(), colors="black"))
    for robot in range(int(first.metrics["team_size"])):
        trace = read_run(folder, robot=robot).trace
        late = trace["t_s"] >= end_s - LAST_S
        x, y = trace["true_x_m"][late], trace["true_y_m"][late]
        axes.plot(x, y, color=colour_of(robot), linewidth=1.5)
        axes.plot(x[-1], y[-1], "o", color=colour_of(robot), markersize=9, markeredgecolor="black")
    axes.set_aspect("equal")
    axes.set_axis_off()
    bar = figure.colorbar(shown, ax=axes, shrink=0.6, label="seconds since last seen")
    bar.outline.set_visible(False)
    figure.savefig(out, pil_kwargs={"optimize": True})


if __name__ == "__main__":
    mpl.use("Agg")
    draw(Path(sys.argv[1]), Path(sys.argv[2]))
