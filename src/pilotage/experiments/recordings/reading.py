"""A recording read by its kind, in the map that is said to be its own."""

from __future__ import annotations

from pathlib import Path

from pilotage.core.errors import InputError
from pilotage.experiments.build.charts import load_chart
from pilotage.experiments.recordings.bag_drive import bag_drive
from pilotage.experiments.recordings.drive import RecordedDrive, aer1513_drive, mrclam_drive
from pilotage.experiments.recordings.form import UNSET, Setting
from pilotage.maps.landmark_table import read_landmark_table
from pilotage.maps.world_map import WorldMap


def read_drive(
    log: Path, form: str, robot: int | None, max_range_m: float | None = None, setting: Setting = UNSET
) -> RecordedDrive:
    """Read a recording.

    Raises
    ------
    InputError
        Where the options do not suit the format, or the recording is not what it should be.
    """
    if form != "bag" and setting != UNSET:
        raise InputError(
            "localize: --map, --landmarks, --start, --topic, --truth, --from and --to are for bags and laser "
            f"logs, found --format {form}"
        )
    if max_range_m is not None and form != "aer1513":
        raise InputError("localize: --max-range is for --format aer1513")
    if form == "mrclam":
        if robot is None:
            raise InputError("localize: expected --robot N for a MRCLAM data set, found none")
        return mrclam_drive(log, robot)
    if robot is not None:
        raise InputError(f"localize: --robot is for --format mrclam; '{log.name}' holds one robot")
    if form == "aer1513":
        return aer1513_drive(log, max_range_m)
    return bag_drive(
        log,
        _chart(log, setting),
        start=setting.start,
        topics=setting.topics,
        truth=setting.truth,
        from_s=setting.from_s,
        to_s=setting.to_s,
    )


def _chart(log: Path, setting: Setting) -> WorldMap:
    marks = None if setting.landmarks is None else read_landmark_table(setting.landmarks)
    if setting.map is not None:
        chart = load_chart(setting.map)
        return chart if marks is None else chart.with_landmarks(marks)
    if marks is None or not len(marks.ids):
        raise InputError(
            f"{log}: expected --map MAP (for scans) or --landmarks TABLE (for landmarks) to localize in, "
            "found neither; 'pilotage slam' makes a map"
        )
    (xmin, ymin), (xmax, ymax) = marks.points_xy_m.min(axis=0), marks.points_xy_m.max(axis=0)
    bounds = (float(xmin) - 0.5, float(ymin) - 0.5, float(xmax) + 0.5, float(ymax) + 0.5)
    return WorldMap("landmarks", bounds, landmarks=marks)
