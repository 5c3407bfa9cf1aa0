"""Which parameters a localizer runs a recording with, and what they were learned from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib import resources
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.yaml_text import load_yaml
from pilotage.experiments.mission import read_parameters
from pilotage.experiments.recordings.drive import BEACONS, RecordedDrive
from pilotage.experiments.values import apply_override, merge
from pilotage.sensors.beacon import BeaconConfig

LEARNED = "ekf-gauss-markov"
SLOW_SHARE = 0.5
"""Variance of a landmark's Gauss-Markov error over that of a single reading."""
SAME_RECORDING_S = 600.0
"""Clocks that begin this close tell of the same drive, also where the log was cut."""


def shipped_parameters(drive: RecordedDrive, localizer: str, form: str) -> tuple[dict[str, Any], list[str]]:
    """Parameters for a recording of this form, and the recordings that they were learned from.

    Never learned from the recording itself: the first set wins that has not seen it.
    """
    if form == "bag":
        return dict(_shipped(form).get(localizer, {})), []
    if localizer != LEARNED:
        return {}, []
    content = _shipped(form)
    if form == "aer1513":
        return _by_data_sheet(drive, content), []
    for chosen in content["sets"]:
        if not any(_same(drive, source) for source in chosen["learned_from"]):
            names = [f"{source['recording']} robot {source['robot']}" for source in chosen["learned_from"]]
            return merge(content["common"], chosen["parameters"]), names
    return dict(content["common"]), []


def with_overrides(localizer: str, parameters: dict[str, Any], overrides: Sequence[str]) -> dict[str, Any]:
    """Lay ``stack.localizer.key=value`` and ``@FILE`` over a localizer's parameters."""
    values: dict[str, Any] = {"stack": {"localizer": {"name": localizer, **parameters}}}
    for override in overrides:
        if override.startswith("@"):
            values = merge(values, _only_the_localizer(override[1:], read_parameters(override[1:])))
        elif override.startswith("stack.localizer.") and not override.startswith("stack.localizer.name"):
            apply_override(values, override)
        else:
            raise InputError(
                f"--set {override}: expected stack.localizer.KEY=VALUE; the rest is the recording's, "
                "the localizer's name comes by --localizer"
            )
    chosen = dict(values["stack"]["localizer"])
    if chosen.pop("name") != localizer:
        raise InputError(
            f"--set: the parameters are of another localizer than '{localizer}'; use --localizer"
        )
    return chosen


def _only_the_localizer(file: str, values: dict[str, Any]) -> dict[str, Any]:
    """Refuse parameters that a recording has no use for, and what is no mapping."""
    at: Any = values
    for key in ("stack", "localizer"):
        found = [str(name) for name in at] if isinstance(at, dict) else type(at).__name__
        if not isinstance(at, dict) or list(at) != [key]:
            raise InputError(f"{file}: expected parameters of stack.localizer and no others, found {found}")
        at = at[key]
    if not isinstance(at, dict):
        raise InputError(f"{file}: stack.localizer: expected a mapping of keys, found {at!r}")
    return values


def _shipped(form: str) -> dict[str, Any]:
    text = (resources.files("pilotage.experiments.recordings") / f"{form}.yaml").read_text(encoding="utf-8")
    content: dict[str, Any] = load_yaml(text, f"{form}.yaml")
    return content


def _by_data_sheet(drive: RecordedDrive, common: dict[str, Any]) -> dict[str, Any]:
    """Noise of the rates per second, at rest as well; landmark errors in proportion to a reading's."""
    beacons = drive.sensors[BEACONS]
    assert isinstance(beacons, BeaconConfig)
    along = {"std_m": math.sqrt(SLOW_SHARE * beacons.range_var_m2)}
    own: dict[str, Any] = {"landmark_range_error": along, "landmark_bearing_error": along}
    if drive.rate_var is not None:
        distance, angle = drive.rate_var
        nothing = ("distance_var_m2_per_m", "angle_var_rad2_per_m", "angle_var_rad2_per_rad")
        own["odometry"] = dict.fromkeys(nothing, 0.0)
        own |= {"distance_var_m2_per_s": distance, "angle_var_rad2_per_s": angle}
    # What is not logged is motion of the usual kind.
    moved, turned, dt = (x[1:] for x in (drive.distance_m, drive.angle_rad, np.diff(drive.t_s, prepend=0.0)))
    own["unlogged_speed_m_s"] = float(np.sqrt(np.nanmean((moved / dt) ** 2)))
    own["unlogged_turn_rate_rad_s"] = float(np.sqrt(np.nanmean((turned / dt) ** 2)))
    return merge(common, own)


def _same(drive: RecordedDrive, source: dict[str, Any]) -> bool:
    near = abs(drive.begin_s - float(source["begin_s"])) < SAME_RECORDING_S
    return near and drive.robot == source["robot"]
