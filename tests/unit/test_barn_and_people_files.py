"""BARN courses and people's tracks: reading, interpolation, metric, and files that are wrong."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.evaluation.barn import BarnRun, barn_metric, lane_within, summarize
from pilotage.evaluation.least_time import time_bound_s
from pilotage.logs.barn import read_barn
from pilotage.logs.people import read_people

CYLINDERS = "world,x_m,y_m\n0,-1.0,5.0\n0,-2.0,6.0\n2,-1.5,5.5\n"
PATHS = "world,k,x_m,y_m\n0,0,-2.0,3.0\n0,1,-2.0,13.0\n2,1,-2.0,13.0\n2,0,-2.0,3.0\n"
WORLDS = "world,cylinders,path_length_m,optimal_time_s\n0,2,10.0,5.0\n2,1,10.0,5.0\n"


def folder(tmp_path: Path, cylinders: str = CYLINDERS, paths: str = PATHS, worlds: str = WORLDS) -> Path:
    """The three files in a folder."""
    (tmp_path / "cylinders.csv").write_text(cylinders)
    (tmp_path / "paths.csv").write_text(paths)
    (tmp_path / "worlds.csv").write_text(worlds)
    return tmp_path


def test_courses_are_read_in_order(tmp_path: Path) -> None:
    first, second = read_barn(folder(tmp_path))
    assert (first.number, second.number) == (0, 2)
    assert first.circles_m.tolist() == [[-1.0, 5.0, 0.075], [-2.0, 6.0, 0.075]]
    assert second.path_xy_m.tolist() == [[-2.0, 3.0], [-2.0, 13.0]]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"cylinders": CYLINDERS.replace("2,-1.5", "4,-1.5")}, "world 4 is not in"),
        ({"cylinders": CYLINDERS.replace("0,-2.0,6.0\n", "")}, "expected 2 cylinders of world 0, found 1"),
        ({"cylinders": CYLINDERS.replace("-1.5", "x")}, "expected a number, found 'x'"),
        ({"cylinders": CYLINDERS.replace("-1.5", "1000")}, "within 50, found 1000"),
        ({"paths": PATHS.replace("2,1,-2.0,13.0\n", "")}, "two points or more in world 2"),
        ({"worlds": WORLDS.replace("\n2,1", "\n0,1")}, "found one twice"),
        ({"worlds": WORLDS.replace("0,2,10.0,5.0", "0,2,10.0,0.0")}, "above 0"),
        ({"worlds": WORLDS.replace("\n2,", "\n2.5,")}, "whole number"),
        ({"worlds": "world,cylinders\n0,2\n"}, "missing: path_length_m"),
    ],
)
def test_a_damaged_folder_is_one_line(tmp_path: Path, change: dict[str, str], words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read_barn(folder(tmp_path, **change))
    assert "\n" not in str(caught.value)


def test_a_folder_without_the_files_says_which(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"missing: cylinders.csv, paths.csv, worlds.csv"):
        read_barn(tmp_path)
    with pytest.raises(InputError, match="found none"):
        read_barn(tmp_path / "nothing")


@given(st.floats(0.0, 200.0), st.floats(0.1, 20.0))
def test_the_metric_stays_between_an_eighth_and_a_half(time_s: float, optimal_s: float) -> None:
    metric = barn_metric(True, time_s, optimal_s)
    assert 0.125 - 1e-12 <= metric <= 0.5 + 1e-12
    assert barn_metric(False, time_s, optimal_s) == 0.0
    assert barn_metric(True, time_s + 1.0, optimal_s) <= metric


def test_runs_are_summed_up_over_worlds() -> None:
    runs = [
        BarnRun(0, 0, True, False, False, 6.0, 5.0),
        BarnRun(0, 1, True, False, False, 20.0, 5.0),
        BarnRun(2, 0, False, True, False, 3.0, 5.0),
    ]
    summary = summarize(runs)
    assert summary.metric == pytest.approx((0.5 + 0.25 + 0.0) / 3.0)
    assert (summary.trials, summary.worlds) == (3, 2)
    assert summary.time_s == pytest.approx(13.0)
    assert summary.collision == pytest.approx(1.0 / 3.0)
    with pytest.raises(InputError, match="one run or more"):
        summarize([])
    with pytest.raises(InputError, match="metric"):
        barn_metric(True, math.nan, 5.0)


def test_people_walk_straight_between_their_annotations(tmp_path: Path) -> None:
    path = tmp_path / "tracks.txt"
    path.write_text("0\t1.0\t0.0\t0.0\n10\t1.0\t0.4\t0.8\n10\t2.0\t5.0\t5.0\n20\t2.0\t5.0\t6.0\n")
    tracks = read_people(path)
    rows, places = tracks.at(0.1)
    assert rows.tolist() == [0]
    assert np.allclose(places, [[0.1, 0.2]])
    assert tracks.at(0.5)[1].tolist() == [[5.0, 5.25]]
    assert tracks.at(0.9)[0].shape == (0,)
    assert tracks.slots(1.0).tolist() == [0, 0, 1, 1]
    assert tracks.duration_s == pytest.approx(0.8)


def test_who_comes_long_after_another_has_his_row(tmp_path: Path) -> None:
    path = tmp_path / "tracks.txt"
    path.write_text("0 7 0 0\n10 7 1 0\n30 8 0 0\n40 8 1 0\n100 9 0 0\n110 9 1 0\n")
    tracks = read_people(path, 10.0)
    assert tracks.duration_s == 11.0
    assert tracks.slots(3.0).tolist() == [0, 0, 1, 1, 0, 0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0 1 0.0 0.0\n0 1 1.0 0.0\n", "is there twice"),
        ("0 1 0.0 0.0\n10 2 1.0 0.0\n", "seen twice"),
        ("0 1.5 0.0 0.0\n", "person: expected a whole number"),
        ("0 1 0.0\n", "expected 4 columns"),
        ("0 1 0.0 nan\n", "finite"),
    ],
)
def test_damaged_tracks_are_one_line(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "tracks.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        read_people(path)


def test_the_time_bound_is_the_straight_way_in_an_empty_lane() -> None:
    sides = np.array([[x, y, 0.075] for x in (-2.0, 2.0) for y in np.arange(0.0, 10.0, 0.15)])

    def bound(posts: FloatArray, goal_y: float = 10.0) -> float | None:
        lane = lane_within(posts, -1.0, goal_y + 1.0)
        return time_bound_s(lane, (0.0, 0.0), (0.0, goal_y), 1.0, 0.2, 2.0, 3.0)

    straight = bound(sides)
    assert straight == pytest.approx(9.0 / 2.0 + 2.0 / 6.0)
    around = bound(np.vstack([sides, [[0.0, 5.0, 0.5]]]))
    assert around is not None
    assert around > 4.84
    assert bound(sides, 1.2) == pytest.approx((2.0 * 0.2 / 3.0) ** 0.5)
    assert bound(np.vstack([sides, [[x, 5.0, 0.3] for x in np.arange(-1.6, 1.7, 0.2)]])) is None
