"""Several lasers of one robot as one: what a stack that asks for the robot's scan is told of."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.sensor import Mount, SensorConfig

_FULL = 2.0 * math.pi - 1e-6


class JointLidarConfig(LidarConfig):
    """The data sheet of the scan that several lasers make together, seen from between them.

    Not to be named in a mission: a robot with several lasers has it.
    """

    of: tuple[str, ...] = ()
    """The sensors that are joined."""


def joint_lidar(sensors: Mapping[str, SensorConfig], where: str = "robot.sensors") -> JointLidarConfig | None:
    """The sheet of all lasers among a robot's sensors together; None where it has not several.

    Its beams lie as close as those of the finest, over the directions in which any of them looks and those
    between; it is as noisy as the noisiest.

    Raises
    ------
    InputError
        Where they do not scan at the same time.
    """
    lasers = {name: config for name, config in sensors.items() if isinstance(config, LidarConfig)}
    if len(lasers) < 2:
        return None
    sheets = list(lasers.values())
    if len({sheet.rate_hz for sheet in sheets}) > 1:
        told = ", ".join(f"{name} {sheet.rate_hz:g} Hz" for name, sheet in lasers.items())
        raise InputError(
            f"{where}: expected lidars of one rate_hz, which are joined to one scan, found {told}; "
            f"give them one rate_hz, or take one off (--set {where}.{list(lasers)[-1]}=null)"
        )
    step_rad = min((sheet.beam_step_rad for sheet in sheets if sheet.beams > 1), default=math.radians(1.0))
    first_rad, view_rad = _arc(sheets, step_rad)
    whole = view_rad >= _FULL
    beams = max(2, math.ceil(view_rad / step_rad - 1e-9) + (0 if whole else 1))
    middle = math.remainder(first_rad + 0.5 * view_rad, 2.0 * math.pi)
    return JointLidarConfig(
        rate_hz=sheets[0].rate_hz,
        mount=Mount(
            x_m=sum(sheet.mount.x_m for sheet in sheets) / len(sheets),
            y_m=sum(sheet.mount.y_m for sheet in sheets) / len(sheets),
            theta_rad=middle,
        ),
        beams=min(beams, 100_000),
        field_of_view_rad=2.0 * math.pi if whole else max(view_rad, step_rad),
        max_range_m=max(sheet.max_range_m for sheet in sheets),
        range_var_m2=max(sheet.range_var_m2 for sheet in sheets),
        of=tuple(lasers),
    )


def lasers_of(sheet: LidarConfig, sensors: Mapping[str, SensorConfig]) -> list[tuple[str, LidarConfig]]:
    """The lasers that a sheet joins, by name; none of a single laser."""
    joined = sheet.of if isinstance(sheet, JointLidarConfig) else ()
    found = ((name, sensors[name]) for name in joined)
    return [(name, config) for name, config in found if isinstance(config, LidarConfig)]


def places_of_lasers_m(sheet: LidarConfig, sensors: Mapping[str, SensorConfig]) -> FloatArray:
    """(V, 2) of the lasers that a sheet joins, in the frame of its scan; none of a single laser."""
    middle = sheet.mount.pose.inverse()
    places = [middle.compose(config.mount.pose).as_array()[:2] for _, config in lasers_of(sheet, sensors)]
    return np.array(places).reshape(-1, 2)


def _arc(sheets: list[LidarConfig], step_rad: float) -> tuple[float, float]:
    """Where the least arc around all that they look at begins, and how wide it is.

    Views that end where others begin, but for less than a step between beams, as two half circles do by
    rounding, leave no gap.
    """
    views = sorted(
        ((sheet.mount.theta_rad - 0.5 * sheet.field_of_view_rad) % (2.0 * math.pi), sheet.field_of_view_rad)
        for sheet in sheets
    )
    # Where one begins beyond all others' ends there is a gap before it; the arc begins after the widest.
    best_rad, begin_rad = 0.0, views[0][0]
    for start, _ in views:
        ends = [(other + width - start) % (2.0 * math.pi) for other, width in views]
        covered = any(
            (start - other) % (2.0 * math.pi) < width + step_rad and other != start for other, width in views
        ) or any(width >= _FULL for _, width in views)
        gap = 0.0 if covered else 2.0 * math.pi - max(ends)
        if gap > best_rad:
            best_rad, begin_rad = gap, start
    return begin_rad, 2.0 * math.pi - best_rad
