"""A mission in full: every component's defaults written out."""

from __future__ import annotations

import hashlib
from typing import Any

import yaml

from pilotage.experiments.kinds import kind_of
from pilotage.experiments.mission_kind import Record
from pilotage.experiments.roles import REGISTRIES
from pilotage.missions.mission import Mission

LONGEST_SLUG_BYTES = 120


def resolved_yaml(mission: Mission, record: Record | None = None) -> str:
    """The mission in full, every component's defaults included; with a record, what came from files too."""
    return yaml.safe_dump(resolved_values(mission, record), sort_keys=False, allow_unicode=True)


def resolved_values(mission: Mission, record: Record | None = None) -> dict[str, Any]:
    """The same as plain values.

    Raises
    ------
    InputError
        Where a component or one of its parameters is not what it should be.
    """
    values = mission.model_dump(mode="json")
    for role, choice in values["stack"].items():
        if role in REGISTRIES and choice is not None:
            values["stack"][role] = _resolved(role, choice, f"stack.{role}")
    for name, choice in values["robot"].get("sensors", {}).items():
        values["robot"]["sensors"][name] = _resolved("sensor", choice, f"robot.sensors.{name}")
    if record is not None:
        kind_of(mission).inline(record, values)
    return values


def _resolved(role: str, choice: dict[str, Any], where: str) -> dict[str, Any]:
    """A component's name with all its parameters, those left to their defaults too."""
    parameters = {key: value for key, value in choice.items() if key != "name"}
    config = REGISTRIES[role].configure(choice["name"], parameters, where)
    return {"name": choice["name"], **config.model_dump(mode="json")}


def run_name(mission: Mission) -> str:
    """``<mission>-<seed>-<hash>``: the same mission and seed have the same name."""
    digest = hashlib.sha256(resolved_yaml(mission).encode()).hexdigest()[:8]
    return f"{_slug(mission.mission)}-{mission.run.seed}-{digest}"


def _slug(text: str) -> str:
    """A name fit for a folder."""
    plain = "".join(c if c.isalnum() or c in "-_." else "-" for c in text)
    # Letters of some scripts take four bytes, and a folder's name has 255 with what stands around this.
    short = plain.encode()[:LONGEST_SLUG_BYTES].decode(errors="ignore")
    return short.strip(".") or "mission"
