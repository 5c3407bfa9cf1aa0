"""A small study whose trials do as they are told, and what they give when let alone."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from pilotage.core.config import validate
from pilotage.experiments.studies.database import DATABASE
from pilotage.experiments.studies.definition import StudyDefinition
from pilotage.experiments.studies.rows import read_rows
from pilotage.experiments.studies.store import Store
from pilotage.experiments.studies.study import Study, make_study
from pilotage.experiments.studies.trial import Outcome

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


def share(folder: Path, go: Path) -> int:
    """Claim and finish rows one by one from when ``go`` is there, and say which."""
    study = study_of()
    print("here", flush=True)  # noqa: T201 - to who waits for all of them
    while not go.exists():
        time.sleep(0.001)
    store = Store(folder, study)
    while tasks := store.claim(1):
        print(tasks[0].row)  # noqa: T201
        store.finish(Outcome(tasks[0].row, {"n": 1.0}, {}))
    store.close()
    return 0
