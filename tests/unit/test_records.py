"""The files of a run: what is written comes back, and what is damaged is named in one line."""

from __future__ import annotations

import json
import math
from dataclasses import fields
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pilotage.core.errors import InputError
from pilotage.core.scan_update import LineVerdict, ScanUpdate
from pilotage.core.types import Event, Pose2
from pilotage.maps.cell_map import CellState
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.records.cells import SheetData
from pilotage.records.events import read_events, write_events
from pilotage.records.grid import read_grid_layer, write_grid
from pilotage.records.metrics import read_metrics, write_metrics
from pilotage.records.numbers import number
from pilotage.records.plans import Plan, Plans, read_plans, write_plans
from pilotage.records.run_data import read_run
from pilotage.records.run_folder import RobotFiles, RunFiles, write_run
from pilotage.records.scans import Sightings, read_sightings, write_sightings
from pilotage.records.terrain import TerrainPictures, read_terrain, write_terrain
from pilotage.records.trace import merged, read_trace, trace_of, write_trace
from pilotage.records.updates import KeptUpdate, read_updates, write_updates
from pilotage.records.world import RobotOutline, World, landmarks_of, read_world, write_world

RNG = np.random.default_rng(3)


def same(one: object, other: object) -> None:
    """Two records hold the same."""
    assert type(one) is type(other)
    for field in fields(one):  # type: ignore[arg-type]
        a, b = getattr(one, field.name), getattr(other, field.name)
        if isinstance(a, np.ndarray):
            np.testing.assert_array_equal(a, b)
        elif isinstance(a, tuple) and a and isinstance(a[0], np.ndarray):
            for x, y in zip(a, b, strict=True):
                np.testing.assert_array_equal(x, y)
        elif isinstance(a, tuple) and a and hasattr(a[0], "__dataclass_fields__"):
            for x, y in zip(a, b, strict=True):
                same(x, y)
        else:
            assert a == b or (a != a and b != b), field.name


def a_world() -> World:
    box = np.array([[0.4, 0.3], [-0.2, 0.3], [-0.2, -0.3], [0.4, -0.3]])
    first = RobotOutline("red", 0.3, start=(1.0, 2.0, 0.5), goals=((3.0, 4.0, None),))
    second = RobotOutline("blue", 0.5, box, (2.0, 2.0, 0.0), ((1.0, 1.0, 0.1), (5.0, 5.0, None)))
    return World(
        segments_m=RNG.uniform(0.0, 9.0, (5, 4)),
        circles_m=np.array([[1.0, 2.0, 0.5]]),
        landmarks=landmarks_of(np.array([7, 9]), np.array([[1.0, 2.0], [3.0, 4.0]])),
        obstacle_polygons_m=(box + 4.0,),
        bounds_m=(0.0, 0.0, 9.0, 9.0),
        robots=(first, second),
        boxes_m=np.array([[0.0, 0.0, 1.0, 1.0]]),
        lines_m=(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]]),),
        tape_width_m=0.02,
        cells=(3, 2),
    )


def a_sheet(world: World) -> SheetData:
    flags = RNG.random((2, 3)) < 0.5
    return SheetData(
        (9.0, 9.0),
        world.boxes_m,
        world.lines_m,
        0.02,
        0.3,
        np.array([[0, 1, 2], [4, 5, 6]], dtype=np.uint8),
        np.full((2, 3), CellState.UNKNOWN, dtype=np.uint8),
        flags,
        ~flags,
        np.where(flags, 1.5, np.nan),
        flags,
        np.array([[1, 2]]),
        ("no path leads there",),
    )


def some_plans() -> Plans:
    path = RNG.random((9, 3))
    plan = Plan(path, path[::4], RNG.random((6, 4)), 1.5, 3.25, 0.01)
    flat = Plan(path[:, :2], path[:2, :2], np.empty((0, 4)), 2.0, 1.0, math.nan)
    return Plans((plan, flat), RNG.random((4, 2)), np.empty((0, 2)))


def some_sightings() -> Sightings:
    levels = RNG.integers(0, 65534, (3, 4)).astype(np.float64)
    ranges = np.where(levels % 3 == 0, np.nan, levels * (12.0 / 65534))
    t_s, angles = np.array([0.1, 0.3, 0.5]), np.linspace(-1.0, 1.0, 4)
    poses, mount = np.array([[0.0, 1.0, 0.5], [2.0, 1.5, 3.0], [np.nan] * 3]), np.array([0.1, 0.0, 0.2])
    driven = np.column_stack([t_s - 0.05, RNG.random((3, 3))])
    return Sightings(
        t_s, ranges, poses, driven, angles, mount, np.array([1, 0, 2]), np.array([7, 9, 7]), 12.0
    )


