"""The edge of grid worlds: open floor ends there, closed maps stay as they are."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from pilotage.core.types import Pose2
from pilotage.experiments.build.charts import chart_of
from pilotage.maps.edge import closed
from pilotage.maps.grid_image import write_grey
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.missions.world import WorldConfig
from pilotage.models.footprint import Footprint
from pilotage.sim.worlds.world import World

ROOM = np.zeros((20, 30), np.int8)
ROOM[[0, -1]] = ROOM[:, [0, -1]] = 100


@pytest.mark.parametrize("heading", [0.0, 0.7, -2.0])
def test_a_wall_of_one_cell_lies_around_what_was_there(heading: float) -> None:
    cells = ROOM.copy()
    cells[5, -1] = 0
    grid = OccupancyGrid(cells, 0.1, Pose2(1.0, -2.0, heading))
    fenced = closed(grid)
    assert np.array_equal(fenced.cells[1:-1, 1:-1], cells)
    assert (fenced.blocked().sum() - grid.blocked().sum()) == 2 * (20 + 30) + 4
    places = np.array([[1.0, -2.0], [1.3, -1.5], [0.2, -3.0]])
    assert np.allclose(fenced.places_at(places), grid.places_at(places) + 1.0)


@pytest.mark.parametrize(
    ("unknown", "is_open"), [([(5, 29)], True), ([(5, 29), (6, 12)], True), ([(6, 12)], False)]
)
def test_unknown_cells_lead_out_as_free_ones_do(unknown: list[tuple[int, int]], is_open: bool) -> None:
    cells = ROOM.copy()
    for cell in unknown:
        cells[cell] = -1
    grid = OccupancyGrid(cells, 0.1)
    assert (closed(grid) is not grid) == is_open
    outside = np.pad(ROOM, 3, constant_values=np.int8(-1))
    surrounded = OccupancyGrid(outside, 0.1)
    assert closed(surrounded) is surrounded


def test_nobody_leaves_a_world_of_cells(tmp_path: Path) -> None:
    write_grey(tmp_path / "open.pgm", np.full((40, 60), 254, np.uint8))
    (tmp_path / "open.yaml").write_text(
        "image: open.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    chart = chart_of(WorldConfig(map=str(tmp_path / "open.yaml")))
    assert chart.bounds_m == (0.0, 0.0, 6.0, 4.0)
    world = World.of(chart)
    here = Pose2(3.0, 2.0, 0.3)
    ranges = world.scan(here.as_array()[None], np.linspace(-math.pi, math.pi, 90, endpoint=False), 20.0)
    assert ranges.max() <= math.hypot(3.0, 2.0) + 1e-9
    there, part = world.advance(Footprint.disc(0.3), here, (9.0, 0.0, 0.0))
    assert part < 1.0
    assert there.x_m == pytest.approx(3.0 + 2.7, abs=0.01) or there.y_m == pytest.approx(3.7, abs=0.01)
