"""One simulated robot on a sheet: wheel speeds in, what its sensors said out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TypeVar

import numpy as np

from pilotage.core.angles import wrap_to_pi
from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import FloatArray, Pose2, WheelSpeeds
from pilotage.kernels.bodies import wheel_drive
from pilotage.kernels.geometry import boxes
from pilotage.missions.sheet import DriveErrorsConfig, SheetBodyConfig, WheelDriveConfig
from pilotage.sensors.gyroscope import GyroscopeConfig
from pilotage.sensors.readings import EncoderCounts, GyroscopeRates, Reading, Readings
from pilotage.sensors.sensor import SensorConfig
from pilotage.sensors.wheel_encoders import WheelEncodersConfig
from pilotage.sim.sheet_sensing import SHEET_SENSORS
from pilotage.sim.sheet_world import SheetWorld, true_drive

S = TypeVar("S", bound=SensorConfig)

BLOCK = 2048


class SheetSimulator:
    """Steps the drive in samples of the encoders and reads the other sensors at their own rates.

    Each sensor, the drive's errors and its slip have a noise stream of their own.

    Raises
    ------
    InputError
        Where the robot has no encoders, or encoders and gyroscope are not sampled alike.
    """

    def __init__(
        self,
        world: SheetWorld,
        body: SheetBodyConfig,
        motion: WheelDriveConfig,
        errors: DriveErrorsConfig,
        sensors: Mapping[str, SensorConfig],
        start: Pose2,
        dt_s: float,
        streams: RandomStreams,
    ) -> None:
        self.world = world
        self._radius = body.radius_m
        self._most = motion.max_wheel_speed_rad_s
        self._dt_s = dt_s
        self._steps = 0
        self._state = np.zeros(wheel_drive.STATE_SIZE)
        self._state[: wheel_drive.THETA + 1] = start.x_m, start.y_m, start.theta_rad
        self._drive = true_drive(motion, errors, streams.stream("drive"))
        self._encoders, encoders = _only(sensors, WheelEncodersConfig)
        self._counts_per_turn = encoders.counts_per_turn
        self._samples = _samples(encoders.rate_hz, dt_s, self._encoders)
        self._counted = np.zeros(2, dtype=np.int64)
        self._slip_rng = streams.stream("slip")
        self._slip = np.zeros((0, self._samples, 2))
        self._rates = np.zeros(self._samples)
        self._gyro = None
        if any(isinstance(config, GyroscopeConfig) for config in sensors.values()):
            name, gyro = _only(sensors, GyroscopeConfig)
            if gyro.rate_hz != encoders.rate_hz:
                raise InputError(
                    f"robot.sensors.{name}.rate_hz: expected the encoders' {encoders.rate_hz:g} Hz, "
                    f"found {gyro.rate_hz:g}"
                )
            self._gyro = name
            self._gyroscope = _Gyroscope(gyro, self._samples, streams.stream(f"sensor/{name}"))
        self._slow = [
            (
                name,
                SHEET_SENSORS[type(config)](config, world, streams.stream(f"sensor/{name}")),
                config.every_steps(dt_s, name),
            )
            for name, config in sensors.items()
            if type(config) in SHEET_SENSORS
        ]
        for name, config in sensors.items():
            if (
                not isinstance(config, WheelEncodersConfig | GyroscopeConfig)
                and type(config) not in SHEET_SENSORS
            ):
                raise InputError(f"robot.sensors.{name}: a robot on a sheet cannot carry this sensor")

    @property
    def truth(self) -> Pose2:
        """The true pose."""
        x, y, theta = self._state[:3]
        return Pose2(float(x), float(y), wrap_to_pi(float(theta)))

    @property
    def t_s(self) -> float:
        """Simulated time."""
        return self._steps * self._dt_s

    @property
    def way_m(self) -> float:
        """Way of the centre so far."""
        return float(self._state[wheel_drive.WAY])

    @property
    def contacts(self) -> int:
        """How often the body ran into a box."""
        return int(self._state[wheel_drive.CONTACTS])

    @property
    def touching(self) -> bool:
        """Whether a box holds it now."""
        return bool(self._state[wheel_drive.TOUCHING] > 0.0)

    @property
    def clearance_m(self) -> float:
        """Distance from the body's edge to the nearest box."""
        return (
            float(boxes.distance_to_boxes(self._state[0], self._state[1], self.world.boxes_m)) - self._radius
        )

    @property
    def on_sheet(self) -> bool:
        """Whether the centre is on the sheet."""
        return self.world.holds(float(self._state[0]), float(self._state[1]))

    def step(self, command: WheelSpeeds) -> Readings:
        """Drive one control period and return what the sensors say at its end."""
        at = self._steps % BLOCK
        if at == 0:
            self._slip = self._slip_rng.standard_normal((BLOCK, self._samples, 2))
        wheel_drive.drive(
            self._state,
            min(max(command.left_rad_s, -self._most), self._most),
            min(max(command.right_rad_s, -self._most), self._most),
            self._drive,
            self._dt_s / self._samples,
            self._slip[at],
            self.world.boxes_m,
            self._radius,
            self._rates,
        )
        self._steps += 1
        by_sensor: dict[str, Reading] = {self._encoders: self._read_encoders()}
        if self._gyro is not None:
            by_sensor[self._gyro] = self._gyroscope.read(self._rates, self._dt_s)
        pose: Pose2 | None = None
        for name, sensor, every in self._slow:
            if self._steps % every == 0:
                pose = self.truth if pose is None else pose
                by_sensor[name] = sensor.read(pose)
        return Readings(self._steps * self._dt_s, by_sensor)

    def _read_encoders(self) -> EncoderCounts:
        """Whole counts of this step, spread over its samples as evenly as whole counts go."""
        counts = wheel_drive.read_counts(
            self._state[wheel_drive.TURNED_LEFT],
            self._state[wheel_drive.TURNED_RIGHT],
            self._counted,
            self._counts_per_turn,
            self._samples,
        )
        return EncoderCounts(counts[0], counts[1])


