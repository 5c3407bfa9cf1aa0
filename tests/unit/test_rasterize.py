"""Rasterized segment maps: walls where they are, as thick as asked, without a leak."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from pilotage.core.errors import InputError
from pilotage.experiments.build.charts import load_chart
from pilotage.maps.rasterize import rasterized
from pilotage.maps.segment_map import SegmentMap

coordinate = st.floats(0.0, 10.0).map(lambda v: round(v, 2))
FLOOR = (0.0, 0.0, 10.0, 10.0)


@settings(max_examples=60)
@given(
    st.lists(st.tuples(coordinate, coordinate, coordinate, coordinate), min_size=1, max_size=5),
    st.sampled_from([0.1, 0.25]),
    st.sampled_from([0.0, 0.3, 0.46]),
)
def test_a_cell_is_occupied_where_its_centre_is_near_a_wall(
    walls: list[tuple[float, float, float, float]], resolution: float, inflation: float
) -> None:
    world = SegmentMap(np.array(walls), np.array([[5.0, 5.0, 0.7]]), FLOOR)
    grid = rasterized(world, resolution, inflation)
    width = max(inflation, math.sqrt(0.5) * resolution)
    rng = np.random.default_rng(0)
    for row, column in rng.integers(0, [grid.rows, grid.columns], size=(60, 2)):
        x, y = grid.centres_m(np.array([[row, column]]))[0]
        away = world.distance_m(float(x), float(y))
        if abs(away - width) > 1e-9:
            assert bool(grid.blocked()[row, column]) == (away < width)


@settings(max_examples=40)
@given(st.floats(0.0, math.pi), st.sampled_from([0.1, 0.37]))
def test_a_thin_wall_does_not_leak_in_any_direction(angle: float, resolution: float) -> None:
    c, s = 20.0 * math.cos(angle), 20.0 * math.sin(angle)
    world = SegmentMap(np.array([[5 - c, 5 - s, 5 + c, 5 + s]]), np.zeros((0, 3)), FLOOR)
    grid = rasterized(world, resolution)
    labels, _ = ndimage.label(~grid.blocked(), structure=np.ones((3, 3)))
    left = grid.cell_at(5 - 0.8 * math.sin(angle), 5 + 0.8 * math.cos(angle))
    right = grid.cell_at(5 + 0.8 * math.sin(angle), 5 - 0.8 * math.cos(angle))
    assert labels[left] != 0
    assert labels[right] != 0
    assert labels[left] != labels[right]


def test_the_museum_as_the_report_planned_on_it() -> None:
    # Every wall thickened to about 0.93 m: 0.46 m on each side.
    grid = rasterized(load_chart("museum").walls, 0.05, 0.46)
    assert (grid.rows, grid.columns) == (800, 800)
    start, goal = grid.cell_at(1.0, 1.0), grid.cell_at(2.0, 27.0)
    labels, _ = ndimage.label(~grid.blocked())
    assert labels[start] == labels[goal] != 0
    assert grid.blocked()[grid.cell_at(10.0, 7.5 + 0.4)]
    assert not grid.blocked()[grid.cell_at(10.0, 7.5 + 0.55)]


@pytest.mark.parametrize(("resolution", "inflation"), [(0.0, 0.0), (math.nan, 0.0), (0.1, -1.0)])
def test_bad_numbers_are_refused(resolution: float, inflation: float) -> None:
    world = SegmentMap(np.array([[1.0, 1.0, 2.0, 2.0]]), np.zeros((0, 3)), FLOOR)
    with pytest.raises(InputError, match="expected"):
        rasterized(world, resolution, inflation)
