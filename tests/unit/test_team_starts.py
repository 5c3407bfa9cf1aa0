"""Where a team begins: on the floor that a planner's nodes reach."""

from __future__ import annotations

import numpy as np

from pilotage.experiments.build.places import OpenFloor
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap

# A room of 8 m x 5 m and one of 3 m x 5 m, a gap of 0.84 m between them.
WALLS = SegmentMap(
    np.array(
        [[0, 0, 11, 0], [11, 0, 11, 5], [11, 5, 0, 5], [0, 5, 0, 0], [8, 0, 8, 2], [8, 2.84, 8, 5]], float
    ),
    np.zeros((0, 3)),
    (0.0, 0.0, 11.0, 5.0),
)
WORLD = WorldMap("pocket", WALLS.bounds_m, geometry=WALLS)


def test_starts_are_not_drawn_where_a_passage_is_as_wide_as_the_body_alone() -> None:
    floor, rng = OpenFloor(WORLD, 0.4, None), np.random.default_rng(0)
    anywhere = [floor.draw(rng) for _ in range(60)]
    easy = [floor.draw(rng, part=floor.easy) for _ in range(60)]
    assert any(place is not None and place.x_m > 8.5 for place in anywhere)
    assert all(place is not None and place.x_m < 8.5 for place in easy)
    # Close to walls as before: only the passages matter.
    assert any(place is not None and min(place.x_m, place.y_m, 5.0 - place.y_m) < 0.5 for place in easy)


def test_where_no_passage_has_more_room_all_of_the_floor_will_do() -> None:
    floor = OpenFloor(WORLD, 2.45, None)
    assert floor.easy.any()
    assert floor.draw(np.random.default_rng(0), part=floor.easy) is not None
