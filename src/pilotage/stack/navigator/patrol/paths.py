"""Paths around what stands: where it is, what it leaves of the roadmap, and where plans proved wrong."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from pilotage.core.types import FloatArray, Pose2
from pilotage.kernels.control import eikonal
from pilotage.maps.world_map import WorldMap
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.navigator.patrol.config import PatrolNavigatorConfig
from pilotage.stack.navigator.patrol.impasses import INSIDE_M, Impasses
from pilotage.stack.navigator.patrol.motion import Motion
from pilotage.stack.navigator.patrol.obstructions import WIDER_M, Obstructions, Told
from pilotage.stack.navigator.patrol.senses import HEARD_PERIODS, TOLD_M, Senses
from pilotage.stack.patrol.roadmap import Roadmap, roadmap_of, usual_spacing_m
from pilotage.stack.patrol.shut_paths import NONE_SHUT, ShutPaths
from pilotage.stack.patrol.task import PatrolPlaces, PatrolTask

SURELY_RATIO = 0.9
"""Who is within so much of ``visit_m`` visits a place, though told places are a little off."""
MATE_M, AHEAD_M, BESIDE_M = 1.5, 2.0, 0.2
"""Nobody talks so near to so much of its path, and that leads so near past a body, where the plan fails."""


def roadmap_for(
    config: PatrolNavigatorConfig, robot: RobotKnowledge, chart: WorldMap, places: PatrolPlaces
) -> Roadmap:
    """The paths that a robot follows."""
    clearance_m = robot.radius_m + config.plan_margin_m
    return roadmap_of(
        chart,
        places.vertices_xy_m,
        places.stations_xy_m,
        clearance_m,
        robot.motion.top_speed_m_s,
        usual_spacing_m(chart.bounds_m, clearance_m) if config.spacing_m is None else config.spacing_m,
        0.5 * places.visit_m,
        config.lane_m,
    )


class Paths(Senses):
    """What it senses, the roadmap that it follows, and what it drives with.

    Attributes
    ----------
    roadmap
        The one that it follows now: around bodies, from where that leads anywhere.
    motion
        By what it chooses commands.
    hop, came_from
        The vertex that it drives to now, or the number of its charging station in the roadmap; the one that
        it was at last.
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
        self.roadmap = roadmap_for(config, robot, chart, task.places)
        self.motion = Motion(self, robot.motion, self.roadmap, self.radius_m + config.plan_margin_m)
        self._whole, self._obstructions, self._impasses = self.roadmap, Obstructions(), Impasses()
        self._open = self._whole
        self._shut: Roadmap | None = None
        self._back: tuple[Roadmap, FloatArray] | None = None
        self.hop = self.came_from = self.roadmap.nearest(start.x_m, start.y_m)

    def _others_are_shut(self, shut: ShutPaths) -> None:
        """Other paths are shut than before."""

    def look_who_shuts_paths(self) -> None:
        """Plan around those who have stood for long, from where that leads anywhere."""
        told = [
            Told(n, np.array(b[:2]), b[2]) for n, word in self.heard() if word.standing for b in word.standing
        ]
        if told or len(self.motion.standing) or not self._obstructions.are_none:
            other_bodies = self._look_for_bodies(told)
        else:  # as nearly always
            other_bodies = False
            self._obstructions.pass_time(self.t_s)
        if self._impasses.step(self.t_s) or other_bodies:
            self._shut_paths()
        self._take_what_leads_on()

    def _look_for_bodies(self, told: Sequence[Told]) -> bool:
        """Whether others are planned around than before, by what is seen and what mates tell."""
        heard = dict(self.heard())
        for _, place, _ in told:
            if not self._may_stand(place):
                self._obstructions.deny(place)
        for word in heard.values():
            self._obstructions.is_of_mate(np.array([word.x_m, word.y_m]), word.radius_m)
        known, standing = self._obstructions.known_xy_m, self.motion.standing
        absent = [self.sees_nothing_at(place, self.radius_m) for place in known]
        return self._obstructions.step(self.t_s, standing, absent, self.fell_silent(), told, heard)

    def _take_what_leads_on(self) -> None:
        """The paths around bodies, from where there is one."""
        for roadmap in (self._shut, self._open) if self._shut is not None else ():
            self._take(roadmap)
            if not self.is_off_roadmap():
                break

    def _may_stand(self, place: FloatArray) -> bool:
        """Whether somebody may stand where a mate says so: nothing that it sees or hears speaks against it.

        To whoever does not hear it a mate that stands is an obstruction; it may be this robot.
        """
        there = [(self.pose.x_m, self.pose.y_m), *((w.x_m, w.y_m) for _, w in self.heard())]
        return not any(math.dist(place, xy) < 2.0 * self.radius_m for xy in there) and (
            not self.sees_nothing_at(place, self.radius_m)
        )

    def _shut_paths(self) -> None:
        """Who shuts paths has changed."""
        bodies, here = self._obstructions.shutting, (self.pose.x_m, self.pose.y_m)
        bodies[:, 2] += self.motion.shut_m
        discs = np.concatenate([bodies, self._impasses.discs])
        self._shut, shut = None, NONE_SHUT
        self._open = self._whole.finer() if len(discs) else self._whole
        if len(discs):
            # Who keeps clear of a body ends up to a node short of the nearest one.
            near_m = SURELY_RATIO * self.task.visit_m - self._open.spacing_m
            self._shut = self._open.around(discs, here, near_m)
            shut = ShutPaths.of(self._shut, self.task.graph)
            text = "plans around " + ", ".join(f"({x:.1f}, {y:.1f})" for x, y, _ in discs.tolist())
            if shut.unreached:
                text += "; finds no path to vertex " + ", ".join(map(str, shut.unreached))
            self.say("shut", text)
        self._take(self._open)
        self._others_are_shut(shut)

    def finds_another_way(self) -> bool:
        """Whether it plans otherwise, as no command leads on where its plan does.

        Only where nobody talks beside the path: with mates it settles who goes. A body that is planned around
        is taken for larger; what stands beside a wall the map does not know, nor does the laser tell it from
        that.
        """
        x, y = self.pose.x_m, self.pose.y_m
        ahead = self.roadmap.way(x, y, self.roadmap.time_s(self.hop), AHEAD_M)[:, :2]
        mates = self._near_mates()
        if self.roadmap.is_cut_off(self.hop) or not self.at_rest or not len(ahead):
            return False
        if any(np.hypot(*(ahead - xy).T).min() < MATE_M for xy in mates):
            return False
        if not (self._is_too_near_a_body(ahead) or self._is_too_narrow(ahead)):
            return False
        self.say("no-way", f"no command leads on towards vertex {self.hop} where the plan does: plans anew")
        self._shut_paths()
        self._take_what_leads_on()
        return True

    def _near_mates(self) -> list[tuple[float, float]]:
        """Where mates said last that they are, but those that are silent for too long."""
        latest_s = self.t_s - self.patience_s(HEARD_PERIODS)
        return [(w.x_m, w.y_m) for _, (sent_s, w) in self.mates.items() if sent_s > latest_s]

    def _is_too_near_a_body(self, ahead: FloatArray) -> bool:
        """Whether a path (N, 2) leads past a body that is planned around, from which more is kept now."""
        for x, y, wider_m in self._obstructions.shutting:
            keep_m = self.motion.shut_m + wider_m
            most_m = math.dist((x, y), (self.pose.x_m, self.pose.y_m)) + INSIDE_M
            if np.hypot(*(ahead - [x, y]).T).min() < keep_m + BESIDE_M and keep_m + WIDER_M <= most_m:
                return self._obstructions.widen(np.array([x, y]))
        return False

    def _is_too_narrow(self, ahead: FloatArray) -> bool:
        """Whether a path (N, 2) leads nearer than commands may to what is seen and counts as a wall."""
        near = self.on_map(self.near)
        if not len(near):
            return False
        room_m = np.hypot(*(near[:, None] - ahead).T).min(axis=1)
        tightest = int(np.argmin(room_m))
        if room_m[tightest] >= self.radius_m + self.config.margin_m:
            return False
        place, strange = ahead[tightest], self.strange_on_map()
        if len(strange) and np.hypot(*(strange - place).T).min() < self.motion.wall_m:
            return False  # it may move: who stands is planned around by and by
        return self._impasses.meet(place, math.dist(place, (self.pose.x_m, self.pose.y_m)))

    def _take(self, roadmap: Roadmap) -> None:
        self.roadmap = self.motion.roadmap = roadmap

    def _is_at_end(self) -> bool:
        """Whether its way around bodies leads no nearer to where it drives to."""
        if self.roadmap is not self._shut:
            return False
        field = self.roadmap.placed(self.roadmap.time_s(self.hop))
        left_s = eikonal.value_at(self.pose.x_m, self.pose.y_m, field, 0.0)
        return self.speed_m_s * left_s < self.roadmap.spacing_m

    def is_off_roadmap(self) -> bool:
        """Whether nothing leads from where it is, nor from beside it, to where it was last."""
        roadmap, (x, y) = self.roadmap, (self.pose.x_m, self.pose.y_m)
        field = roadmap.placed(roadmap.time_s(self.came_from))
        return eikonal.value_at(x, y, field, 0.0) == math.inf and eikonal.descent(x, y, field) == (0.0, 0.0)

    def way_back(self) -> FloatArray | None:
        """The field to where paths lead from; None where it leads nowhere either.

        Brakes are looked at straight on, and may lead through a gap that is too narrow for plans.
        """
        if self._back is None or self._back[0] is not self.roadmap:
            # Nodes may lie beside the middle of such a gap: what commands keep from walls would shut it.
            self._back = self.roadmap, self.roadmap.way_back(self.came_from, self.radius_m)
        field = self._back[1]
        here_s = eikonal.value_at(self.pose.x_m, self.pose.y_m, self.roadmap.placed(field), 0.0)
        return field if math.isfinite(here_s) else None

    def without_planned_around(self, places: FloatArray) -> FloatArray:
        """Places (M, 2) but those of who is planned around: the path leads past, and nobody comes there."""
        if self.roadmap is self._shut:
            for body in self._obstructions.shutting_xy_m:
                places = places[np.hypot(*(places - body).T) >= self.radius_m + TOLD_M]
        return places
