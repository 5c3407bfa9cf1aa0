"""``calibration.json`` and what lies beside it: the answer, the data that it rests on, parameter files."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.limits import DATA_BYTES
from pilotage.core.types import FloatArray
from pilotage.records.arrays import read_arrays, write_arrays
from pilotage.records.calibration_answers import ANSWERS, require_answer
from pilotage.records.calibration_arrays import require_arrays
from pilotage.records.metrics import clean
from pilotage.records.reading import broken, cleaned, is_there, object_of, text_of
from pilotage.records.run_folder import draft_folder

KINDS = tuple(ANSWERS)
CALIBRATION_FILE, DATA_FILE, PARAMETER_FILE = "calibration.json", "data.npz", "parameters.yaml"
SETS_FILE = "sets.yaml"
AGAIN = "calibrate again"


@dataclass(frozen=True, slots=True)
class CalibrationData:
    """A calibration as it was saved: the answer, the arrays by name, the parameter file's text or ''."""

    folder: Path
    answer: Mapping[str, Any]
    arrays: Mapping[str, FloatArray]
    parameters: str

    @property
    def kind(self) -> str:
        """One of ``KINDS``."""
        return str(self.answer.get("calibration", ""))


def write_calibration(
    out: Path, answer: Mapping[str, object], data: Mapping[str, FloatArray], texts: Mapping[str, str]
) -> tuple[dict[str, Any], Path]:
    """Write ``calibrate-<what>-<hash>`` and return the answer with its paths, and the folder.

    The same data and answer have the same name. ``texts`` holds parameter files by their names.
    """
    digest = hashlib.sha256(json.dumps(clean(dict(answer)), sort_keys=True).encode())
    for key in sorted(data):
        digest.update(np.ascontiguousarray(data[key]).tobytes())
    folder = out / f"calibrate-{answer['calibration']}-{digest.hexdigest()[:8]}"
    named: dict[str, Any] = {**answer, "calibration_dir": str(folder)}
    if PARAMETER_FILE in texts:
        named["parameter_file"] = str(folder / PARAMETER_FILE)
    if SETS_FILE in texts:
        named["sets_file"] = str(folder / SETS_FILE)
    with draft_folder(folder) as draft:
        for name, text in texts.items():
            (draft / name).write_text(text, encoding="utf-8", errors="replace")
        write_arrays(draft / DATA_FILE, data)
        (draft / CALIBRATION_FILE).write_text(json.dumps(clean(named), indent=2) + "\n", encoding="utf-8")
    return named, folder


def is_calibration(folder: Path) -> bool:
    """Say whether a folder holds a calibration."""
    return (folder / CALIBRATION_FILE).exists()


def read_calibration(folder: Path) -> CalibrationData:
    """Read a calibration folder.

    Raises
    ------
    InputError
        Where it is not whole or one of its files is broken.
    """
    path = folder / CALIBRATION_FILE
    if not is_there(path):
        raise InputError(f"{folder}: expected a calibration folder, found no {CALIBRATION_FILE} in it")
    answer = cleaned(object_of(path, "a calibration"))
    if answer.get("calibration") not in KINDS:
        raise InputError(f"{path}: expected a calibration, found something else")
    try:
        require_answer(answer)
    except ValueError as error:
        raise broken(path, error, AGAIN) from None
    archive = read_arrays(folder / DATA_FILE, DATA_BYTES)
    if archive is None:
        raise InputError(f"{folder}: expected a calibration folder, found no {DATA_FILE} in it")
    try:
        arrays = require_arrays(archive, answer)
    except ValueError as error:
        raise broken(folder / DATA_FILE, error, AGAIN) from None
    return CalibrationData(folder, answer, arrays, text_of(folder / PARAMETER_FILE, "a parameter file"))