class _Gyroscope:
    """Adds bias, drift, scale error and noise to true rates."""

    def __init__(self, config: GyroscopeConfig, samples: int, rng: np.random.Generator) -> None:
        signs = rng.choice([-1.0, 1.0], 2)
        self._bias = signs[0] * config.bias_rad_s
        self._scale = 1.0 + signs[1] * config.scale_error
        self._walk, self._std = config.bias_walk_rad_s_sqrt_s, config.rate_std_rad_s
        self._rng = rng
        self._samples = samples
        self._at = BLOCK
        self._noise = np.zeros((0, samples))
        self._steps = np.zeros(0)

    def read(self, rates: FloatArray, dt_s: float) -> GyroscopeRates:
        if self._at == BLOCK:
            self._noise = self._std * self._rng.standard_normal((BLOCK, self._samples))
            self._steps = self._walk * math.sqrt(dt_s) * self._rng.standard_normal(BLOCK)
            self._at = 0
        self._bias += float(self._steps[self._at])
        reading = self._scale * rates + self._bias + self._noise[self._at]
        self._at += 1
        return GyroscopeRates(reading)


def _samples(rate_hz: float, dt_s: float, name: str) -> int:
    samples = rate_hz * dt_s
    whole = round(samples)
    if whole < 1 or abs(samples - whole) > 1e-6 * samples:
        raise InputError(
            f"robot.sensors.{name}.rate_hz: expected a multiple of {1.0 / dt_s:g} Hz "
            f"(run.dt_s = {dt_s:g} s), found {rate_hz:g}"
        )
    return whole


def _only(sensors: Mapping[str, SensorConfig], kind: type[S]) -> tuple[str, S]:
    found = [(name, config) for name, config in sensors.items() if isinstance(config, kind)]
    if len(found) != 1:
        raise InputError(
            f"robot.sensors: expected one {kind.__name__.removesuffix('Config')}, found {len(found)}; "
            f"the robot has: {', '.join(sensors) or 'none'}"
        )
    return found[0]