def an_update() -> KeptUpdate:
    labels = np.array([0, 0, -1])
    update = ScanUpdate(
        np.array([1.0, 2.0, 0.0]),
        np.array([1.1, 2.0, 0.0]),
        np.array([[1.0, 0.0], [2.0, 0.0], [2.5, 0.5]]),
        labels,
        labels,
        np.array([[1.0, 0.0, 2.0, 0.0]]),
        np.full((1, 4), np.nan),
        np.array([math.inf]),
        13.8,
        (LineVerdict.NO_WALL,),
    )
    return KeptUpdate(4.0, "first update", update)


def some_terrain() -> TerrainPictures:
    picture = RNG.integers(0, 256, (4, 5)).astype(np.uint8)
    points, ids = RNG.random((3, 2)), np.array([0, 2, 1])
    size, origin = np.array([50.0, 40.0]), np.array([1.0, 2.0, 0.3])
    return TerrainPictures(
        picture, picture, None, size, origin, size / 2, size / 3, math.nan, points, points, ids, ids
    )


def test_every_file_comes_back_as_it_was_written(tmp_path: Path) -> None:
    world = a_world()
    write_world(tmp_path, world)
    same(read_world(tmp_path), world)
    plans = some_plans()
    write_plans(tmp_path, plans)
    same(read_plans(tmp_path), plans)
    sightings = some_sightings()
    write_sightings(tmp_path, sightings)
    back = read_sightings(tmp_path)
    np.testing.assert_allclose(back.ranges_m, sightings.ranges_m, rtol=1e-12)
    np.testing.assert_array_equal(back.beacon_ids, sightings.beacon_ids)
    terrain = some_terrain()
    write_terrain(tmp_path, terrain)
    found = read_terrain(tmp_path)
    assert found is not None
    same(found, terrain)
    grid = OccupancyGrid(RNG.integers(-1, 101, (3, 4)).astype(np.int8), 0.05, Pose2(1.0, -2.0, 0.3))
    write_grid(tmp_path, grid)
    again = read_grid_layer(tmp_path)
    assert again is not None
    np.testing.assert_array_equal(again.cells, grid.cells)
    assert (again.resolution_m, again.origin) == (grid.resolution_m, grid.origin)


def test_an_update_comes_back_in_the_map_frame(tmp_path: Path) -> None:
    kept = an_update()
    write_updates(tmp_path, [kept])
    (update,) = read_updates(tmp_path)
    np.testing.assert_allclose(update.points_m, kept.update.points_m + np.array([1.0, 2.0]))
    np.testing.assert_allclose(update.ends_m, [[2.0, 2.0, 3.0, 2.0]])
    assert update.verdicts == (LineVerdict.NO_WALL,)
    assert np.isnan(update.walls_m).all()


def test_several_robots_share_one_trace_and_are_told_apart(tmp_path: Path) -> None:
    t_s = np.arange(1.0, 4.0)
    red = {"t_s": t_s, "x_m": t_s + 0.1}
    blue = {"t_s": t_s[:2], "x_m": t_s[:2] + 0.2, "load_kg": np.ones(2)}
    trace = merged({"red": red, "blue": blue})
    np.testing.assert_array_equal(trace.columns["t_s"], [1, 1, 2, 2, 3])
    world, plans = a_world(), some_plans()
    files = RunFiles(
        trace,
        {"success": True},
        (Event(1.0, "plan", "planned"),),
        "mission: two\n",
        world=world,
        robots=(RobotFiles(cells=a_sheet(world)), RobotFiles(plans, some_sightings(), (an_update(),))),
    )
    folder = write_run(tmp_path / "runs", "two-0", files)
    assert json.loads((folder / "metrics.json").read_text())["run_dir"] == str(folder)
    first, second = (read_run(folder, robot=k) for k in range(2))
    assert first.robots == ("red", "blue")
    np.testing.assert_array_equal(first.trace["x_m"], red["x_m"])
    np.testing.assert_array_equal(second.trace["load_kg"], [1.0, 1.0])
    assert np.isnan(first.trace["load_kg"]).all()
    assert first.sheet is not None
    same(first.sheet, a_sheet_like(first.sheet, world))
    assert first.sheet is not None
    assert not first.plans
    assert len(second.plans) == 2
    assert len(second.updates) == 1
    assert len(second.sightings.scan_t_s) == 3
    assert [robot.name for robot in second.world.robots] == ["red", "blue"]
    assert second.world.robots[1].goals[-1] == (5.0, 5.0, None)


