"""From recordings with truth to what commanded velocities do: for ``pilotage calibrate commands``."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import yaml

from pilotage.calibration.drive_commands import DELAYS_S, DriveCommands, calibrate_commands
from pilotage.calibration.drive_summary import drive_summary
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray
from pilotage.experiments.calibrate import CalibrationResult, write_calibration
from pilotage.logs.bag_calibration import commands_of_bag
from pilotage.logs.bag_messages import is_bag
from pilotage.logs.mrclam import ROBOTS, MrclamLog, read_mrclam
from pilotage.maps.landmark_table import read_landmark_table
from pilotage.maps.world_map import NO_LANDMARKS
from pilotage.records.calibration import PARAMETER_FILE, SETS_FILE

LOCALIZER = "ekf-gauss-markov"


def commands_from(
    places: Sequence[Path],
    out: Path,
    *,
    robots: Sequence[int] = (),
    leave_one_out: bool = False,
    topics: Sequence[str] = (),
    truth: str | None = None,
    landmarks: Path | None = None,
) -> CalibrationResult:
    """Calibrate from bags, or folders of MRCLAM recordings; without ``robots`` from all that are in them.

    With a table of ``landmarks`` a bag's camera is calibrated too. With ``leave_one_out`` a file of parameter
    sets is written too: one learned from all recordings, and one without each of them, so that none is ever
    run with parameters learned from itself.
    """
    bags = [is_bag(place) for place in places]
    if any(bags):
        if not all(bags) or robots:
            other = f"--robot {robots[0]}" if robots else f"{places[bags.index(False)]} beside a bag"
            raise InputError(f"calibrate commands: expected bags alone, found {other}")
        recordings = [(place, 0) for place in places]
        known = NO_LANDMARKS if landmarks is None else read_landmark_table(landmarks)
        logs = [commands_of_bag(place, topics, truth, known) for place in places]
    elif topics or truth is not None or landmarks is not None:
        raise InputError("calibrate commands: --topic, --truth and --landmarks are for bags")
    else:
        recordings = [(place, robot) for place in places for robot in _robots(place, robots)]
        logs = [read_mrclam(place, robot) for place, robot in recordings]
    _refuse_twice(recordings, logs)
    names = [_named(place, log) for (place, _), log in zip(recordings, logs, strict=True)]
    found = calibrate_commands(logs)
    answer: dict[str, object] = {
        "calibration": "commands",
        "simulated": False,
        "format": "bag" if any(bags) else "mrclam",
    }
    answer |= drive_summary(found, [(named, _alone(log)) for named, log in zip(names, logs, strict=True)])
    texts = {PARAMETER_FILE: _parameter_yaml(found, names)}
    if leave_one_out:
        texts[SETS_FILE] = _sets_yaml(found, logs, names)
    data: dict[str, FloatArray] = {"delays_s": DELAYS_S, "delay_cost": found.delay_cost}
    for i, rows in enumerate(found.rows):
        data |= {
            f"{i}/window_t_s": rows.window_t_s,
            f"{i}/windows": rows.windows,
            f"{i}/log_ratio": rows.log_ratio,
            f"{i}/log_cosine": rows.log_cosine,
        }
    return write_calibration(out, answer, data, texts)


def _robots(place: Path, robots: Sequence[int]) -> list[int]:
    """The robots asked for, or all whose odometry is in the folder."""
    if robots:
        if len(set(robots)) < len(robots):
            raise InputError(f"--robot: expected every robot once, found {' '.join(map(str, robots))}")
        return list(robots)
    if not place.is_dir():
        raise InputError(f"{place}: expected the folder of a MRCLAM data set, found none there")
    there = [robot for robot in ROBOTS if (place / f"Robot{robot}_Odometry.dat").exists()]
    if not there:
        raise InputError(f"{place}: expected files such as Robot1_Odometry.dat in it, found none")
    return there


def _refuse_twice(recordings: Sequence[tuple[Path, int]], logs: Sequence[MrclamLog]) -> None:
    """A recording given twice would narrow every interval for nothing."""
    for i, log in enumerate(logs):
        for other in logs[:i]:
            if np.array_equal(log.odometry_t_s, other.odometry_t_s) and np.array_equal(
                log.truth, other.truth
            ):
                place, robot = recordings[i]
                named = f"{place} robot {robot}" if robot else str(place)
                raise InputError(f"calibrate commands: expected different recordings, found {named} twice")


def _named(place: Path, log: MrclamLog) -> dict[str, object]:
    """Which recording it is; its begin tells it also from a copy under another name."""
    begin_s = max(float(log.truth_t_s[0]), float(log.odometry_t_s[0]))
    robot = {"robot": log.robot} if log.robot else {}
    return {"recording": place.resolve().name, **robot, "begin_s": round(begin_s, 3)}


def _alone(log: MrclamLog) -> DriveCommands | None:
    try:
        return calibrate_commands([log])
    except InputError:
        return None


def _parameter_yaml(found: DriveCommands, names: Sequence[dict[str, object]]) -> str:
    """YAML that sets the localizer's parameters, to be laid over ``pilotage localize``."""
    intervals = "".join(
        f"#   {name}: {e.value:.4g}, 95 %: {e.low:.4g} to {e.high:.4g}\n"
        for name, e in found.estimates.items()
    )
    learned = ", ".join(
        f"{named['recording']} robot {named['robot']}" if "robot" in named else str(named["recording"])
        for named in names
    )
    use = (
        "LOG --format mrclam --robot N" if "robot" in names[0] else f"BAG --localizer {LOCALIZER} --topic CMD"
    )
    values = {"stack": {"localizer": {"name": LOCALIZER, **found.parameters()}}}
    return (
        "# Drive and camera as calibrated by 'pilotage calibrate commands'. Use it with another recording:\n"
        f"#   pilotage localize {use} --set @<this file>\n"
        f"# Learned from {learned}.\n{intervals}" + yaml.safe_dump(values, sort_keys=False)
    )


def _sets_yaml(found: DriveCommands, logs: Sequence[MrclamLog], names: Sequence[dict[str, object]]) -> str:
    """The sets as ``mrclam.yaml`` ships them: all recordings first, then without each of them in turn."""
    if len(logs) < 2:
        raise InputError("--leave-one-out: expected two or more recordings, found one")
    sets = [{"learned_from": list(names), "parameters": found.parameters()}]
    for left in range(len(logs)):
        kept = [i for i in range(len(logs)) if i != left]
        fit = calibrate_commands([logs[i] for i in kept])
        sets.append({"learned_from": [names[i] for i in kept], "parameters": fit.parameters()})

    # By way of JSON, so that no name is written as an alias of another set's.
    return yaml.safe_dump(json.loads(json.dumps({"sets": sets})), sort_keys=False)
