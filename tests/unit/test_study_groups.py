"""Groups of a study's cells: which cells are judged together, and against which of them."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pilotage.core.config import validate
from pilotage.core.errors import InputError
from pilotage.evaluation.judge import judge
from pilotage.experiments.mission import load_mission
from pilotage.experiments.studies.definition import StudyDefinition
from pilotage.experiments.studies.export import write_csv
from pilotage.experiments.studies.groups import baselines, cell_groups
from pilotage.experiments.studies.study import Study, load_study, make_study, shipped_studies

GATE = "stack.localizer.gate"
FILTERS = [
    {"name": "beacons, plain", "set": {}},
    {"name": "beacons, gate 0.9", "set": {GATE: 0.9}},
    {"name": "walls, plain", "set": {"stack.localizer.name": "ekf-walls"}},
    {"name": "walls, gate 0.9", "set": {"stack.localizer.name": "ekf-walls", GATE: 0.9}},
]


def study(**keys: Any) -> Study:
    values = {"study": "grouped", "mission": "museum-route", "configurations": FILTERS, **keys}
    return make_study(validate(StudyDefinition, values, ""))


def test_without_groups_all_cells_are_held_against_the_first_configuration() -> None:
    (group,) = cell_groups((made := study()).definition, made.cells)
    assert (group.cells, group.baselines) == ((0, 1, 2, 3), (None, 0, 0, 0))


def test_each_group_has_a_baseline_of_its_own() -> None:
    made = study(
        groups=[
            {"name": "on beacons", "cells": ["beacons, *"], "baseline": "beacons, plain"},
            {"name": "on walls", "cells": ["walls, *"], "baseline": "walls, plain"},
        ]
    )
    found = cell_groups(made.definition, made.cells)
    assert [group.cells for group in found] == [(0, 1), (2, 3)]
    assert baselines(found, 4) == [None, 0, None, 2]


def test_cells_can_be_held_against_those_of_another_group() -> None:
    pairs = {"walls, gate 0.9": "beacons, gate 0.9", "walls, plain": "beacons, plain"}
    made = study(
        groups=[
            {"name": "on beacons", "cells": ["beacons, *"]},
            {"name": "on walls", "cells": ["walls, *"], "baseline": pairs},
        ]
    )
    assert baselines(cell_groups(made.definition, made.cells), 4) == [None, None, 0, 1]


@pytest.mark.parametrize(
    ("groups", "said"),
    [
        ([{"name": "a", "cells": ["beacons, *"]}], "'walls, plain' is in none"),
        ([{"name": "a", "cells": ["*"]}, {"name": "b", "cells": ["walls, *"]}], "is in 'a' and 'b'"),
        ([{"name": "a", "cells": ["*", "sonar, *"]}], "found 'sonar, *'"),
        ([{"name": "a", "cells": ["*"], "baseline": "walls, plane"}], "did you mean 'walls, plain'"),
        (
            [
                {"name": "a", "cells": ["beacons, *"], "baseline": "walls, plain"},
                {"name": "b", "cells": ["walls, *"]},
            ],
            "group 'a', baseline",
        ),
    ],
)
def test_groups_that_do_not_fit_the_cells_are_refused_in_one_line(
    groups: list[dict[str, Any]], said: str
) -> None:
    with pytest.raises(InputError) as caught:
        study(groups=groups)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_baseline_beside_groups_is_refused() -> None:
    with pytest.raises(InputError, match="one in each of the groups"):
        study(groups=[{"name": "a", "cells": ["*"]}], baseline="walls, plain")


def test_contrasts_are_of_metrics_that_are_reported() -> None:
    with pytest.raises(InputError, match="found 'nees'"):
        study(metrics=["nees_mean"], contrasts=[{"metric": "nees", "against": "nees_mean"}])


def test_factors_varied_one_at_a_time_are_groups_of_their_own() -> None:
    made = study(
        configurations=[],
        combine="one-at-a-time",
        factors=[
            {"key": GATE, "values": [0.9, 0.99]},
            {"key": "stack.localizer.odometry_var_scale", "values": [1.0, 2.0, 4.0]},
        ],
    )
    found = cell_groups(made.definition, made.cells)
    assert [(group.name, group.cells) for group in found] == [
        ("gate", (0, 1)),
        ("odometry_var_scale", (2, 3, 4)),
    ]


def test_a_components_name_is_set_before_its_parameters_whatever_comes_first() -> None:
    scale = "stack.localizer.odometry_var_scale"
    factors = [
        {"key": scale, "values": [0.1, 10.0]},
        {"key": "stack.localizer.name", "values": ["ekf-walls"]},
    ]
    cells = study(configurations=[], factors=factors).cells
    for cell, value in zip(cells, (0.1, 10.0), strict=True):
        localizer = load_mission("museum-route", cell.overrides).model_dump()["stack"]["localizer"]
        assert (localizer["name"], localizer["odometry_var_scale"]) == ("ekf-walls", value)
    (mixed,) = study(
        configurations=[{"name": "mixed", "set": {scale: 10.0, "stack.localizer.name": "ekf-walls"}}]
    ).cells
    assert [text.partition("=")[0] for text in mixed.overrides] == ["stack.localizer.name", scale]


def test_what_is_said_about_cells_changes_no_row_and_so_no_digest() -> None:
    told = [{**entry, "values": {"gate": i}} for i, entry in enumerate(FILTERS)]
    groups = [{"name": "all", "cells": ["*"]}]
    assert study(configurations=told, groups=groups).digest == study().digest
    moved = [{**entry, "set": {**entry["set"], GATE: 0.5}} for entry in FILTERS]  # type: ignore[dict-item]
    assert study(configurations=moved).digest != study().digest


def test_every_cell_is_judged_against_its_own_baseline_and_pairs_within_trials() -> None:
    cell, trial = np.repeat(np.arange(4), 8), np.tile(np.arange(8), 4)
    first = np.array([1.0, 3.0, 10.0, 16.0])[cell] + 0.1 * trial
    other = first - 0.5 - 0.01 * trial
    judged = judge(cell, trial, {"a": first, "b": other}, [None, 0, None, 2], [("a", "b")])
    means = [None if entry is None else round(entry.mean, 9) for entry in judged.differences["a"]]
    assert means == [None, 2.0, None, 6.0]
    within = judged.contrasts["a", "b"]
    assert [round(entry.mean, 9) for entry in within] == [0.535] * 4
    across = [entry for row in judged.differences.values() for entry in row if entry is not None]
    assert all(entry.p_corrected > entry.p_value for entry in (*across, *within))


def test_exported_seeds_are_whole_numbers_and_values_stand_beside_settings(tmp_path: Path) -> None:
    told = [{**entry, "values": {"gate": 0.5 + i}} for i, entry in enumerate(FILTERS)]
    made = study(configurations=told)
    row = {"row": 1, "cell": 1, "trial": 0, "seed": 20, "status": "done", "reason": "", "seconds": 0.1}
    rows = [{**row, "metrics": {"seed": 20, "nees_mean": 3.0}, "timings": {}}]
    write_csv(rows, made, tmp_path / "trials.csv")
    (found,) = csv.DictReader((tmp_path / "trials.csv").read_text().splitlines())
    assert (found["seed"], found["factor.gate"], found["nees_mean"]) == ("20", "1.5", "3.0")


def test_every_shipped_study_stands_and_its_settings_are_in_groups() -> None:
    for name in shipped_studies():
        made = load_study(name)
        found = cell_groups(made.definition, made.cells)
        assert sorted(index for group in found for index in group.cells) == list(range(len(made.cells)))


def test_the_published_planner_agrees_with_itself_where_its_three_tables_meet() -> None:
    # 0.5, 0.5, 1.5 is a setting of each: running means taken apart must give the same path three times.
    cells = {cell.name: cell.published for cell in load_study("museum-planner").cells}
    met = [
        cells[name] for name in ("turning radius=0.5", "validation distance=0.5", "connection distance=1.5")
    ]
    for metric in ("planned_length_m", "smoothness"):
        assert len({entry[metric] for entry in met}) == 1
    assert len(cells) == 31
    assert all(
        {"planned_length_m", "first_solution_s", "smoothness"} <= set(entry) for entry in cells.values()
    )


def test_the_robots_published_trials_stand_beside_faults_off_and_on() -> None:
    cells = {cell.name: cell.published for cell in load_study("romi-ablation").cells}
    assert cells["exploration, fusion"]["coverage_visited"] == 0.392
    for name, published in cells.items():
        if name.startswith("faults on: "):
            assert published == cells[name.removeprefix("faults on: ")] != {}


def test_the_filters_variances_stand_in_a_full_grid_with_both_filters() -> None:
    made = load_study("museum-noise")
    keys = ("measurement variance factor", "odometry variance factor")
    for filter_name in ("beacons", "walls"):
        grid = {
            tuple(cell.values[key] for key in keys)
            for cell in made.cells
            if cell.name.startswith(f"{filter_name}, ") and "gate 0" not in cell.name
        }
        assert grid == {(m, o) for m in (0.1, 1, 10) for o in (0.1, 1, 10)}
    for cell in made.cells:
        # What a configuration says that its settings amount to is what they set.
        if "measurement variance factor" in cell.values:
            said = dict(text.split("=", 1) for text in cell.overrides)
            scale = "stack.localizer.measurement_var_scale"
            assert float(said.get(scale, 1.0)) == cell.values["measurement variance factor"]
            assert float(said["stack.localizer.gate"]) == cell.values["gate"]
