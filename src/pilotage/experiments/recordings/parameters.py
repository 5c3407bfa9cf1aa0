"""Which parameters a localizer runs a recording with, and what they were learned from."""

from __future__ import annotations

from importlib import resources
from typing import Any

import yaml

from pilotage.experiments.mission import merge
from pilotage.experiments.recordings.drive import RecordedDrive

LEARNED = "ekf-slow-errors"
SAME_RECORDING_S = 600.0
"""Clocks that begin this close tell of the same drive, also where the log was cut."""


def shipped_parameters(drive: RecordedDrive, localizer: str, form: str) -> tuple[dict[str, Any], list[str]]:
    """Parameters for a recording of this form, and the recordings that they were learned from.

    Never learned from the recording itself: the first set wins that has not seen it.
    """
    if localizer != LEARNED or form != "mrclam":
        return {}, []
    text = (resources.files("pilotage.experiments.recordings") / "mrclam.yaml").read_text(encoding="utf-8")
    content = yaml.safe_load(text)
    for chosen in content["sets"]:
        if not any(_same(drive, source) for source in chosen["learned_from"]):
            names = [f"{source['recording']} robot {source['robot']}" for source in chosen["learned_from"]]
            return merge(content["common"], chosen["parameters"]), names
    return dict(content["common"]), []


def _same(drive: RecordedDrive, source: dict[str, Any]) -> bool:
    near = abs(drive.begin_s - float(source["begin_s"])) < SAME_RECORDING_S
    return near and drive.robot == source["robot"]
