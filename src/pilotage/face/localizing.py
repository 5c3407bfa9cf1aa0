"""Recordings localized in a map."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from pilotage.core import given
from pilotage.core.errors import InputError, unknown_name
from pilotage.core.given import FilePath
from pilotage.core.interruptions import interruptible
from pilotage.core.types import FloatArray, Pose2
from pilotage.face.runs import Run


@interruptible()
def localize(
    log: FilePath,
    *,
    map: FilePath | None = None,  # noqa: A002 - the word for it
    landmarks: FilePath | None = None,
    start: Sequence[float] | FloatArray | Literal["unknown"] | None = None,
    topics: Sequence[str] = (),
    truth: FilePath | None = None,
    from_s: float = 0.0,
    to_s: float = math.inf,
    format: Literal["bag", "mrclam", "aer1513", "stops"] | None = None,  # noqa: A002 - as the command line calls it
    robot: int | None = None,
    localizer: str | None = None,
    max_range_m: float | None = None,
    set: Mapping[str, Any] | None = None,  # noqa: A002 - as the command line calls it
    out: FilePath = "runs",
) -> Run:
    """Run a localizer over a recording, and judge it where the truth is known.

    Parameters
    ----------
    log
        A ROS 1 or 2 bag, an MCAP file or a CARMEN log; a MRCLAM folder, an AER1513 MATLAB file, or a CSV of a
        rover's stops (dead reckoning, each stretch by what the others taught).
    map, landmarks
        bag: what to localize in: a shipped map's name or a map file, for scans; a table id, x_m, y_m.
    start
        bag: x, y, theta at the first reading, or "unknown": the localizer has to find itself. None: where
        the truth says, else unknown.
    topics
        bag: scans, odometry, velocities, gyroscope or landmarks by name, where the usual ones are not meant.
    truth
        bag: true poses in the map: a topic, ``/tf:PARENT:CHILD``, or a TUM file. Without any the run is
        judged by what the localizer holds of itself.
    from_s, to_s
        bag: the part that counts, in seconds after its first reading.
    format
        None: as it looks.
    robot
        mrclam: which of its robots, 1 to 5.
    localizer
        A registered localizer; None: ``particle-filter`` on scans, ``ekf-landmarks`` on a bag's landmarks,
        else ``ekf-gauss-markov``.
    max_range_m
        aer1513: readings beyond are left out.
    set
        The localizer's parameters by dotted key, ``stack.localizer.gate`` and the like.

    Returns
    -------
    Run
        With the same metrics, trace and report as a simulated one; ``trajectory.tum`` in its folder is the
        path by the recording's clock, as long as the localizer held itself for localized.

    Raises
    ------
    InputError
        Where the recording is not what it should be; of a bag without what is needed the message tells what
        it holds.
    """
    from pilotage.experiments.recordings.form import FORMATS, Setting
    from pilotage.experiments.recordings.localize import localize_log

    if format is not None and given.word("format", format) not in FORMATS:
        raise unknown_name("format", format, FORMATS)
    setting = Setting(
        None if map is None else str(given.path("map", map)),
        None if landmarks is None else given.path("landmarks", landmarks),
        _start(start),
        given.words("topics", topics),
        None if truth is None else str(given.path("truth", truth)),
        given.number("from_s", from_s),
        given.number("to_s", to_s, high=math.inf),
    )
    result = localize_log(
        given.path("log", log),
        given.folder("out", out),
        form=format,
        robot=None if robot is None else given.whole("robot", robot),
        localizer=None if localizer is None else given.word("localizer", localizer),
        overrides=given.overrides("set", set),
        max_range_m=None if max_range_m is None else given.number("max_range_m", max_range_m, above=0.0),
        setting=setting,
    )
    return Run(result.run_dir)


def _start(start: Sequence[float] | FloatArray | str | None) -> Pose2 | Literal["unknown"] | None:
    if start is None:
        return None
    if isinstance(start, str):
        if start != "unknown":
            raise InputError(f"start: expected x, y, theta or 'unknown', found '{start}'")
        return "unknown"
    return Pose2.from_array(given.array("start", start, 3))
