"""Through a gap that only fits a footprint which stands straight to it: back off, turn, drive through."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.types import FloatArray, Twist
from pilotage.kernels.control.band import path_distances
from pilotage.kernels.control.footprint import Body
from pilotage.kernels.control.merged_means import merged_means, without_passed
from pilotage.kernels.geometry.motion import wrap
from pilotage.stack.control.local.gap_strip import (
    FEW_TURNS_RAD,
    TURNS_RAD,
    ends_beside,
    sides,
    sides_begin_m,
    widest_strip,
)
from pilotage.stack.control.local.rolling import PASSED_BEHIND_M, Scene

BEFORE_M = 0.6
BEYOND_M = 0.35
NEAR_M = 0.06
STRAIGHT_RAD, HEADED_RAD, SKEW = 0.02, 0.3, 0.2
"""Straight enough to set out; or headed for it, and corners take no more than this share of the room."""
SLOW_M_S = 0.35
SLOWER_M_S = 0.15
TURN_RAD_S = 1.0
"""Beside posts that are millimetres away, corners swing no more than two centimetres in a step."""
TIGHT_M = 0.045
"""With less room than this on either side it had better line up before a gap than stumble into it."""
ROOM_M = 0.03
"""With less room than this on either side it drives slower, with the least at the slower speed."""
LEAST_ROOM_M = 0.0135
"""With less than this on either side, as far as can be measured, it does not go in."""
LEAST_ENDS_M = 0.0025
"""The same between the ends that scans show, which noise brings nearer to each other."""
CORNER_M = 0.025
"""So much of the room on either side is left for errors of measures where more than the least is kept."""
ASKEW = 0.65
"""Nor does it go in farther off the axis than this share of the room on either side, or so much less straight
that a corner is: it lines up anew."""
ONTO_M = 0.15
"""It comes back to the axis within about this much way, or half of that to the gap ..."""
LEFT_OVER = 0.5
"""... and sets out from where no more is left of its offset before the gap than this share of the room."""
BEHIND, FARTHER_M = 3.0, 0.4
"""A little too far aside to, it first backs by about so many times its offset, the first time."""
AHEAD_RAD, ASIDE_M = 1.4, 0.1
"""A gap is ahead that leads in such a direction or nearer, and is hardly farther aside than ahead."""
LOOK_M = 0.05
LONGEST_S = 25.0
STEPS = 16
"""Places on the way to the point before a gap that are looked at."""
BARRED = 0.5
"""What stands nearer to that way than this share of the inner disc bars it; by what is farther it gets."""
THROUGH = 2
"""The last stage."""
CLOSED_M = 0.05
"""Posts so much nearer to each other than the body is wide, as seen from afar, leave no gap."""
TRIES = 3
NOISE_M = 0.03
"""Points of neighbouring cells so near to each other are one surface, and its noise."""
PASSED_WITHIN_M = 1.2
PASSED_ASIDE_M = 0.015
"""What a scan from so near looks past by so little to the side, and ends so far behind, is not there."""
NEW_SHARE = 0.15
"""Weight of a new scan in where these ends are."""


@dataclass(frozen=True, slots=True)
class NarrowPassage:
    """A gap's middle, the direction through it, its width, and how far the manoeuvre has come.

    ``begins_m``: its sides reach so far before its middle.

    Stages: 0 drives to the point before the gap, backwards if that lies behind; 1 turns towards the gap;
    2 drives along its axis until beyond. The axis is measured anew until the robot is in the gap.
    """

    x_m: float
    y_m: float
    direction_rad: float
    width_m: float
    stage: int
    begun_s: float
    begins_m: float = 0.0
    tries: int = 1
    ends_m: FloatArray | None = None

    def again(self, t_s: float) -> NarrowPassage | None:
        """Once more from before the gap; None where it has been tried often enough."""
        return None if self.tries >= TRIES else replace(self, stage=0, begun_s=t_s, tries=self.tries + 1)

    def backed_out(self, scene: Scene, t_s: float) -> NarrowPassage | None:
        """The same once it had to back; from here, where something stands before the point before the gap."""
        if self.stage > 0:
            return self
        x, y = float(scene.start[0]), float(scene.start[1])
        way = np.linspace([x, y], self._point_before(x, y), STEPS)
        away = path_distances(np.ascontiguousarray(way), scene.ground)
        if away.min() > BARRED * scene.body.inner_m and away[-1] > scene.body.inner_m:
            return self
        return None if self.tries >= TRIES else replace(self, stage=1, begun_s=t_s, tries=self.tries + 1)

    def step(self, scene: Scene, points_xy_m: FloatArray, t_s: float) -> tuple[NarrowPassage | None, Twist]:
        """The next command; None for itself when it is through or has taken too long.

        ``points_xy_m``: (N, 2) of the scan, in the order of its beams, where the scene has them.
        """
        along, across = self._place(float(scene.start[0]), float(scene.start[1]))
        # Who was led around it meanwhile is not in it: its sides are not what it drives between.
        aside = self.stage == THROUGH and abs(across) > 0.5 * self.width_m
        beside = aside and along + self.begins_m > -scene.body.inner_m
        closed = self.stage == THROUGH and self.width_m < 2.0 * scene.body.inner_m - CLOSED_M
        opened = self.stage < THROUGH and self.width_m > 2.0 * (scene.body.outer_m + TIGHT_M)
        if closed or opened or beside or t_s - self.begun_s > LONGEST_S:
            return None, Twist(0.0, 0.0)
        if along > BEYOND_M:
            onward = self._onward(scene, t_s)
            return (None, Twist(0.0, 0.0)) if onward is None else onward.command(scene)
        if along + self.begins_m < -scene.body.inner_m:
            return self._measured(scene, points_xy_m).command(scene)
        return self.command(scene)

    def is_tight(self, body: Body) -> bool:
        """Whether a body has so little room in it that it had better line up before it."""
        return self.width_m < tight_m(body)

    def is_ahead(self, scene: Scene) -> bool:
        """Whether it is to be lined up for from here: about in front of the robot, and about straight."""
        x, y, theta = float(scene.start[0]), float(scene.start[1]), float(scene.start[2])
        along, across = self._place(x, y)
        return (
            abs(wrap(self.direction_rad - theta)) < AHEAD_RAD and abs(across) < -math.tan(AHEAD_RAD) * along
        )

    def goes_in(self, scene: Scene) -> bool:
        """Whether it stands straight before the gap, or in it: what it lines up beside is not yet the gap."""
        along, _ = self._place(float(scene.start[0]), float(scene.start[1]))
        return self.stage == THROUGH and along > -scene.body.outer_m - LOOK_M - self.begins_m

    def command(self, scene: Scene) -> tuple[NarrowPassage, Twist]:
        """What to do at this stage."""
        x, y, theta = float(scene.start[0]), float(scene.start[1]), float(scene.start[2])
        if self.stage == 0:
            tx, ty = self._point_before(x, y)
            away = math.hypot(tx - x, ty - y)
            if away < NEAR_M or self._lines_up_from(x, y, scene.body):
                return replace(self, stage=1), Twist(0.0, 0.0)
            bearing = wrap(math.atan2(ty - y, tx - x) - theta)
            backwards = abs(bearing) > 0.5 * math.pi
            off = wrap(bearing - math.pi) if backwards else bearing
            turn = _limited(3.0 * off, TURN_RAD_S)
            if abs(off) > 0.35:
                return self, Twist(0.0, turn)
            speed = min(SLOW_M_S, 1.5 * away + 0.05)
            return self, Twist(-speed if backwards else speed, turn)
        if self.stage == 1:
            off = wrap(self.direction_rad - theta)
            headed = abs(off) < HEADED_RAD and _swing_m(scene.body, off) < SKEW * self._room_m(scene.body)
            straight = abs(off) < STRAIGHT_RAD or headed
            if straight and abs(scene.start[4]) < 0.1:
                return replace(self, stage=THROUGH), Twist(0.0, 0.0)
            return self, Twist(0.0, _limited(3.0 * off, TURN_RAD_S))
        along, across = self._place(x, y)
        too_narrow = self.width_m < 2.0 * (scene.body.inner_m + LEAST_ROOM_M)
        if self.ends_m is not None:
            apart = float(np.hypot(*(self.ends_m[0] - self.ends_m[1])))
            too_narrow = too_narrow or apart < 2.0 * (scene.body.inner_m + LEAST_ENDS_M)
        if -scene.body.outer_m - LOOK_M < along + self.begins_m < -scene.body.inner_m:
            if too_narrow:
                return self, Twist(0.0, 0.0)
            room = ASKEW * self._room_m(scene.body)
            corner = _swing_m(scene.body, wrap(self.direction_rad - theta))
            if max(abs(across), corner) > room:
                return replace(self, stage=0), Twist(0.0, 0.0)
        # Steers back onto the axis: a heading that falls with the distance to it.
        way = -along - self.begins_m - scene.body.outer_m - LOOK_M
        wanted = self.direction_rad - math.atan2(across, max(ONTO_M, 0.5 * way))
        share = (self._room_m(scene.body) - LEAST_ROOM_M) / (ROOM_M - LEAST_ROOM_M)
        speed = SLOWER_M_S + min(max(share, 0.0), 1.0) * (SLOW_M_S - SLOWER_M_S)
        return self, Twist(speed, _limited(4.0 * wrap(wanted - theta), TURN_RAD_S))

    def _point_before(self, x: float, y: float) -> tuple[float, float]:
        """Where it lines up, on its axis, as seen from a place."""
        along, across = self._place(x, y)
        before = BEFORE_M + self.begins_m
        aside = BEHIND * abs(across)
        if self.tries == 1 and aside < FARTHER_M and along > -before - BEFORE_M:
            before = min(max(before, aside - along), before + FARTHER_M)
        c, s = math.cos(self.direction_rad), math.sin(self.direction_rad)
        return self.x_m - before * c, self.y_m - before * s

    def margin_m(self, scene: Scene, least_m: float, most_m: float) -> float:
        """What is kept from everything in the gap; beyond its middle more, where its sides leave as much.

        What is ahead there is not the gap any more: a box behind one that left 4 cm was touched, for where
        both sides of a corner lie in one cell their mean is behind it by a centimetre.
        """
        if not self.is_past_middle(scene):
            return least_m
        return min(max(self._room_m(scene.body) - CORNER_M, least_m), most_m)

    def is_past_middle(self, scene: Scene) -> bool:
        """Whether the robot has come beyond the middle of the gap."""
        return self._place(float(scene.start[0]), float(scene.start[1]))[0] > 0.0

    def _room_m(self, body: Body) -> float:
        """On either side of a body that stands straight in the middle."""
        return 0.5 * self.width_m - body.inner_m

    def _lines_up_from(self, x: float, y: float, body: Body) -> bool:
        """Whether it is back on the axis before it is in the gap if it sets out from here."""
        along, across = self._place(x, y)
        way = -along - self.begins_m - body.outer_m - LOOK_M
        if not ONTO_M < way < 2.0 * BEFORE_M:
            return False
        # Its offset shrinks with the square of the way that is left, in the end exponentially.
        shrunk = min(2.0 * ONTO_M / way, 1.0) ** 2 * math.exp(-min(way / ONTO_M, 2.0))
        return abs(across) * shrunk < LEFT_OVER * self._room_m(body)

    def _place(self, x: float, y: float) -> tuple[float, float]:
        """Along the axis from the gap's middle, and across it to the left."""
        c, s = math.cos(self.direction_rad), math.sin(self.direction_rad)
        return c * (x - self.x_m) + s * (y - self.y_m), c * (y - self.y_m) - s * (x - self.x_m)

    def _onward(self, scene: Scene, t_s: float) -> NarrowPassage | None:
        """The next piece of a passage that is longer than one gap; None where it widens."""
        ahead_m = scene.body.inner_m + LOOK_M
        along, _ = self._place(float(scene.start[0]), float(scene.start[1]))
        c, s = math.cos(self.direction_rad), math.sin(self.direction_rad)
        place = np.array([self.x_m, self.y_m]) + (along + ahead_m) * np.array([c, s])
        found = widest_strip(scene, place, self.direction_rad)
        if found is None:
            return None
        onward = NarrowPassage(*found, THROUGH, t_s, sides_begin_m(scene, *found), self.tries)
        return onward if onward.is_tight(scene.body) else None

    def _measured(self, scene: Scene, points: FloatArray) -> NarrowPassage:
        """The same with the axis as the points are now: its direction from the ground, its middle from scans.

        Where a wall ends within a cell, the cell's mean is up to half a cell's width from the end.
        """
        turns = FEW_TURNS_RAD if self.goes_in(scene) else TURNS_RAD
        found = widest_strip(scene, np.array([self.x_m, self.y_m]), self.direction_rad, turns)
        if found is None:
            return self
        x, y, direction, width = found
        ends = ends_beside(points, np.array([x, y]), direction, width)
        if ends is None:
            ends = self.ends_m
        elif self.ends_m is not None:
            ends = self.ends_m + NEW_SHARE * (ends - self.ends_m)
        if ends is not None:
            left = np.array([-math.sin(direction), math.cos(direction)])
            to_middle = float((0.5 * (ends[0] + ends[1]) - [x, y]) @ left)
            x, y = x + to_middle * float(left[0]), y + to_middle * float(left[1])
        begins_m = sides_begin_m(scene, x, y, direction, width)
        return replace(
            self, x_m=x, y_m=y, direction_rad=direction, width_m=width, begins_m=begins_m, ends_m=ends
        )


