"""What a learner observes: the last word of each of a robot's sensors, one array each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.core.misfit import told
from pilotage.core.types import STOP
from pilotage.experiments.build.build import build_source
from pilotage.experiments.build.robots import motion_of, sensors_of
from pilotage.face.stepping import Simulation
from pilotage.missions.mission import Mission
from pilotage.sensors.numbers import Numbers, SensorSetting, numbers_in
from pilotage.sensors.readings import Reading, Readings

Observation: TypeAlias = dict[str, NDArray[np.float32]]

PATIENCE_STEPS = 1000
"""So long a sensor that does not declare its numbers may be silent."""


def numbers_of_sensors(mission: Mission) -> dict[str, tuple[Numbers, ...]]:
    """The numbers that each sensor of a mission's first robot reads, by its name.

    What its config declares, else what its first reading holds; a sensor that tells no numbers is left out.

    Raises
    ------
    InputError
        Where one that declares none is silent.
    """
    robot = mission.members[0]
    landmarks = build_source(mission).chart.landmarks.ids
    setting = SensorSetting(motion_of(robot, "robot"), mission.run.dt_s, landmarks)
    declared = {
        name: _declared(sensor.as_numbers(setting), name)
        for name, sensor in sensors_of(robot, "robot").items()
    }
    undeclared = {name for name, numbers in declared.items() if numbers is None}
    firsts = _first_readings(mission, undeclared)
    found = {
        name: numbers_in(firsts[name]) if numbers is None else numbers for name, numbers in declared.items()
    }
    return {name: numbers for name, numbers in found.items() if sum(one.size for one in numbers)}


def _declared(numbers: object, sensor: str) -> tuple[Numbers, ...] | None:
    """What a sensor's config says of its numbers; one from outside may say anything."""
    if numbers is None:
        return None
    if not isinstance(numbers, tuple | list) or not all(isinstance(one, Numbers) for one in numbers):
        raise InputError(
            f"gymnasium: robot.sensors.{sensor}: as_numbers: expected a tuple of Numbers, or None, "
            f"found {told(numbers)}"
        )
    return tuple(numbers)


def _first_readings(mission: Mission, sensors: set[str]) -> dict[str, Reading]:
    """The first word of each of these sensors, of a robot at rest."""
    firsts: dict[str, Reading] = {}
    if not sensors:
        return firsts
    sim = Simulation(mission)
    readings = sim.reset()
    for _ in range(PATIENCE_STEPS):
        for name in sensors - set(firsts):
            if name in readings.by_sensor:
                firsts[name] = readings.by_sensor[name]
        if len(firsts) == len(sensors):
            return firsts
        readings = sim.step(STOP)
    silent = min(sensors - set(firsts))
    raise InputError(
        f"gymnasium: robot.sensors.{silent}: expected a reading within {sim.t_s:g} s, by which its numbers "
        "are known, found none; give its config a method as_numbers"
    )


class LastWords:
    """The last reading of every sensor as arrays within bounds.

    Parameters
    ----------
    numbers
        By the sensors' names.
    """

    def __init__(self, numbers: Mapping[str, tuple[Numbers, ...]]) -> None:
        self._numbers = numbers
        self.spaces = {name: _box(columns) for name, columns in numbers.items()}
        self._rest = {
            name: _flat([np.full(one.size, one.rest) for one in columns]) for name, columns in numbers.items()
        }
        self._seen: Observation = {}

    def forget(self) -> None:
        """Nothing has spoken yet."""
        self._seen = dict(self._rest)

    def hear(self, readings: Readings) -> Observation:
        """What the sensors said last, after these readings too."""
        for name, reading in readings.by_sensor.items():
            if name in self._numbers:
                values = [self._padded(name, one, reading) for one in self._numbers[name]]
                self.see(name, np.concatenate(values))
        return {name: values.copy() for name, values in self._seen.items()}

    def see(self, name: str, values: Any) -> None:
        """Take numbers within their bounds."""
        box = self.spaces[name]
        self._seen[name] = np.clip(np.asarray(values, dtype=np.float32), box.low, box.high)

    def _padded(self, name: str, one: Numbers, reading: object) -> NDArray[np.float64]:
        values = one.read(reading)
        if len(values) > one.size:
            raise InputError(
                f"gymnasium: robot.sensors.{name}: expected {one.size} numbers of {one.name} at most, "
                f"found {len(values)}; give its config a method as_numbers with the greatest size"
            )
        return np.pad(values, (0, one.size - len(values)), constant_values=one.rest)


def _box(columns: tuple[Numbers, ...]) -> spaces.Box[Any]:
    low, high = (_flat([np.full(one.size, getattr(one, end)) for one in columns]) for end in ("low", "high"))
    return spaces.Box(low, high, dtype=np.float32)


def _flat(parts: list[NDArray[np.float64]]) -> NDArray[np.float32]:
    return np.concatenate(parts).astype(np.float32)
