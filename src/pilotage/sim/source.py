"""The simulator: one or many robots in one world; commands in, what their sensors said out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pilotage.core.errors import InputError
from pilotage.core.random import RandomStreams
from pilotage.core.types import Command, FloatArray, IntArray, Pose2
from pilotage.kernels.bodies import drive
from pilotage.models.footprint import Footprint
from pilotage.models.motion.motion import MotionConfig
from pilotage.sensors.readings import Reading, Readings
from pilotage.sensors.sensor import SensorConfig
from pilotage.sim.bodies.body import APART_M, Body
from pilotage.sim.bodies.motion import SIMULATED_MOTIONS
from pilotage.sim.contacts import what_is_touched
from pilotage.sim.faults.fault import Faults
from pilotage.sim.people.crowd import Crowd
from pilotage.sim.people.people import People
from pilotage.sim.sensing.radio import SimulatedRadio
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier, ReadTogether, SimulatedSensor
from pilotage.sim.worlds.traffic import NO_RADII, Traffic
from pilotage.sim.worlds.world import World

MOST_SAMPLES = 100_000
"""Of a sensor in one step."""


@dataclass(frozen=True, slots=True)
class RobotSpec:
    """One robot: what it is, what it carries, where it begins, and the streams that its noise comes from.

    Sensors are named as in the mission; the name keys the noise stream, so switching one sensor off leaves
    what the others draw unchanged. Faults stand between them and who reads them.
    """

    name: str
    footprint: Footprint
    motion: MotionConfig
    sensors: Mapping[str, SensorConfig]
    start: Pose2
    streams: RandomStreams
    faults: Faults | None = None


class Simulator:
    """Steps robots through a world and reads their sensors at their own rates.

    People move first, then the robots one after the other, each against the others where they are then.

    Parameters
    ----------
    people, people_names
        Plans of the people besides the robots, and what those of each plan are called.

    Attributes
    ----------
    crowd
        The people; None where there are none.
    radios
        The robots' radios by their number.

    Raises
    ------
    InputError
        Where two robots begin inside each other, or the world cannot serve a sensor.
    """

    def __init__(
        self,
        world: World,
        robots: Sequence[RobotSpec],
        dt_s: float,
        people: Sequence[People] = (),
        people_names: Sequence[str] = (),
    ) -> None:
        self._dt_s, self._steps = dt_s, 0
        shapes = [robot.footprint for robot in robots]
        states = np.zeros((len(robots), drive.STATE_SIZE))
        self.crowd = Crowd(people, shapes, states, dt_s, people_names) if people else None
        self._crowded = len(robots) > 1 or self.crowd is not None
        self._traffic = Traffic.none()
        if self._crowded:
            self._traffic = Traffic(shapes, NO_RADII if self.crowd is None else self.crowd.radius_m)
        self.world = world.with_traffic(self._traffic)
        nobody = np.array([[0, 0, -1]], dtype=np.int64)
        own = self._traffic.own if self._crowded else nobody
        self.bodies: tuple[Body, ...] = tuple(
            _body(robot, self.world, dt_s, states, row, own, len(robots) > 1)
            for row, robot in enumerate(robots)
        )
        for body in self.bodies:
            # Once more, now that everybody is in place.
            body.carry_to(body.pose)
        self._check_apart()
        if self.crowd is not None:
            self.crowd.walk_to(0.0, self._traffic)
            self.crowd.arrive(self._traffic)
        self._counted = [0] * len(robots)
        self._meeting = (
            states,
            np.concatenate([*(shape.points_m for shape in shapes), np.zeros((0, 2))]),
            np.cumsum([0, *(len(shape.points_m) for shape in shapes)]),
            np.array([shape.radius_m for shape in shapes]),
            self._traffic.others,
            own,
            self._traffic.first_person,
        )
        several = len(robots) > 1
        seats = [
            _Seat(row, name, sensor, every)
            for row, (robot, body) in enumerate(zip(robots, self.bodies, strict=True))
            for name, sensor, every in _sensors(robot, body, self.world, dt_s, several)
        ]
        self.radios = {seat.row: seat.sensor for seat in seats if isinstance(seat.sensor, SimulatedRadio)}
        for radio in self.radios.values():
            radio.connect(tuple(self.radios.values()))
        self._observe: list[Callable[[], None]] = [
            observe for seat in seats if (observe := getattr(seat.sensor, "observe", None)) is not None
        ]
        self._alone, self._together = _grouped(seats, robots)
        self._faults = [(row, robot.faults) for row, robot in enumerate(robots) if robot.faults is not None]

    @property
    def t_s(self) -> float:
        """Simulated time."""
        return self._steps * self._dt_s

    @property
    def is_over(self) -> bool:
        """Never: it goes on as long as it is asked to."""
        return False

    def step(self, commands: Sequence[Command]) -> list[Readings]:
        """Drive one time step and return what each robot's sensors say at its end."""
        self._steps += 1
        t_s = self._steps * self._dt_s
        bodies = self.bodies
        if self.crowd is not None:
            self.crowd.walk_to(t_s, self._traffic)
        for body, command in zip(bodies, commands, strict=True):
            body.step(command)
        if self._crowded:
            self._meet()
        for row, body in enumerate(bodies):
            if body.collisions != self._counted[row]:
                self._counted[row] = body.collisions
                body.touched = what_is_touched(body, bodies, self.crowd)
        for observe in self._observe:
            observe()
        said: list[dict[str, Reading]] = [{} for _ in bodies]
        for row, name, read, every in self._alone:
            if every == 1 or self._steps % every == 0:
                reading = read()
                if reading is not None:
                    said[row][name] = reading
        for group in self._together:
            if self._steps % group.every == 0:
                for (row, name), reading in zip(group.seats, group.read(), strict=True):
                    if reading is not None:
                        said[row][name] = reading
        for row, faults in self._faults:
            said[row] = faults.pass_on(t_s, said[row])
        return [Readings(t_s, by_sensor) for by_sensor in said]

    def transmit(self, row: int, contents: Sequence[object]) -> None:
        """Broadcast what a robot sends; one without a radio is not heard."""
        radio = self.radios.get(row)
        if radio is not None:
            for content in contents:
                radio.send(self.t_s, content)

    def _meet(self) -> None:
        """Who ran into whom."""
        bodies = self.bodies
        if self.crowd is not None:
            self.crowd.arrive(self._traffic)
        marked = drive.meet_others(*self._meeting)
        if self.crowd is not None:
            self.crowd.meet()
        if not marked or len(bodies) == 1:
            return
        hit = []
        for body in bodies:
            if body.state[drive.BLOCKER] > 0.0:
                other = min((one for one in bodies if one is not body), key=body.distance_to_m)
                # Else it was a person that stopped it.
                if body.distance_to_m(other) < APART_M + body.motion.release_m:
                    hit.append(other)
        for body in bodies:
            body.run_into(body in hit)

    def _check_apart(self) -> None:
        for row, body in enumerate(self.bodies):
            for other in self.bodies[:row]:
                if body.distance_to_m(other) < 0.0:
                    raise InputError(
                        f"robots '{other.name}' and '{body.name}': expected starts apart, found them inside "
                        f"each other; move one"
                    )