def a_sheet_like(sheet: SheetData, world: World) -> SheetData:
    """The same sheet made from the world again."""
    parts = {field.name: getattr(sheet, field.name) for field in fields(sheet)}
    return SheetData(**{**parts, "boxes_m": world.boxes_m, "lines_m": world.lines_m, "tape_width_m": 0.02})


def test_a_folder_is_there_whole_or_not_at_all(tmp_path: Path) -> None:
    files = RunFiles(trace_of({"t_s": np.arange(3.0)}), {"success": True})
    folder = write_run(tmp_path, "a", files)
    before = sorted(path.name for path in folder.iterdir())
    cannot_be_written = RunFiles(files.trace, {"success": object()})
    with pytest.raises(TypeError):
        write_run(tmp_path, "a", cannot_be_written)
    with pytest.raises(TypeError):
        write_run(tmp_path / "new" / "folders", "a", cannot_be_written)
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    assert sorted(path.name for path in folder.iterdir()) == before
    write_run(tmp_path, "a", files)
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_lost_robot_claims_no_pose(tmp_path: Path) -> None:
    columns = {"t_s": np.arange(3.0), "est_x_m": np.ones(3), "localized": np.array([1.0, 0.0, 1.0])}
    folder = write_run(tmp_path, "a", RunFiles(trace_of(columns), {}))
    np.testing.assert_array_equal(np.isnan(read_run(folder).trace["est_x_m"]), [False, True, False])
    assert np.isfinite(read_trace(folder)["est_x_m"]).all(), "the file keeps what was believed"


def test_metrics_that_are_not_finite_are_null(tmp_path: Path) -> None:
    write_metrics(tmp_path, {"a": math.nan, "b": {"c": np.float64(math.inf)}, "d": np.int64(3), "e": [1.5]})
    assert read_metrics(tmp_path) == {"a": None, "b": {"c": None}, "d": 3, "e": [1.5]}


@given(st.one_of(st.floats(), st.integers(), st.text(), st.none(), st.booleans(), st.lists(st.integers())))
def test_a_number_is_a_float_of_this_world_or_nan(value: object) -> None:
    found = number(value)
    assert math.isnan(found) or abs(found) <= 1e30
    if isinstance(value, float) and abs(value) <= 1e30:
        assert found == value


def test_values_beyond_all_measure_are_no_numbers(tmp_path: Path) -> None:
    columns = {"t_s": np.arange(3.0), "x_m": np.array([1.0, 1e308, math.inf])}
    write_trace(tmp_path, trace_of(columns))
    np.testing.assert_array_equal(read_trace(tmp_path)["x_m"], [1.0, math.nan, math.inf])


def test_a_column_of_words_is_no_series(tmp_path: Path) -> None:
    pq.write_table(pa.table({"t_s": [0.0, 1.0], "state": ["a", "b"]}), tmp_path / "trace.parquet")
    assert list(read_trace(tmp_path).columns) == ["t_s"]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("plans.npz", b"PK but none"),
        ("world.json", b'{"segments_m": [[1, 2, 3, 1e300]]}'),
        ("events.jsonl", b'{"t_s": 1.0}\n'),
        ("events.jsonl", b'{"t_s": "x", "kind": "a", "text": "b"}\n'),
        ("mission.yaml", b"a: [1, 2"),
    ],
)
def test_a_damaged_file_is_told_and_the_rest_is_read(tmp_path: Path, name: str, content: bytes) -> None:
    files = RunFiles(trace_of({"t_s": np.arange(3.0)}), {}, (Event(0.0, "a", "b"),), "mission: m\n")
    folder = write_run(tmp_path, "a", files)
    (folder / name).write_bytes(content)
    with pytest.raises(InputError, match=name):
        read_run(folder)
    told: list[str] = []
    assert read_run(folder, on_damage=told.append).trace.steps == 3
    assert len(told) == 1
    assert name in told[0]
    assert "\n" not in told[0]


def test_an_event_without_a_time_is_read_as_it_was_written(tmp_path: Path) -> None:
    """It was written as NaN, which no reader of JSON takes: the folder was there and its report was not."""
    events = [Event(math.nan, "begun", "sometime"), Event(np.float32(1.5), "seen", "something")]  # type: ignore[arg-type]
    write_events(tmp_path, events)
    first, second = read_events(tmp_path)
    assert math.isnan(first.t_s)
    assert (first.text, second.t_s, second.kind) == ("sometime", 1.5, "seen")
    for t_s, kind in ((math.inf, "seen"), ("now", "seen"), (1.0, None)):
        with pytest.raises(ValueError, match="event: expected a finite time, a kind and a text"):
            Event(t_s, kind, "")  # type: ignore[arg-type]
