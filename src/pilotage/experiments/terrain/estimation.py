"""Logging a true way and estimating it from the log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import FloatArray, IntArray, Pose2
from pilotage.experiments.certain import exactly
from pilotage.experiments.components import build_component
from pilotage.experiments.ideal_sensors import ideal
from pilotage.experiments.terrain.ground import Ground
from pilotage.experiments.terrain.oracles import true_estimate
from pilotage.maps.landmark_table import read_landmark_table
from pilotage.maps.landmarks import Landmarks
from pilotage.missions.terrain import TerrainMission
from pilotage.sensors.beacon import BeaconConfig
from pilotage.sensors.landmark_log import LandmarkLog
from pilotage.sensors.sensor import SENSORS, SensorConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.sim.rover_sensing import landmark_log
from pilotage.stack.interface import Belief
from pilotage.stack.localization.rover_estimators import ESTIMATORS, LogEstimate

S = TypeVar("S", bound=SensorConfig)
NO_LANDMARKS = Landmarks(np.zeros(0, dtype=np.int64), np.zeros((0, 2)))


@dataclass(frozen=True, slots=True, eq=False)
class Estimation:
    """What the estimator was given and what it said."""

    log: LandmarkLog
    landmarks: Landmarks
    initial: Belief
    estimate: LogEstimate


def estimate(mission: TerrainMission, ground: Ground, truth: FloatArray) -> Estimation:
    """Log the drive along (N, 3) true poses and estimate it.

    Raises
    ------
    InputError
        Where the robot lacks the odometer, or a table of landmarks cannot be used.
    """
    choice = mission.stack.estimator
    assert choice is not None
    sensors = _sensors(mission)
    odometer = _one(sensors, WheelOdometryConfig)
    if odometer is None:
        raise InputError("robot.sensors: expected one wheel-odometry for the estimator, found none")
    seer = _one(sensors, BeaconConfig)
    landmarks = landmarks_of(mission, ground)
    streams = RandomStreams(mission.run.seed)
    oracles = frozenset(mission.run.oracles)
    log = landmark_log(truth, odometer, seer, landmarks, streams)
    if "sensors" in oracles:
        log = _silent_log(truth, odometer, seer, landmarks, log.variances)
    initial = _initial(mission, truth[0], streams)
    if oracles & {"initial", "estimator"}:
        x, y, theta = truth[0].tolist()
        initial = exactly(Pose2(x, y, wrap_to_pi(theta)))
    estimator = build_component(ESTIMATORS, choice, "estimator")
    if "estimator" in oracles:
        found = true_estimate(truth, log)
    else:
        found = estimator.estimate(initial, log, landmarks, None if seer is None else seer[1])
    return Estimation(log, landmarks, initial, found)


def _silent_log(
    truth: FloatArray,
    odometer: tuple[str, WheelOdometryConfig],
    seer: tuple[str, BeaconConfig] | None,
    landmarks: Landmarks,
    expected: FloatArray,
) -> LandmarkLog:
    """What faultless sensors would log, with the (T, 2) variances that the data sheet expects."""
    exact = None if seer is None else (seer[0], ideal(seer[1]))
    # Nothing of the draws is left where all variances are zero.
    log = landmark_log(truth, (odometer[0], ideal(odometer[1])), exact, landmarks, RandomStreams(0))
    return replace(log, variances=expected)


def landmarks_of(mission: TerrainMission, ground: Ground) -> Landmarks:
    """The mission's table of landmarks, else those of the ground, else none."""
    table = mission.world.landmarks
    if isinstance(table, str):
        return read_landmark_table(Path(table))
    if table is not None:
        ids = np.array([entry.id for entry in table], dtype=np.int64)
        return Landmarks(ids, np.array([(entry.x_m, entry.y_m) for entry in table]).reshape(-1, 2))
    return NO_LANDMARKS if ground.landmarks is None else ground.landmarks


def seen_per_step(log: LandmarkLog) -> IntArray:
    """(T,) sightings of each step."""
    return np.diff(log.first)


def _sensors(mission: TerrainMission) -> dict[str, SensorConfig]:
    sensors: dict[str, SensorConfig] = {}
    for name, choice in mission.robot.sensors.items():
        config = SENSORS.configure(choice.name, choice.parameters, f"robot.sensors.{name}")
        if not isinstance(config, WheelOdometryConfig | BeaconConfig):
            raise InputError(
                f"robot.sensors.{name}: a rover carries wheel-odometry and beacons, found {choice.name}"
            )
        sensors[name] = config
    return sensors


def _one(sensors: Mapping[str, SensorConfig], kind: type[S]) -> tuple[str, S] | None:
    found = [(name, config) for name, config in sensors.items() if isinstance(config, kind)]
    if len(found) > 1:
        raise InputError(
            f"robot.sensors: expected one {kind.__name__.removesuffix('Config')}, found {len(found)}"
        )
    return found[0] if found else None


def _initial(mission: TerrainMission, true_start: FloatArray, streams: RandomStreams) -> Belief:
    """The true start with an error drawn from the initial covariance."""
    initial = mission.stack.initial
    variances = np.array([initial.x_var_m2, initial.y_var_m2, initial.theta_var_rad2])
    x, y, theta = (true_start + np.sqrt(variances) * streams.stream("initial").standard_normal(3)).tolist()
    return Belief(Pose2(x, y, wrap_to_pi(theta)), np.diag(variances))