@dataclass(frozen=True, slots=True)
class _Seat:
    """A sensor with its robot and rate."""

    row: int
    name: str
    sensor: SimulatedSensor | ReadTogether
    every: int


@dataclass(frozen=True, slots=True)
class _Group:
    """Sensors that are read at once."""

    seats: list[tuple[int, str]]
    read: Callable[[], Sequence[Reading | None]]
    every: int


def _place(robot: RobotSpec, several: bool) -> str:
    """How a message names a robot of the mission."""
    return f"robots.{robot.name}" if several else "robot"


def _body(
    robot: RobotSpec, world: World, dt_s: float, table: FloatArray, row: int, owns: IntArray, several: bool
) -> Body:
    """The robot's body with the motion that its data sheet asks for."""
    place = _place(robot, several)
    where = f"{place}.motion"
    samples = max(
        (
            _samples(config, dt_s, f"{place}.sensors.{name}")
            for name, config in robot.sensors.items()
            if getattr(SIMULATED_SENSORS.of(config, f"{place}.sensors.{name}"), "sampled", False)
        ),
        default=1,
    )
    motion = SIMULATED_MOTIONS.of(robot.motion, where)(robot.motion, dt_s, samples, robot.streams, where)
    delay = _delay_steps(robot.motion, dt_s, where)
    return Body(robot.name, robot.footprint, motion, robot.start, world, dt_s, table, row, owns, delay)


