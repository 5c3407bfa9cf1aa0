"""A small study whose trials do as they are told, and what they give when let alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pilotage.core.config import validate
from pilotage.experiments.studies.database import DATABASE
from pilotage.experiments.studies.definition import StudyDefinition
from pilotage.experiments.studies.rows import read_rows
from pilotage.experiments.studies.study import Study, make_study

TESTS = Path(__file__).parents[1]
RADII = (0.3, 0.5, 0.8)


def study_of(**changes: Any) -> Study:
    """Three radii, some seeds; what its trials give is told by ``hostile_trials``."""
    values: dict[str, Any] = {
        "study": "hostile",
        "mission": "museum-plan",
        "factors": [{"key": "stack.planner.turning_radius_m", "values": list(RADII)}],
        "trials": 6,
    }
    return make_study(validate(StudyDefinition, values | changes, ""))


def expected(row: int) -> dict[str, float]:
    """What a row gives that was let alone."""
    return {"planned_length_m": 1000.0 * RADII[row % 3] + row // 3}


def rows_of(folder: Path) -> list[dict[str, Any]]:
    rows, trouble = read_rows(folder / DATABASE)
    assert not trouble
    return rows
