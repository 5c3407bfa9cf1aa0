"""A study from the command line: what is varied, as ``KEY=a:b:step`` or ``KEY=v1,v2``."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pilotage.core.config import validate
from pilotage.core.errors import InputError
from pilotage.core.whole_number import whole_number
from pilotage.core.yaml_text import load_yaml
from pilotage.experiments.mission import read_parameters
from pilotage.experiments.studies.definition import StudyDefinition
from pilotage.experiments.studies.study import Study, make_study
from pilotage.experiments.values import parse_override


def sweep_study(
    mission: str,
    vary: Sequence[str],
    overrides: Sequence[str],
    trials: int,
    metrics: Sequence[str],
    name: str | None = None,
) -> Study:
    """Make a study that varies a mission's parameters on a grid; without any, its seeds alone.

    Raises
    ------
    InputError
        A key that the mission does not have, an empty range, a step of zero, a value twice.
    """
    values: dict[str, Any] = {
        "study": "sweep",
        "mission": mission,
        "set": settings_of(overrides),
        "factors": [parse_vary(text) for text in vary],
        "trials": trials,
        "metrics": list(metrics),
        "primary": metrics[0] if metrics else None,
    }
    digest = hashlib.sha256(json.dumps(values, sort_keys=True, default=str).encode()).hexdigest()[:6]
    stem = Path(mission).stem
    values["study"] = (
        name
        if name is not None
        else f"sweep-{''.join(c if c.isalnum() or c in '-_.' else '-' for c in stem)}-{digest}"
    )
    return make_study(validate(StudyDefinition, values, ""))


def settings_of(overrides: Sequence[str]) -> dict[str, Any]:
    """Overrides as a study's file has them.

    Raises
    ------
    InputError
        If one is not of the form KEY=VALUE.
    """
    settings: dict[str, Any] = {}
    for override in overrides:
        if override.startswith("@"):
            settings |= _dotted(read_parameters(override[1:]))
        else:
            parts, value = parse_override(override)
            settings[".".join(parts)] = value
    return settings


def _dotted(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested keys as dotted ones; a component's name first, for it drops the parameters of another."""
    found: dict[str, Any] = {}
    for key, value in sorted(values.items(), key=lambda item: item[0] != "name"):
        if isinstance(value, Mapping) and value:
            found |= _dotted(value, f"{prefix}{key}.")
        else:
            found[f"{prefix}{key}"] = value
    return found


def parse_vary(text: str) -> dict[str, Any]:
    """A factor from ``KEY=a:b:step``, ``KEY=a:b:count:log`` or ``KEY=v1,v2``.

    Raises
    ------
    InputError
        If the text is of none of these forms.
    """
    key, equals, right = text.partition("=")
    key = key.strip()
    if not equals or not key or not right.strip():
        raise InputError(f"--vary '{text}': expected KEY=A:B:STEP or KEY=V1,V2")
    parts = right.split(":")
    if len(parts) == 3 and all(_is_number(part) for part in parts):
        start, stop, step = (float(part) for part in parts)
        if step == 0.0:
            raise InputError(f"--vary '{text}': expected a step that is not zero")
        if not all(math.isfinite(number) for number in (start, stop, step)):
            raise InputError(f"--vary '{text}': expected finite numbers")
        if (stop - start) * step < 0.0:
            raise InputError(f"--vary '{text}': an empty range: the step leads away from {stop:g}")
        return {"key": key, "range": {"start": start, "stop": stop, "step": step}}
    if len(parts) == 4 and parts[3].strip() == "log" and all(_is_number(part) for part in parts[:3]):
        return {"key": key, "log_range": _log_range(text, *parts[:3])}
    if ":" in right and all(_is_number(part) for part in parts):
        raise InputError(f"--vary '{text}': expected a range as A:B:STEP")
    values = load_yaml(f"[{right}]", f"--vary '{text}'")
    numbers = [_number(value) for value in values]
    return {"key": key, "values": numbers}


def _log_range(text: str, start: str, stop: str, count: str) -> dict[str, float | int]:
    number = whole_number(count.strip())
    if number is None:
        raise InputError(f"--vary '{text}': expected a whole number of values as COUNT, found '{count}'")
    first, last = float(start), float(stop)
    if not (0.0 < first < math.inf and 0.0 < last < math.inf):
        raise InputError(f"--vary '{text}': expected finite numbers above 0")
    return {"start": first, "stop": last, "count": number}


def _number(value: Any) -> Any:
    """YAML 1.1 reads 1e-3 as text; take such a text for the number it is."""
    if isinstance(value, str) and _is_number(value):
        return float(value)
    return value


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
