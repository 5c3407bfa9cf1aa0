"""What all states of the patrol navigator share: its senses, its motion, and what is known of the patrol."""

from __future__ import annotations

import math

import numpy as np

from pilotage.core.types import FloatArray, Pose2, Twist
from pilotage.kernels.control import disc_returns
from pilotage.maps.world_map import WorldMap
from pilotage.sensors.readings import Readings
from pilotage.stack.interface import Belief
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.navigator.patrol.battery import DOCK_M, Battery
from pilotage.stack.navigator.patrol.config import Mode, PatrolNavigatorConfig
from pilotage.stack.navigator.patrol.headway import Headway
from pilotage.stack.navigator.patrol.passage import Pursuit
from pilotage.stack.navigator.patrol.paths import SURELY_RATIO, Paths
from pilotage.stack.navigator.patrol.senses import NO_DISCS, TOLD_M
from pilotage.stack.patrol.messages import PatrolKnowledge, PatrolMemory
from pilotage.stack.patrol.roadmap import Roadmap
from pilotage.stack.patrol.shut_paths import ShutPaths
from pilotage.stack.patrol.strategy import Attentive, following
from pilotage.stack.patrol.task import PatrolTask
from pilotage.stack.patrol.word import Claim, Clearing, TeamWord

SPEED_SHARE = 0.2
"""Weight of the newest edge in the speed made good."""


