"""A study of short missions: three radii, four seeds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pilotage.core.config import validate
from pilotage.experiments.studies.definition import StudyDefinition
from pilotage.experiments.studies.engine import run_study
from pilotage.experiments.studies.options import StudyOptions
from pilotage.experiments.studies.study import Study, make_study


def small(**changes: Any) -> Study:
    """The study, with what is changed of its definition."""
    values: dict[str, Any] = {
        "study": "small",
        "mission": "museum-plan",
        "set": {"stack.planner.iterations": 300, "stack.planner.stop": "first"},
        "factors": [{"key": "stack.planner.turning_radius_m", "values": [0.3, 0.5, 0.8]}],
        "trials": 4,
        "metrics": ["planned_length_m", "smoothness"],
        "primary": "planned_length_m",
    }
    return make_study(validate(StudyDefinition, values | changes, ""))


def run_small(folder: Path, resume: bool) -> int:
    """Run it by two workers."""
    run_study(small(), folder, StudyOptions(workers=2, resume=resume))
    return 0