def _delay_steps(motion: MotionConfig, dt_s: float, where: str) -> int:
    """How many steps late commands act."""
    steps = motion.delay_s / dt_s
    if abs(steps - round(steps)) > 1e-6:
        raise InputError(
            f"{where}.delay_s: expected a multiple of run.dt_s ({dt_s:g} s), found {motion.delay_s:g}"
        )
    return round(steps)


def _samples(config: SensorConfig, dt_s: float, where: str) -> int:
    """How many samples a sampled sensor takes in a step; 1 where it is read every few steps."""
    samples = config.rate_hz * dt_s
    if samples < 1.0 - 1e-6:
        return 1
    if samples > MOST_SAMPLES:
        raise InputError(
            f"{where}.rate_hz: expected at most {MOST_SAMPLES / dt_s:g} Hz, {MOST_SAMPLES} samples in a step "
            f"(run.dt_s = {dt_s:g} s), found {config.rate_hz:g}"
        )
    whole = round(samples)
    if abs(samples - whole) > 1e-6 * samples:
        raise InputError(
            f"{where}.rate_hz: expected a multiple of {1.0 / dt_s:g} Hz "
            f"(run.dt_s = {dt_s:g} s), found {config.rate_hz:g}"
        )
    return whole


def _sensors(
    robot: RobotSpec, body: Body, world: World, dt_s: float, several: bool
) -> list[tuple[str, SimulatedSensor | ReadTogether, int]]:
    """The robot's sensors by name, and every how many steps each is read."""
    out = []
    for name, config in robot.sensors.items():
        where = f"{_place(robot, several)}.sensors.{name}"
        kind = SIMULATED_SENSORS.of(config, where)
        often = getattr(kind, "sampled", False) and config.rate_hz * dt_s > 1.0 - 1e-6
        every = 1 if often else config.every_steps(dt_s, where)
        carrier = Carrier(world, body, where, dt_s, every)
        out.append((name, kind(config, carrier, robot.streams.stream(f"sensor/{name}")), every))
    return out


def _grouped(
    seats: list[_Seat], robots: Sequence[RobotSpec]
) -> tuple[list[tuple[int, str, Callable[[], Reading | None], int]], list[_Group]]:
    """Sensors that are read one by one, and those that are read together."""
    alone: list[tuple[int, str, Callable[[], Reading | None], int]] = []
    alike: dict[tuple[Any, object, int], list[_Seat]] = {}
    for seat in seats:
        sensor: Any = seat.sensor
        kind = type(sensor)
        if hasattr(kind, "together"):
            key = kind.alike(robots[seat.row].sensors[seat.name])
            alike.setdefault((kind, key, seat.every), []).append(seat)
        else:
            alone.append((seat.row, seat.name, sensor.read, seat.every))
    groups = [
        _Group(
            [(seat.row, seat.name) for seat in found],
            kind.together([seat.sensor for seat in found]),
            every,
        )
        for (kind, _, every), found in alike.items()
    ]
    return alone, groups
