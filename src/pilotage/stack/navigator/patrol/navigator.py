"""The patrol navigator's plug: localize, listen, step the state that the robot is in, talk."""

from __future__ import annotations

import math

from pilotage.core.errors import InputError
from pilotage.core.types import STOP, Twist
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import Readings
from pilotage.stack.control.brakes import Brakes
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.interface import NAVIGATORS, Belief, BeliefStatus, StackStatus
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.localization.localizer import Abilities
from pilotage.stack.navigator.navigator import Parts, check_finds_place, localizer_of
from pilotage.stack.navigator.patrol.config import PatrolNavigatorConfig
from pilotage.stack.navigator.patrol.context import Context
from pilotage.stack.navigator.patrol.paths import roadmap_for
from pilotage.stack.navigator.patrol.precedence import Leading, precedence
from pilotage.stack.navigator.patrol.senses import stop_m
from pilotage.stack.navigator.patrol.states import transitions
from pilotage.stack.navigator.patrol.states.charging import Charging
from pilotage.stack.navigator.patrol.states.driving import Waiting
from pilotage.stack.navigator.patrol.states.lost import Lost
from pilotage.stack.navigator.patrol.states.state import State
from pilotage.stack.navigator.wandering import Wandering

COLUMNS = {
    "mode": "1",
    "hop": "1",
    "target": "1",
    "time_to_go_s": "s",
    "blocked": "1",
    "strangers": "1",
    "alarm_t_s": "s",
    "alarm_x_m": "m",
    "alarm_y_m": "m",
}


@NAVIGATORS.add("patrol", PatrolNavigatorConfig)
class PatrolNavigator:
    """Drives from vertex to vertex of a patrol graph as its strategy says, among team mates and strangers.

    The time to go to every vertex is worked out once (an eikonal equation over the map) and followed by a
    dynamic window (Fox et al. 1997, Brock and Khatib 1999), to the right of the middle where there is room
    for two. What is on no map and near is gone around on the same field, worked out anew in a small window.
    Every command can be braked in the robot's own half of the distance to what may move (buffered Voronoi
    cells, Zhou et al. 2017): laser alone, whether anybody talks or not. Who does not get on gives way, with
    a radio the one with the larger number first. One whose battery runs low goes to its station and charges.
    Who is lost, or where no path begins, wanders.

    A robot of any shape is driven as the disc around it, and has to turn on the spot. Fails where the scanner
    does not see all round.
    """

    def __init__(
        self,
        config: PatrolNavigatorConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: TaskKnowledge,
        parts: Parts,
        journal: Journal,
    ) -> None:
        if parts.patrol is None:
            raise InputError("navigator 'patrol': expected task 'patrol', found another")
        if robot.motion.least_turning_radius_m > 0.0:
            raise InputError(
                "navigator 'patrol': expected a robot that turns on the spot, found a turning radius of "
                f"{robot.motion.least_turning_radius_m:.2f} m; take robot.motion.name: differential-drive"
            )
        self._localizer = localizer_of(parts, "patrol")
        able = Abilities.of(self._localizer)
        places_m, visit_m = parts.patrol.graph.vertices_xy_m, parts.patrol.visit_m
        check_finds_place(self._localizer, task.initial, places_m, visit_m, "patrol", "place to visit")
        if len(parts.patrol.starts) > 1:
            _check_beams(config, robot, min(parts.patrol.radii_m))
        self._tell_mates = able.tell_mates
        self._telemetry = journal.channel(COLUMNS, first=True)
        journal.counts |= {"gave_way": 0, "alarms": 0}
        if parts.patrol.supply is not None:
            journal.counts["charges"] = 0
        self._context = Context(config, robot, chart, parts.patrol, task.initial.pose, journal)
        self._last_word, self._has_corners = LastWord(robot), not robot.footprint.is_disc
        self._wandering = Wandering(config.wander, robot, self._localizer, self._last_word)
        self._state: State | None = None

    roadmap = staticmethod(roadmap_for)
    """Its paths, for those who plan for it."""

    @property
    def belief(self) -> Belief:
        """The localizer's belief."""
        return self._localizer.belief

    @property
    def status(self) -> tuple[StackStatus, str]:
        """A patrol has no end of its own; whether it waits because its strategy says so, or charges."""
        if isinstance(self._state, Charging):
            return StackStatus.RUNNING, "charges"
        return StackStatus.RUNNING, "waits" if isinstance(self._state, Waiting) else ""

    def step(self, readings: Readings) -> Twist:
        """One control step."""
        context = self._context
        self._tell_mates(context.mates_by_their_words(readings.t_s))
        belief = self._localizer.step(readings)
        lost = belief.status is BeliefStatus.LOST
        context.sense(readings, belief, lost=lost)
        state, astray = self._state, lost or context.is_off_roadmap()
        if astray or self._has_corners:
            self._last_word.take_in(readings)  # else each of its commands leaves it room to stop anyway
        if astray and not isinstance(state, Lost):
            what = "does not know where it is" if lost else "finds no path from where it is"
            context.say("lost", f"the robot {what}: wandering until it does")
            context.memory.update(context.t_s, on_duty=False)
            state = Lost(context, self._wandering)
        elif not astray and isinstance(state, Lost):
            context.say("found", "the robot knows where it is and goes on")
            context.memory.update(context.t_s, on_duty=not context.homeward)
            context.came_from = context.roadmap.nearest(belief.pose.x_m, belief.pose.y_m)
            state = None
        self._state, command = (
            transitions.resume(context)
            if state is None
            else precedence(context, state).step(readings, transitions)
        )
        if not isinstance(self._state, Leading):
            context.clearing = None  # also where it lost its way meanwhile: nobody makes room for it any more
        context.talk(lost=lost)
        self._telemetry.tell(
            context.mode,
            context.hop,
            context.target,
            context.motion.to_go_s,
            context.motion.blocked,
            len(context.strange),
            *context.alarm,
        )
        command = command if not self._has_corners or self._corners_allow(command) else STOP
        context.sent(command)
        return command

    def _corners_allow(self, command: Twist) -> bool:
        """Whether no corner swings into anybody: who comes on is soon inside the disc that it drives as."""
        swings = command.v_m_s == 0.0 and command.w_rad_s != 0.0
        return not (swings and self._context.motion.is_met) and self._last_word.allows(command)


def _check_beams(config: PatrolNavigatorConfig, robot: RobotKnowledge, mate_m: float) -> None:
    """Refuse a laser that may show a mate of a radius by one beam alone, which may be dust, where both still
    can stop."""
    name, lidar = robot.one_sensor(LidarConfig, "navigator 'patrol'")
    speed_m_s, period_s = robot.motion.top_speed_m_s, max(1.0 / lidar.rate_hz, robot.dt_s)
    stops_m = stop_m(speed_m_s, Brakes(robot).sure_m_s2, period_s)
    half_rad = math.asin(mate_m / (robot.radius_m + mate_m + 2.0 * stops_m + config.gap_m))
    if lidar.beam_step_rad > half_rad:
        least = math.ceil(lidar.beams * lidar.beam_step_rad / half_rad)
        raise InputError(
            f"robot.sensors.{name}.beams: expected {least} or more, two of which meet a team mate while both "
            f"can stop from {speed_m_s:g} m/s, found {lidar.beams}"
        )