class Context(Paths):
    """What it senses, the parts that the states drive with, and what the record wants to know.

    Attributes
    ----------
    target
        The vertex that the strategy named; its charging station's number in the roadmap on its way there.
    claim
        Of the passage for one that it is in or about to enter.
    clearing
        What it tells others to do while it goes first.
    pursuit, headway
        Of the one ahead in the passage; its own towards its hop.
    battery
        What it reckons of its own; None where it never has to charge.
    """

    def __init__(
        self,
        config: PatrolNavigatorConfig,
        robot: RobotKnowledge,
        chart: WorldMap,
        task: PatrolTask,
        start: Pose2,
        journal: Journal,
    ) -> None:
        super().__init__(config, robot, chart, task, start, journal)
        speed = self.speed_m_s
        self.claim: Claim | None = None
        self.clearing: Clearing | None = None
        self._has_news, self.pursuit, self.headway = False, Pursuit(), Headway()
        self._said_lost, self.knows_place = False, True
        self.battery: Battery | None = None
        if task.supply is not None:
            station = len(task.graph) + task.robot
            self.battery = Battery(task.supply, self.roadmap, station, speed)
        self.rng = robot.streams.stream("patrol")
        self.target = self.came_from
        self.memory = PatrolMemory(len(task.graph), task.robot, len(task.starts), self.came_from, speed)
        self._then = -1
        self._left_s, self._kept_out_s = 0.0, math.inf
        self.mode, self._has_heard = Mode.DRIVE, False
        self._attentive = task.strategy if isinstance(task.strategy, Attentive) else None
        self._next_word_s = float(self.rng.uniform(0.0, config.message_period_s))

    def sense(self, readings: Readings, belief: Belief, *, lost: bool) -> None:
        """Take in one step's readings."""
        driven_m = self.take_in(readings, belief, lost=lost)
        self.knows_place = not lost
        if self.battery is not None:
            self.battery.spend(driven_m)
        if self.fresh:
            self.motion.watch(lost=lost)
            if not lost:
                self.look_who_shuts_paths()

    def _others_are_shut(self, shut: ShutPaths) -> None:
        self.memory.update(self.t_s, shut=shut)
        self.headway.restart(self.t_s)  # by what is left to go on other paths

    def _take(self, roadmap: Roadmap) -> None:
        super()._take(roadmap)
        if self.battery is not None:
            self.battery.roadmap = roadmap

    def hear(self, sent_s: float, word: TeamWord) -> None:
        """A mate said something: the patrol's news count too."""
        self.memory.receive(word.news)
        self._has_heard = True
        super().hear(sent_s, word)

    def talk(self, *, lost: bool) -> None:
        """Broadcast, where it is time to.

        Who does not know any more where it is says so at once: a mate that sees it elsewhere than it last
        said takes it for somebody else before its next word is due.
        """
        due, changed = self.t_s >= self._next_word_s, lost is not self._said_lost
        if not self.talks or not (due or self._has_news or changed):
            return
        self._has_news, self._said_lost = False, lost
        if due:
            self._next_word_s += self.config.message_period_s
        x, y = (math.nan, math.nan) if lost else (self.pose.x_m, self.pose.y_m)
        self.memory.update(self.t_s, words=self.task.strategy.words(self._knowledge()))
        news = self.memory.message(self.t_s)
        self.journal.outbox.append(
            TeamWord(
                x,
                y,
                self.motion.blocked,
                self.claim,
                self.clearing,
                news,
                self.radius_m,
                self._obstructions.told(),
                self.talk_habit,
                self.brakes.sure_m_s2,
            )
        )

    def _knowledge(self) -> PatrolKnowledge:
        return self.memory.knowledge(self.t_s, self.silences_log())

    def away_m(self, place: int) -> float:
        """Distance from a vertex or its station as the crow flies."""
        return self.roadmap.away_m(place, self.pose.x_m, self.pose.y_m)

    @property
    def homeward(self) -> bool:
        """Whether it is on its way to its station."""
        return self.battery is not None and self.battery.low

    def must_go_home(self) -> bool:
        """Whether it would not reach its station if it drove anywhere else."""
        return self.battery is not None and self.battery.is_short(self.pose)

    def arrived(self, *, blocked: bool) -> bool:
        """Whether it is near enough to where it drives to; what blocks a vertex may be there in its place."""
        if self.homeward:
            return self.away_m(self.hop) <= DOCK_M
        if blocked or self.motion.taken or self._is_at_end():
            return self.away_m(self.hop) <= SURELY_RATIO * self.task.visit_m
        return self.away_m(self.hop) <= self.motion.sure_m()

    def runs_low(self) -> bool:
        """Whether it has to go to its station from now on; tells the others that its share is theirs."""
        if self.battery is None or self.battery.low or not self.battery.check(self.pose):
            return False
        self.memory.update(self.t_s, on_duty=False)
        self.say("battery", f"{self.battery.left_m:.0f} m are left: goes to its charging station")
        return True

    def charged(self) -> None:
        """On duty again."""
        assert self.battery is not None, "who has none does not charge"
        self.battery.fill()
        self.journal.count("charges")
        self.say("charged", "the battery is full: goes on with the patrol")
        self.memory.update(self.t_s, on_duty=True)
        self.came_from, self._left_s = self.roadmap.nearest(self.pose.x_m, self.pose.y_m), self.t_s

    def visit(self, vertex: int) -> None:
        """It is there."""
        edge_m = float(self.task.graph.edges_m[self.came_from, vertex])
        took_s = self.t_s - self._left_s
        if vertex != self.came_from and math.isfinite(edge_m) and took_s > 0.0:
            old = self.memory.own.speed_m_s
            new = (1.0 - SPEED_SHARE) * old + SPEED_SHARE * min(edge_m / took_s, self.speed_m_s)
            self.memory.update(self.t_s, speed_m_s=new)
        self.came_from, self._left_s, self._kept_out_s = vertex, self.t_s, math.inf
        self.memory.visit(vertex, self.t_s)

    def is_kept_out_for_long(self) -> bool:
        """Whether it has stood before passages, now and then, for ``hold_s`` since it was at a place."""
        self._kept_out_s = min(self._kept_out_s, self.t_s)
        return self.t_s - self._kept_out_s > self.config.hold_s

    def leave_to_mates(self, *, for_long: bool) -> bool:
        """Go on as if it had been where it is kept out of, if a mate stands there or has been there since.

        Or where nothing leads there past somebody who stands and says nothing.
        Who hears nobody takes it that who keeps it out ``for_long`` goes there.
        """
        if self.homeward:
            return False
        if self.roadmap.is_cut_off(self.hop):
            self._leave()
            return True
        since_s = max(self._left_s, self.t_s - self.config.hold_s)
        left = self.memory.visited_s(self.hop) > since_s or self._has_mate(self.hop)
        if left or (for_long and not self.heard()):
            self._leave()
            return True
        return False

    def _has_mate(self, vertex: int) -> bool:
        """Whether a mate that is heard is there."""
        reach_m = SURELY_RATIO * self.task.visit_m
        return any(self.roadmap.away_m(vertex, word.x_m, word.y_m) <= reach_m for _, word in self.heard())

    def _leave(self) -> None:
        """Go on as if it had been where it was sent."""
        self.came_from, self._left_s, self._kept_out_s = self.hop, self.t_s, math.inf
        self.memory.leave(self.hop, self.t_s)

    def ask(self) -> bool:
        """Let the strategy say where to go, or the battery; False where the strategy says to wait."""
        self._then = -1
        if self.battery is not None and (self.homeward or self.runs_low()):
            self.hop = self.target = self.battery.station
            return True
        graph, at = self.task.graph, self.came_from
        target = int(self.task.strategy.next_vertex(self._knowledge()))
        self.target = target
        length_m = float(graph.shortest_m[at, target])
        self.memory.bound(target, self.t_s, self.t_s + length_m / max(self.memory.own.speed_m_s, 1e-3))
        if target == at:
            # It may have begun beside it, or made room for somebody; where a mate stands it is not needed.
            self.hop = at
            return self.away_m(at) > self.task.visit_m and not self._has_mate(at)
        self.hop = int(graph.next_hop[at, target])
        after = target if self.hop != target else following(self.task.strategy)
        if after >= 0:
            self._then = int(graph.next_hop[self.hop, after])
        return True

    def is_called_back(self) -> bool:
        """Whether its strategy wants to be asked on the way."""
        strategy = self._attentive
        if strategy is None or self.homeward or not self._has_heard:
            return False
        self._has_heard = False
        return strategy.is_away and strategy.calls_back(self._knowledge())

    def lead(self, vertex: int, *, first: bool = False) -> Twist:
        """The command that leads to a vertex; who goes ``first`` drives on towards mates who talk.

        As does who has no metre of its battery to spare for a path around them: they make room.
        """
        first |= self.must_go_home()
        then = self._then if vertex == self.hop != self._then else -1
        at, came_from = self.roadmap.places_xy_m[vertex], self.came_from
        return self.motion.descend(
            self.roadmap.time_s(vertex), at, came_from=came_from, then=then, first=first
        )

    def has(self, time: FloatArray) -> bool:
        """Whether a field is over the roadmap's nodes; who knows of bodies lays them finer."""
        return time.shape == self.roadmap.slowness.shape

    def descend(self, time: FloatArray) -> Twist:
        """The command that leads down a field of the roadmap, to no place to visit."""
        return self.motion.descend(time)

    def tell_claim(self, claim: Claim | None) -> None:
        """Claim a passage, or none any more; told at once where that is news."""
        old, self.claim = self.claim, claim
        if old is None and claim is None:
            return
        before, now = (None if c is None else (c.since_s, c.inside) for c in (old, claim))
        self._has_news |= before != now

    def crowded(self, reach_m: float) -> bool:
        """Whether something that may move is so near to the body's edge: no mate that waits as well, and
        nobody who is planned around."""
        pose, near_m = self.pose.as_array(), reach_m + self.radius_m
        if not disc_returns.is_near_beside(self.strange, pose, near_m, NO_DISCS, 0.0):
            return False  # as nearly always
        stay = [(x, y, self.radius_m) for x, y in self._obstructions.shutting_xy_m.tolist()]
        for number, word in self.heard():
            if self.memory.waits(number) and not word.blocked:
                stay.append((word.x_m, word.y_m, word.radius_m))
        discs = np.array(stay).reshape(-1, 3)
        return disc_returns.is_near_beside(self.strange, pose, near_m, discs, TOLD_M)

    def here(self) -> FloatArray:
        """(1, 3) the place where it is, as a path; (0, 3) off the map."""
        time = self.roadmap.time_s(self.came_from)
        return self.roadmap.way(self.pose.x_m, self.pose.y_m, time, 0.0)

    def is_narrow(self) -> bool:
        """Whether there is room for one where it is."""
        return bool((self.here()[:, 2] < self.pass_m).any())
