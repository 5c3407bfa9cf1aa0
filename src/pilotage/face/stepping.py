"""A mission's world stepped by hand: commands in, readings out, the truth to look at."""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

from pilotage.core import given
from pilotage.core.errors import InputError
from pilotage.core.types import STOP, Command, Pose2, Twist, WheelSpeeds
from pilotage.experiments.build.build import Source, build_source
from pilotage.experiments.disturbances import Disturbances
from pilotage.face.missions import MissionLike, as_mission
from pilotage.maps.world_map import WorldMap
from pilotage.missions.mission import Mission
from pilotage.sensors.readings import Readings


class Simulation:
    """The world and the robots of a mission, without what would run on them.

    The same mission, seed and commands give the same readings, bit for bit, and those that a run of the
    mission has. With ``robots`` in the mission commands, readings and poses are lists, one a robot.

    Attributes
    ----------
    mission
        As it was given.
    """

    def __init__(self, mission: Mission) -> None:
        self.mission = mission
        self._several = bool(mission.robots)
        self._source: Source | None = build_source(mission)
        self._begun = False
        self._disturbances: Disturbances | None = None

    def reset(self, seed: int | None = None) -> Readings:
        """Begin anew: robots at their starts, random streams at theirs; the readings after one step at rest.

        Parameters
        ----------
        seed
            Of this and later beginnings; None keeps the one that there is.
        """
        return self._one(self.reset_all(seed))

    def reset_all(self, seed: int | None = None) -> list[Readings]:
        """As ``reset``, with a list of one a robot, however many there are."""
        if seed is not None:
            self.mission = as_mission(self.mission, seed)
        if self._begun or seed is not None:
            self._source = None
        source = self._built()
        self._begun = True
        self._disturbances = Disturbances(source.mission, source.simulator)
        return self._advance([STOP] * len(source.simulator.bodies))

    @overload
    def step(self, command: Command) -> Readings: ...

    @overload
    def step(self, command: Sequence[Command]) -> list[Readings]: ...

    def step(self, command: Command | Sequence[Command]) -> Readings | list[Readings]:
        """Drive one time step and return what the sensors say at its end.

        Parameters
        ----------
        command
            A ``Twist``, or ``WheelSpeeds`` where the motion takes them; of several robots one each.

        Raises
        ------
        InputError
            Before ``reset``, or where a command is none.
        """
        if not self._begun:
            raise InputError("step: expected reset() before the first step, found none")
        return self._one(self._advance(self._commands(command)))

    @property
    def truth(self) -> Pose2:
        """The true pose (of several robots the list of theirs), which no robot knows."""
        poses = self.poses
        return poses if self._several else poses[0]  # type: ignore[return-value]

    @property
    def poses(self) -> list[Pose2]:
        """The true poses, one a robot."""
        return [body.pose for body in self._built().simulator.bodies]

    @property
    def collisions(self) -> list[int]:
        """How often each robot ran into something so far."""
        return [body.collisions for body in self._built().simulator.bodies]

    @property
    def clearances_m(self) -> list[float]:
        """How far each robot's outline is from the next solid thing, metres."""
        return [body.clearance_m for body in self._built().simulator.bodies]

    @property
    def names(self) -> list[str]:
        """The robots' names."""
        return [body.name for body in self._built().simulator.bodies]

    @property
    def drawn(self) -> Mission:
        """The mission with the places that its seed draws."""
        return self._built().mission

    @property
    def map(self) -> WorldMap:
        """The world's map as it was drawn; what stands there beside it is not on it."""
        return self._built().chart

    @property
    def t_s(self) -> float:
        """Simulated time."""
        return self._built().simulator.t_s

    def __repr__(self) -> str:
        return f"Simulation({self.mission.mission!r}, {len(self.names)} robots, t={self.t_s:g} s)"

    def _built(self) -> Source:
        if self._source is None:
            self._source = build_source(self.mission)
        return self._source

    def _advance(self, commands: Sequence[Command]) -> list[Readings]:
        simulator = self._built().simulator
        assert self._disturbances is not None, "a reset came first"
        self._disturbances.due()
        return simulator.step(commands)

    def _one(self, readings: list[Readings]) -> Readings:
        return readings if self._several else readings[0]  # type: ignore[return-value]

    def _commands(self, command: Command | Sequence[Command]) -> list[Command]:
        count = len(self._built().simulator.bodies)
        asked_of = [command] if isinstance(command, Twist | WheelSpeeds) else command
        if not isinstance(asked_of, list | tuple) or len(asked_of) != count:
            lists = isinstance(asked_of, list | tuple)
            what = f"a list of {len(asked_of)}" if lists else type(asked_of).__name__
            asked = "a Twist or WheelSpeeds" if count == 1 else f"a list of {count} commands, one a robot"
            raise InputError(f"step: expected {asked}, found {what}")
        for one in asked_of:
            if not isinstance(one, Twist | WheelSpeeds):
                raise InputError(f"step: expected Twist or WheelSpeeds, found {type(one).__name__}")
            values = (
                (one.v_m_s, one.w_rad_s, one.lateral_m_s)
                if isinstance(one, Twist)
                else (one.left_rad_s, one.right_rad_s)
            )
            for value in values:
                given.number(f"step: speed of {type(one).__name__}", value)
        return list(asked_of)


def make(mission: MissionLike, *, seed: int | None = None) -> Simulation:
    """Make a mission's world to be stepped by hand, without its stack.

    Parameters
    ----------
    mission
        What ``load`` gives, or what it takes.
    seed
        Replaces the mission's seed where given.

    Raises
    ------
    InputError
        Where the mission cannot be built.

    Examples
    --------
    >>> import pilotage as pl
    >>> sim = pl.make("museum-1", seed=7)
    >>> readings = sim.reset()
    >>> for _ in range(20):
    ...     readings = sim.step(pl.Twist(0.5, 0.1))
    >>> round(sim.t_s, 1), sorted(readings.by_sensor)[:2]
    (2.1, ['beacons', 'front'])
    >>> 1.5 < sim.truth.x_m < 2.5
    True
    """
    return Simulation(as_mission(mission, seed))
