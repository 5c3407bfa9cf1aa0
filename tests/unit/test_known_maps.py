"""Maps that were met before: the same object again, never another one's, and never many."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace

import numpy as np
import pytest

from pilotage.core.content import content_of
from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.experiments.build.charts import chart_of
from pilotage.maps import known_maps
from pilotage.maps.elevation import ElevationModel
from pilotage.maps.known_maps import KEPT, MOST_ANSWERS, OncePerMap, known_map
from pilotage.maps.landmarks import Landmarks
from pilotage.maps.markings import FloorMarkings
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.segment_map import SegmentMap, box_segments
from pilotage.maps.world_map import WorldMap
from pilotage.missions.world import WorldConfig
from pilotage.stack.localization.landmark_filter import known_landmarks
from pilotage.stack.patrol import roadmap
from pilotage.stack.patrol.roadmap import roadmap_of

BOUNDS = (0.0, 0.0, 4.0, 3.0)


def _map(**layers: object) -> WorldMap:
    """One with something in every layer, made anew."""
    values: dict[str, object] = {
        "name": "everything",
        "bounds_m": BOUNDS,
        "geometry": SegmentMap(np.array([[0.0, 0.0, 4.0, 0.0]]), np.zeros((0, 3)), BOUNDS),
        "grid": OccupancyGrid(np.zeros((3, 4), np.int8), 1.0),
        "elevation": ElevationModel(np.zeros((3, 4), np.float32), 1.0),
        "slope_limit_deg": 20.0,
        "markings": FloorMarkings((4.0, 3.0), (4, 3), np.zeros((0, 4)), 0.02, True),
        "landmarks": Landmarks(np.array([1]), np.array([[1.0, 2.0]])),
        "picture": np.zeros((3, 4), np.uint8),
        "open_ground": False,
    } | layers
    return WorldMap(**values)  # type: ignore[arg-type]


OTHER: dict[str, object] = {
    "name": "another",
    "bounds_m": (0.0, 0.0, 4.0, 3.5),
    "geometry": SegmentMap(np.array([[0.0, 0.0, 4.0, 1e-12]]), np.zeros((0, 3)), BOUNDS),
    "grid": OccupancyGrid(np.zeros((3, 4), np.int8), 1.0, Pose2(0.0, 0.0, 1e-9)),
    "elevation": None,
    "slope_limit_deg": 20.5,
    "markings": FloorMarkings((4.0, 3.0), (4, 3), np.zeros((0, 4)), 0.02, False),
    "landmarks": Landmarks(np.array([2]), np.array([[1.0, 2.0]])),
    "picture": np.ones((3, 4), np.uint8),
    "open_ground": True,
}


def test_an_equal_map_is_the_one_that_was_met() -> None:
    first = known_map(_map())
    assert known_map(_map()) is first


def test_every_layer_tells_maps_apart() -> None:
    assert set(OTHER) == {field.name for field in fields(WorldMap)}
    for layer, value in OTHER.items():
        other = _map(**{layer: value})
        assert known_map(_map()) is not known_map(other), layer


def test_only_the_last_few_are_remembered() -> None:
    first = known_map(_map())
    for number in range(KEPT):
        known_map(_map(name=f"map {number}"))
    assert known_map(_map()) is not first
    assert len(known_maps._MET) == KEPT


def test_missions_of_the_same_world_share_their_map() -> None:
    chart = chart_of(WorldConfig(map="museum"))
    assert chart_of(WorldConfig(map="museum")) is chart
    moved = WorldConfig.model_validate({"map": "museum", "landmarks": [{"id": 1, "x_m": 1.0, "y_m": 1.0}]})
    assert chart_of(moved) is not chart


def test_an_answer_is_worked_out_once_and_of_many_the_last_are_kept() -> None:
    answers: OncePerMap[list[int]] = OncePerMap()
    chart, asked = _map(), []

    def work_out(number: int) -> list[int]:
        asked.append(number)
        return [number]

    for number in [0, 0, 1, 0]:
        assert answers.get(chart, number, lambda number=number: work_out(number)) == [number]  # type: ignore[misc]
    assert asked == [0, 1]
    for number in range(1, MOST_ANSWERS + 1):
        answers.get(chart, number, lambda number=number: work_out(number))  # type: ignore[misc]
    answers.get(chart, 0, lambda: work_out(0))
    assert asked[-1] == 0, "the answer that was asked for longest ago is forgotten"
    other = replace(chart)
    answers.get(other, 0, lambda: work_out(-1))
    assert asked[-1] == -1, "another map has answers of its own"


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (np.zeros(4), np.zeros((2, 2))),
        (np.zeros(2, np.int64), np.zeros(2)),
        (("ab", "c"), ("a", "bc")),
        (((1, 2), 3), (1, (2, 3))),
        (1, True),
        ("1", 1),
        (0.0, -0.0),
    ],
)
def test_what_differs_has_other_content(one: object, other: object) -> None:
    assert content_of(one) != content_of(other)
    assert content_of(one) == content_of(one)


@pytest.fixture
def hasty_threads() -> Iterator[None]:
    """Threads that take turns as often as they can."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(usual)


@pytest.mark.usefixtures("hasty_threads")
class TestThreads:
    """A cluster's worker runs a trial in each of its threads; they share what a map says."""

    def test_maps_are_met_and_asked_at_once(self) -> None:
        answers: OncePerMap[int] = OncePerMap()
        charts = [_map(name=f"map {number}") for number in range(KEPT + 3)]

        def ask(number: int) -> int:
            chart = known_map(replace(charts[number % len(charts)]))
            return answers.get(chart, number % (MOST_ANSWERS + 5), lambda: number % (MOST_ANSWERS + 5))

        with ThreadPoolExecutor(8) as pool:
            found = list(pool.map(ask, range(4000)))
        assert found == [number % (MOST_ANSWERS + 5) for number in range(4000)]

    def test_a_roadmap_keeps_few_fields(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(roadmap, "MOST_FIELD_BYTES", 1)
        chart = WorldMap("hall", BOUNDS, geometry=SegmentMap.of(box_segments(2.0, 1.5, 4.0, 3.0, 0.0)))
        places = np.array([[0.5 + 0.5 * k, 1.5] for k in range(6)])
        shared = roadmap_of(chart, places, np.zeros((0, 2)), 0.2, 1.0, 0.25, 0.5, 0.0)
        wanted = [shared.time_s(place).copy() for place in range(6)]

        def ask(number: int) -> bool:
            return bool(np.array_equal(shared.time_s(number % 6), wanted[number % 6]))

        with ThreadPoolExecutor(8) as pool:
            assert all(pool.map(ask, range(4000)))


def test_a_filter_on_landmarks_without_any_is_told_what_else_there_is() -> None:
    bare = WorldMap(
        "bare", BOUNDS, geometry=SegmentMap(np.array([[0.0, 0.0, 4.0, 0.0]]), np.zeros((0, 3)), BOUNDS)
    )
    with pytest.raises(InputError, match=r"ekf-landmarks: .*world\.landmarks.*particle-filter"):
        known_landmarks(bare, "ekf-landmarks")
