"""What a caller may hand in: of every kind of wrong value an InputError that names the argument."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pilotage as pl

WRONG: tuple[Any, ...] = (
    math.nan,
    10**400,
    1j,
    b"\xff",
    "a\0b",
    "\ud800",
    object(),
    (i for i in range(3)),
    [[1, 2], [3]],
    [None],
    {1: 2},
    np.full((3, 4), 1e300),
    np.ones((3, 4), complex),
    np.array([None, "a"], object),
    np.ma.masked_array(np.ones(2), [False, True]),
)
"""In the place of whatever an argument should be."""
BOX = [[0, 0, 6, 0], [6, 0, 6, 4], [6, 4, 0, 4], [0, 4, 0, 0]]
CELLS = np.zeros((8, 9), dtype=bool)
LINE = 2.0 / np.cos(np.radians(np.linspace(-45, 45, 91)))
TRUTH = np.column_stack([np.linspace(0.0, 5.0, 51), np.zeros(51), np.zeros(51)])


def filtered(**changed: Any) -> Any:
    """A filter, a prediction and an update, one of their arguments another."""
    steps: dict[str, Any] = {"distance_m": 0.5, "angle_rad": 0.0}
    seen: dict[str, Any] = {"ids": [0, 1], "ranges_m": [3.5, 3.0], "bearings_rad": [0.0, 1.7]}
    made: dict[str, Any] = {"landmarks": [[4.0, 0.0], [0.0, 3.0]]}
    for key, value in changed.items():
        next((held for held in (steps, seen) if key in held), made)[key] = value
    return pl.filters.EkfLandmarks(**made).predict(**steps).update(**seen)


def walls(**changed: Any) -> Any:
    return pl.planners.on_walls(**({"segments_m": BOX, "start": (1, 1), "goal": (5, 1)} | changed))


def cells(**changed: Any) -> Any:
    asked: dict[str, Any] = {"blocked": CELLS, "start": (1, 1), "goal": (5, 5)}
    return pl.planners.on_cells(**(asked | changed))


def lines(**changed: Any) -> Any:
    return pl.lines.extract(**({"ranges_m": LINE} | changed))


def judged(**changed: Any) -> Any:
    return pl.evaluate(**({"estimate": TRUTH, "reference": TRUTH} | changed))


def planned(**changed: Any) -> Any:
    return pl.plan(**({"map": "museum", "start": (1, 1), "goal": (5, 1)} | changed))


@pytest.mark.parametrize(
    ("function", "names"),
    [
        (filtered, "landmarks pose cov range_var_m2 angle_var_rad2_per_m gate mount distance_m ids ranges_m"),
        (walls, "segments_m start circles_m bounds_m planner clearance_m seed set"),
        (cells, "blocked start goal planner cost_factors set"),
        (lines, "ranges_m field_of_view_rad max_range_m range_var_m2 seed set"),
        (planned, "map start planner clearance_m slope_limit_deg seed set"),
        (judged, "estimate reference format align scale topics"),
        (pl.draw, "map out resolution_m"),
        (pl.vectorize, "map out tolerance_m resolution_m"),
        (pl.load, "source seed set"),
        (pl.run, "mission seed out save progress"),
        (pl.make, "mission seed"),
        (pl.open_run, "folder"),
        (pl.study, "mission vary trials metrics workers name out resume"),
        (pl.localize, "log map landmarks start topics truth from_s to_s robot localizer max_range_m set out"),
        (pl.slam, "log config topics extend out"),
        (pl.calibrate, "what logs set seed sensor wheel_base_m axis robots leave_one_out topics truth out"),
        (pl.track, "video corners hsv grid size_m radius_m height_m out"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_wrong_arguments_are_refused_by_name(
    function: Callable[..., Any], names: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    needed: dict[Any, dict[str, Any]] = {
        pl.draw: {"map": "museum"},
        pl.vectorize: {"map": "museum"},
        pl.load: {"source": "museum-1"},
        pl.run: {"mission": "museum-1"},
        pl.make: {"mission": "museum-1"},
        pl.study: {"mission": "museum-plan", "vary": {"stack.planner.turning_radius_m": [0.3]}},
        pl.localize: {"log": "none.bag"},
        pl.slam: {"log": "none.bag"},
        pl.calibrate: {"what": "odometry", "logs": "none.csv"},
        pl.track: {"video": "none.mp4"},
    }
    for name in names.split():
        for wrong in WRONG:
            with pytest.raises(pl.InputError) as caught:
                function(**(needed.get(function, {}) | {name: wrong}))
            assert "\n" not in str(caught.value), (name, wrong)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"ids": [0.5, 1.7]}, "ids: expected whole numbers"),
        ({"ids": ["0", "1"]}, "ids: expected numbers of shape"),
        ({"ranges_m": [-3.5, 3.0]}, "ranges_m: expected ranges of 0 or more"),
        ({"ranges_m": [True, False]}, "ranges_m: expected numbers"),
        ({"gate": True}, "gate: expected a number"),
        ({"range_var_m2": 1e308}, "range_var_m2: expected a number"),
    ],
)
def test_what_only_looks_like_a_measurement_is_none(changed: dict[str, Any], told: str) -> None:
    """All of these were taken: ids cut to whole ones, truth values and text as numbers."""
    with pytest.raises(pl.InputError, match=told):
        filtered(**changed)


def test_a_table_of_another_width_is_not_folded_anew() -> None:
    with pytest.raises(
        pl.InputError, match=r"circles_m: expected numbers of shape \(N, 3\), found shape \(3, 4\)"
    ):
        walls(circles_m=np.ones((3, 4)))
    with pytest.raises(pl.InputError, match="blocked: expected truth values"):
        cells(blocked=np.full((8, 9), 100))


def test_what_no_file_could_hold_is_no_setting() -> None:
    endless: list[Any] = []
    endless.append(endless)
    deep: Any = 1.0
    for _ in range(2000):
        deep = [deep]
    for value in (
        endless,
        deep,
        object(),
        1j,
        b"x",
        (i for i in range(3)),
        {1: 2},
        np.array([None])[:0].dtype,
    ):
        with pytest.raises(pl.InputError):
            pl.load("museum-1", set={"run.time_limit_s": value})
    changed = {"run.time_limit_s": np.float32(2.0), "world.start.x_m": np.array(1.5)}
    assert pl.load("museum-1", set=changed).run.time_limit_s == 2.0


@pytest.mark.parametrize("out", ["loop", "nowhere", "loop/in", "file"])
def test_a_folder_that_cannot_be_is_refused_before_anything_runs(out: str, tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "nowhere").symlink_to("/nowhere/at/all")
    (tmp_path / "file").touch()
    with pytest.raises(pl.InputError, match="out: expected a folder, found a"):
        pl.run("museum-one", out=tmp_path / out)


def test_what_is_right_is_taken_in_every_form() -> None:
    """Fortran order, strides, single precision, read-only, big-endian, whole numbers: the same answer."""
    segments = np.array(BOX, dtype=np.float64)
    wide = np.zeros((8, 8))
    wide[::2, ::2] = segments
    fixed = segments.copy()
    fixed.flags.writeable = False
    forms = [segments, BOX, segments[::-1][::-1], np.asfortranarray(segments), wide[::2, ::2], fixed]
    forms += [segments.astype(kind) for kind in (np.float32, ">f8", np.int16, np.uint8)]
    found = [walls(segments_m=form, planner="astar", clearance_m=0.3).path.length_m for form in forms]
    assert found == [found[0]] * len(found)
