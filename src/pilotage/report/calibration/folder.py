"""Reading a calibration folder: ``calibration.json`` and the data that it rests on."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray

KINDS = ("odometry", "range", "heading", "commands")
CALIBRATION_FILE, DATA_FILE, PARAMETER_FILE = "calibration.json", "data.npz", "parameters.yaml"


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


def read_calibration(folder: Path) -> CalibrationData:
    """Read a calibration folder.

    Raises
    ------
    InputError
        Where it is not whole or one of its files is broken.
    """
    try:
        answer = json.loads((folder / CALIBRATION_FILE).read_text(encoding="utf-8"))
        with np.load(folder / DATA_FILE, allow_pickle=False) as file:
            arrays = {name: np.asarray(file[name], dtype=np.float64) for name in file.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise InputError(f"{folder}: expected a calibration folder, found: {error}") from None
    if not isinstance(answer, dict) or answer.get("calibration") not in KINDS:
        raise InputError(f"{folder / CALIBRATION_FILE}: expected a calibration, found something else")
    parameters = folder / PARAMETER_FILE
    text = parameters.read_text(encoding="utf-8") if parameters.is_file() else ""
    return CalibrationData(folder, answer, arrays, text)
