"""What becomes of a mission's robots: carried elsewhere, stopped, silenced, run out of battery."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pilotage.core.angles import wrap_to_pi
from pilotage.core.types import Event, Pose2
from pilotage.missions.mission import Mission
from pilotage.missions.places import Kidnap, Point
from pilotage.missions.team import BatteryConfig, Failure
from pilotage.sim.bodies.body import Body
from pilotage.sim.source import Simulator

REACH_M = 1.0
"""A station charges whose middle is this near."""
ROOM_M = 1.0
"""Nobody is put down nearer to others: who comes along must be able to stop."""


@dataclass(slots=True)
class _Charge:
    body: Body
    station: Point
    full_at_m: float = 0.0
    """What it had driven when it was full."""
    before_m: float = 0.0
    stood_s: float = 0.0
    empty: bool = False


class Batteries:
    """Batteries that driving empties; standing at the own station for the time to charge fills one.

    Turning on the spot is free: the range is a length of path. A charge that is broken off is lost.
    """

    def __init__(self, mission: Mission, source: Simulator) -> None:
        self._config: BatteryConfig | None = mission.team.battery
        self._dt_s = mission.run.dt_s
        stations = [mission.station_of(index) for index in range(len(mission.members))]
        self._charges = [
            _Charge(body, station)
            for body, station in zip(source.bodies, stations, strict=True)
            if station is not None
        ]

    def run_out(self) -> list[int]:
        """After every step: the numbers of robots whose batteries became empty in it."""
        config, now = self._config, []
        if config is None:
            return []
        for index, charge in enumerate(self._charges):
            driven_m = charge.body.driven_m
            pose, (x, y) = charge.body.pose, charge.station
            stands = driven_m == charge.before_m
            there = math.hypot(pose.x_m - x, pose.y_m - y) <= REACH_M
            charge.stood_s = charge.stood_s + self._dt_s if stands and there and not charge.empty else 0.0
            charge.before_m = driven_m
            if charge.stood_s >= config.charge_s:
                charge.full_at_m = driven_m
            if not charge.empty and driven_m - charge.full_at_m >= config.range_m:
                charge.empty = True
                now.append(index)
        return now


class Disturbances:
    """Carries out kidnaps and failures when they are due; an empty battery is a failure for good."""

    def __init__(self, mission: Mission, source: Simulator) -> None:
        self._source = source
        self._names = [robot.name for robot in mission.members]
        self._kidnaps = sorted(mission.world.kidnaps, key=lambda kidnap: kidnap.at_s)
        failures = mission.team.failures
        # Repairs come before what fails at the same time, and after their own failure, however short it was.
        self._changes = sorted(
            [(failure.at_s, 1, failure) for failure in failures]
            + [
                (max(failure.at_s + failure.for_s, math.nextafter(failure.at_s, math.inf)), 0, failure)
                for failure in failures
                if failure.for_s is not None
            ],
            key=lambda change: change[:2],
        )
        self._batteries = Batteries(mission, source)
        self._wrong: dict[str, list[int]] = {"stop": [], "radio": []}

    def due(self) -> list[Event]:
        """Carry out what is due now."""
        events = []
        now_s = self._source.t_s
        for kidnap in [kidnap for kidnap in self._kidnaps if now_s >= kidnap.at_s]:
            if self._has_room(kidnap):
                self._kidnaps.remove(kidnap)
                events.append(self._carry(kidnap))
        while self._changes and now_s >= self._changes[0][0]:
            _, broken, failure = self._changes.pop(0)
            events.append(self._change(failure, broken=bool(broken)))
        for robot in self._batteries.run_out():
            self._change(Failure(robot=robot, at_s=now_s), broken=True)
            text = f"{self._names[robot]}: its battery is empty, it stands and says nothing"
            events.append(Event(now_s, "failure", text))
        return events

    def _has_room(self, kidnap: Kidnap) -> bool:
        """Whether it may be put down there: not onto somebody nor right before one, but a little later."""
        return self._source.bodies[kidnap.robot].apart_at_m(_place(kidnap)) > ROOM_M

    def _carry(self, kidnap: Kidnap) -> Event:
        """Carry a robot elsewhere; nobody tells it."""
        to = _place(kidnap)
        self._source.bodies[kidnap.robot].carry_to(to)
        who = f"{self._names[kidnap.robot]}: " if len(self._names) > 1 else ""
        text = f"{who}the robot is carried to ({to.x_m:.2f}, {to.y_m:.2f}) and not told"
        return Event(self._source.t_s, "kidnap", text)

    def _change(self, failure: Failure, *, broken: bool) -> Event:
        """A failure begins or is over; several of one kind may overlap."""
        wrong, robot = self._wrong[failure.kind], failure.robot
        if broken:
            wrong.append(robot)
        else:
            wrong.remove(robot)
        self._source.bodies[robot].stopped = robot in self._wrong["stop"]
        radio = self._source.radios.get(robot)
        if radio is not None:
            radio.works = not (robot in self._wrong["stop"] or robot in self._wrong["radio"])
        what = {"stop": "stops and says nothing", "radio": "has no radio"}[failure.kind]
        text = f"{self._names[robot]}: {what}" if broken else f"{self._names[robot]}: is mended"
        return Event(self._source.t_s, "failure" if broken else "repair", text)


def _place(kidnap: Kidnap) -> Pose2:
    """Where to."""
    assert kidnap.to is not None, "settled by the build"
    return Pose2(kidnap.to.x_m, kidnap.to.y_m, wrap_to_pi(kidnap.to.theta_rad))
