"""``metrics.json``: the run's object, the one that ``--json`` prints."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.records.reading import cleaned, object_of

METRICS_FILE = "metrics.json"


def clean(value: Any) -> Any:
    """Make a value fit for JSON: nan and infinities become null, numpy numbers plain ones."""
    if isinstance(value, dict):
        return {key: clean(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [clean(inner) for inner in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def write_metrics(folder: Path, metrics: Mapping[str, object]) -> None:
    """Write the object; what is not finite becomes null."""
    text = json.dumps(clean(dict(metrics)), indent=2) + "\n"
    (folder / METRICS_FILE).write_text(text, encoding="utf-8")


def read_metrics(folder: Path) -> Mapping[str, Any]:
    """Read the object.

    Raises
    ------
    InputError
        One line, where the file is no JSON object.
    """
    found: Mapping[str, Any] = cleaned(object_of(folder / METRICS_FILE, "a run's metrics"))
    return found
