"""``mission.yaml``: the mission in full, so that the run is run again from it alone."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pilotage.core.yaml_text import load_yaml
from pilotage.records.reading import text_of

MISSION_FILE = "mission.yaml"


def write_mission(folder: Path, text: str) -> None:
    """Write the mission's YAML text."""
    (folder / MISSION_FILE).write_text(text, encoding="utf-8", errors="replace")


def read_mission(folder: Path) -> tuple[Mapping[str, Any], str]:
    """Read the mission's values and its text; both empty where there is no such file.

    The values are plain and not validated: a report of an old run must not depend on today's schema.

    Raises
    ------
    InputError
        One line, where the file is no YAML.
    """
    path = folder / MISSION_FILE
    text = text_of(path, "a mission")
    values = load_yaml(text, str(path))
    return (values if isinstance(values, dict) else {}), text