def sharpened(scene: Scene, points_xy_m: FloatArray, laser_xy_m: tuple[float, float]) -> Scene:
    """The scene without points that narrow a gap and are not there.

    That is what cells make of noise, on both sides, and what was seen from afar and the scan, whose beams end
    at ``points_xy_m`` (N, 2), looks past.
    """
    ground = scene.ground
    hits = without_passed(
        ground.hits, ground.mean, points_xy_m, *laser_xy_m, PASSED_WITHIN_M, PASSED_ASIDE_M, PASSED_BEHIND_M
    )
    return replace(scene, ground=ground._replace(hits=hits, mean=merged_means(hits, ground.mean, NOISE_M)))


def tight_m(body: Body) -> float:
    """Width below which a gap is tight for a body."""
    return 2.0 * (body.inner_m + TIGHT_M)


def find_narrow_passage(
    scene: Scene, ahead_m: float, t_s: float, widest_m: float = math.inf
) -> NarrowPassage | None:
    """The narrowest place of the way ahead, if a footprint has to stand straight to pass it.

    Its axis is that of the widest strip between the points to the left and to the right of the way there.
    None where the way is wide, one side is open, the gap is closed, or its sides are farther apart than
    ``widest_m``.
    """
    path = np.ascontiguousarray(scene.path[: max(3, round(ahead_m / 0.1))])
    if path.shape[0] < 3:
        return None
    away = path_distances(path, scene.ground)
    at = min(max(int(np.argmin(away)), 1), path.shape[0] - 2)
    if away[at] > scene.body.outer_m + 0.03:
        return None
    place, tangent = path[at], path[at + 1] - path[at - 1]
    pair = sides(scene, place, tangent / max(float(np.hypot(*tangent)), 1e-9))
    if pair is None:
        return None
    left, right = pair
    width = left - right
    if float(np.hypot(*width)) > widest_m:
        return None
    # Square to the line between the sides, left on the left; from there the widest strip.
    direction = math.atan2(-width[0], width[1])
    middle = 0.5 * (left + right)
    found = widest_strip(scene, middle, direction)
    if found is None:
        found = float(middle[0]), float(middle[1]), direction, float(np.hypot(*width))
    if found[3] < 2.0 * scene.body.inner_m - CLOSED_M:
        return None
    passage = NarrowPassage(*found, 0, t_s, sides_begin_m(scene, *found))
    return replace(passage, stage=THROUGH) if _is_between(scene, passage) else passage


def _is_between(scene: Scene, passage: NarrowPassage) -> bool:
    """Whether the robot stands between the sides of a passage already, and along it."""
    x, y, theta = float(scene.start[0]), float(scene.start[1]), float(scene.start[2])
    here = widest_strip(scene, np.array([x, y]), passage.direction_rad)
    if here is None or abs(wrap(here[2] - theta)) > TURNS_RAD.max():
        return False
    return replace(passage, width_m=here[3]).is_tight(scene.body)


def _swing_m(body: Body, off_rad: float) -> float:
    """By how much a body that is turned so far from straight reaches farther to its sides."""
    across = math.sin(off_rad) * body.polygon[:, 0] + math.cos(off_rad) * body.polygon[:, 1]
    return max(float(np.abs(across).max()) - body.inner_m, 0.0)


def _limited(value: float, most: float) -> float:
    return min(max(value, -most), most)
