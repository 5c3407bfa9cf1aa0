"""Cell maps: priorities, the printed format, the true map, the score, what a shift would change."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.evaluation.cell_map_score import score_cell_map, shift_changes
from pilotage.evaluation.true_visits import read_visits
from pilotage.maps.cell_map import CellMap, CellState, TrueCellMap
from pilotage.maps.cell_map_text import format_cell_map, parse_cell_map, read_cell_map
from pilotage.maps.true_cells import SheetFile, length_inside, read_true_map, true_map

ROWS = ["# # #", ". O L", "* V B"]
STAMPED = "Calibrating line sensors\r\n10:00:00.123 -> Map\r\n" + "".join(
    f"10:00:00.{i} -> {row} \r\n" for i, row in enumerate(ROWS)
)


def printed(rows: list[str]) -> CellMap:
    return parse_cell_map("\n".join(rows), "test", len(rows))


@given(hnp.arrays(np.uint8, (5, 5), elements=st.integers(0, 6)))
def test_what_is_written_is_read_back(states: np.ndarray) -> None:
    cells = CellMap(states)
    assert np.array_equal(parse_cell_map(format_cell_map(cells), "test", 5).states, states)
    stamped = format_cell_map(cells, 36_061.25)
    assert stamped.startswith("10:01:01.250 -> ")
    assert np.array_equal(parse_cell_map(stamped, "test", 5).states, states)


def test_the_first_row_is_the_largest_y_and_time_stamps_and_talk_are_skipped() -> None:
    cells = parse_cell_map(STAMPED + "using float Q = 0.08;", "test", 3)
    assert CellState(int(cells.states[2, 0])) is CellState.UNKNOWN
    assert CellState(int(cells.states[1, 1])) is CellState.OBSTACLE
    assert CellState(int(cells.states[0, 1])) is CellState.VISITED


def test_a_cell_never_falls_back_to_a_lower_priority() -> None:
    everywhere = np.ones((2, 2), dtype=np.bool_)
    cells = CellMap.unknown(2, 2)
    for state in (CellState.EXPLORED, CellState.LINE, CellState.VISITED, CellState.UNKNOWN):
        cells = cells.marked(everywhere, state)
    assert np.all(cells.holds(CellState.LINE))


def test_borders_surround_obstacles_and_leave_lines_alone() -> None:
    bordered = printed(["# # #", "# O L", "# # #"]).with_borders()
    assert np.count_nonzero(bordered.holds(CellState.BORDER)) == 7
    assert bordered.states[1, 2] == CellState.LINE


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("\n".join(ROWS[:2]), "a row is missing"),
        ("# # #\n. X L\n* V B", "unknown character 'X'"),
        ("# # #\n. O\n* V B", "expected 3 cells, found 2"),
        ("nothing", "found none"),
        ("", "found none"),
    ],
)
def test_bad_maps_are_told_in_one_line(text: str, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint) as error:
        parse_cell_map(text, "map.txt", 3)
    assert "\n" not in str(error.value)


def test_a_grid_of_zero_cells_is_refused() -> None:
    with pytest.raises(InputError, match="at least"):
        CellMap.unknown(0, 3)
    with pytest.raises(InputError, match="at least"):
        parse_cell_map("", "map.txt", 0)


def test_the_true_map_marks_every_cell_a_box_overlaps_and_every_cell_a_line_crosses() -> None:
    sheet = SheetFile(
        size_m=(1.0, 1.0),
        cells=(4, 4),
        obstacles=((0.01, 0.01, 0.26, 0.2),),
        lines=(((0.6, 0.6), (0.6, 0.9)),),
    )
    truth = true_map(sheet)
    assert truth.cells.holds(CellState.OBSTACLE).nonzero()[1].tolist() == [0, 1]
    assert list(zip(*truth.cells.holds(CellState.LINE).nonzero(), strict=True)) == [(2, 2), (3, 2)]
    # 1 cm of 25 cm and 19 cm of 25 cm: 3 % of the cell's area.
    assert truth.touched is not None
    assert truth.touched[0, 1] == pytest.approx(0.04 * 0.76)
    assert np.count_nonzero(truth.neutral(0.08)) == 1


@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)), min_size=2, max_size=6))
def test_the_lengths_in_the_cells_add_up_to_the_line(corners: list[tuple[float, float]]) -> None:
    points = 0.001 + 0.998 * np.array(corners)
    edges = np.linspace(0.0, 1.0, 8)
    expected = np.hypot(*np.diff(points, axis=0).T).sum()
    assert length_inside(points, edges, edges).sum() == pytest.approx(expected, abs=1e-9)


def test_the_score_counts_letters_free_cells_and_visits() -> None:
    truth = TrueCellMap(printed(["# # #", "O O L", "# # #"]))
    robot = printed(["O . #", "O L L", "* B ."])
    visited = np.zeros((3, 3), dtype=np.bool_)
    visited[[0, 2], [2, 0]] = True
    score = score_cell_map(robot, truth, visited).as_dict()
    assert score["feature_precision_cells"] == [2, 4]
    assert score["feature_recall_all_cells"] == [2, 3]
    assert score["free_accuracy_cells"] == [4, 4]
    assert score["explored_accuracy_cells"] == [6, 8]
    assert score["visited_accuracy_cells"] == [1, 2]
    assert score["coverage_visited"] == pytest.approx(2 / 9)


def test_inner_box_cells_cannot_be_observed() -> None:
    solid = CellMap.unknown(5, 5).marked(np.ones((5, 5), dtype=np.bool_), CellState.OBSTACLE)
    solid.states[0, 0] = CellState.UNKNOWN
    assert np.count_nonzero(TrueCellMap(solid).observable()) == 2


def test_a_map_one_row_too_low_gains_by_moving_north() -> None:
    truth = TrueCellMap(printed(["# # #", "O O L", "# # #"]))
    changes = shift_changes(printed(["# # #", "# # #", "O O L"]), truth)
    assert changes["north"]["feature_precision"] == pytest.approx(1.0)
    assert changes["east"]["feature_precision"] <= 0.0


def test_maps_of_different_size_are_refused() -> None:
    with pytest.raises(InputError, match="3 x 3"):
        score_cell_map(printed(ROWS), TrueCellMap(CellMap.unknown(2, 2)))


def test_the_command_scores_a_map_and_its_visits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot, truth, track = tmp_path / "robot.txt", tmp_path / "truth.yaml", tmp_path / "track.json"
    robot.write_text(STAMPED)
    truth.write_text("size_m: [0.3, 0.3]\ncells: [3, 3]\nobstacles: [[0.11, 0.11, 0.19, 0.19]]\n")
    track.write_text(json.dumps({"visited_cells": [[1, 0], [0, 0]], "grid": {"cells": 3}}))
    assert main(["map-score", str(robot), str(truth), "--visited", str(track), "--json"]) == 0
    score = json.loads(capsys.readouterr().out)
    assert score["feature_precision_cells"] == [1, 2]
    assert score["visited_accuracy_cells"] == [1, 2]
    assert set(score["shift_changes"]) == {"north", "south", "east", "west"}
    assert main(["map-score", str(robot), str(truth)]) == 0
    assert "feature_precision" in capsys.readouterr().out


@pytest.mark.parametrize(
    "content",
    ["[]", "{}", '{"visited_cells": 3, "grid": {"cells": 3}}', '{"visited_cells": [], "grid": {"cells": 4}}'],
)
def test_a_track_of_another_kind_is_refused(content: str, tmp_path: Path) -> None:
    path = tmp_path / "track.json"
    path.write_text(content)
    with pytest.raises(InputError):
        read_visits(path, (3, 3))


@pytest.mark.parametrize(
    "content", ["size_m: [1, 1]\ncells: [0, 5]", "size_m: [1, 1]\nboxes: []", "size_m: [", "3"]
)
def test_a_bad_true_map_is_told_in_one_line(
    content: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot, truth = tmp_path / "robot.txt", tmp_path / "truth.yaml"
    robot.write_text("\n".join(ROWS))
    truth.write_text(content)
    assert main(["map-score", str(robot), str(truth)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_missing_files_are_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere"):
        read_cell_map(tmp_path / "nowhere.txt")
    with pytest.raises(InputError, match="nowhere"):
        read_true_map(tmp_path / "nowhere.yaml")
