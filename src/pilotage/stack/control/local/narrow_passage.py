"""Through a gap that only fits a footprint which stands straight to it: back off, turn, drive through."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pilotage.core.types import FloatArray, Twist
from pilotage.kernels.control.band import path_distances
from pilotage.kernels.control.merged_means import merged_means, without_passed
from pilotage.kernels.geometry.motion import wrap
from pilotage.stack.control.local.rolling import Scene

BEFORE_M = 0.6
BEYOND_M = 0.35
NEAR_M = 0.06
STRAIGHT_RAD = 0.02
SLOW_M_S = 0.35
SLOWER_M_S = 0.15
TURN_RAD_S = 1.0
"""Beside posts that are millimetres away, corners swing no more than two centimetres in a step."""
ROOM_M = 0.03
"""With less room than this on either side it drives at the slower speed."""
LEAST_ROOM_M = 0.0135
"""With less than this on either side, as far as can be measured, it does not go in."""
LEAST_ENDS_M = 0.0025
"""The same between the ends that scans show, which noise brings nearer to each other."""
ASKEW = 0.65
"""Nor does it go in farther off the axis than this share of the room on either side, or so much less straight
that a corner is: it lines up anew."""
ONTO_M = 0.15
"""It comes back to the axis within about this much way."""
LOOK_M = 0.05
SIDES_M = 0.8
ALONG_M = 0.35
"""Points so far before and behind the narrowest place are those that it has to pass between."""
TURNS_RAD = np.concatenate([[0.0], np.linspace(-0.25, 0.25, 51)])
KEEP_M = 0.004
"""A direction is kept unless another strip is wider by this: between two posts many are as wide."""
LONGEST_S = 25.0
THROUGH = 2
"""The last stage."""
CLOSED_M = 0.05
"""Posts so much nearer to each other than the body is wide, as seen from afar, leave no gap."""
TRIES = 3
NOISE_M = 0.03
"""Points of neighbouring cells so near to each other are one surface, and its noise."""
PASSED_WITHIN_M = 1.2
PASSED_ASIDE_M = 0.015
PASSED_BEHIND_M = 0.04
"""What a scan from so near looks past by so little to the side, and ends so far behind, is not there."""
BEAMS = 3
"""Neighbouring beams that are taken together where a scan is asked for the ends beside the gap."""
NEW_SHARE = 0.15
"""Weight of a new scan in where these ends are."""


@dataclass(frozen=True, slots=True)
class NarrowPassage:
    """A gap's middle, the direction through it, its width, and how far the manoeuvre has come.

    Stages: 0 drives to the point before the gap, backwards if that lies behind; 1 turns towards the gap;
    2 drives along its axis until beyond. The axis is measured anew until the robot is in the gap.
    """

    x_m: float
    y_m: float
    direction_rad: float
    width_m: float
    stage: int
    begun_s: float
    tries: int = 1
    ends_m: FloatArray | None = None

    def again(self, t_s: float) -> NarrowPassage | None:
        """Once more from before the gap; None where it has been tried often enough."""
        return None if self.tries >= TRIES else replace(self, stage=0, begun_s=t_s, tries=self.tries + 1)

    def step(self, scene: Scene, points_xy_m: FloatArray, t_s: float) -> tuple[NarrowPassage | None, Twist]:
        """The next command; None for itself when it is through or has taken too long.

        ``points_xy_m``: (N, 2) of the scan, in the order of its beams, where the scene has them.
        """
        along, _ = self._place(float(scene.start[0]), float(scene.start[1]))
        closed = self.stage == THROUGH and self.width_m < 2.0 * scene.body.inner_m - CLOSED_M
        if closed or t_s - self.begun_s > LONGEST_S or along > BEYOND_M:
            return None, Twist(0.0, 0.0)
        if along < -scene.body.inner_m:
            return self._measured(scene, points_xy_m).command(scene)
        return self.command(scene)

    def goes_in(self, scene: Scene) -> bool:
        """Whether it stands straight before the gap, or in it: what it lines up beside is not yet the gap."""
        along, _ = self._place(float(scene.start[0]), float(scene.start[1]))
        return self.stage == THROUGH and along > -scene.body.outer_m - LOOK_M

    def command(self, scene: Scene) -> tuple[NarrowPassage, Twist]:
        """What to do at this stage."""
        x, y, theta = float(scene.start[0]), float(scene.start[1]), float(scene.start[2])
        c, s = math.cos(self.direction_rad), math.sin(self.direction_rad)
        if self.stage == 0:
            tx, ty = self.x_m - BEFORE_M * c, self.y_m - BEFORE_M * s
            away = math.hypot(tx - x, ty - y)
            if away < NEAR_M:
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
            if abs(off) < STRAIGHT_RAD and abs(scene.start[4]) < 0.1:
                return replace(self, stage=THROUGH), Twist(0.0, 0.0)
            return self, Twist(0.0, _limited(3.0 * off, TURN_RAD_S))
        along, across = self._place(x, y)
        too_narrow = self.width_m < 2.0 * (scene.body.inner_m + LEAST_ROOM_M)
        if self.ends_m is not None:
            apart = float(np.hypot(*(self.ends_m[0] - self.ends_m[1])))
            too_narrow = too_narrow or apart < 2.0 * (scene.body.inner_m + LEAST_ENDS_M)
        if -scene.body.outer_m - LOOK_M < along < -scene.body.inner_m:
            if too_narrow:
                return self, Twist(0.0, 0.0)
            room = ASKEW * (0.5 * self.width_m - scene.body.inner_m)
            corner = scene.body.outer_m * abs(wrap(self.direction_rad - theta))
            if max(abs(across), corner) > room:
                return replace(self, stage=0), Twist(0.0, 0.0)
        # Steers back onto the axis: a heading that falls with the distance to it.
        wanted = self.direction_rad - math.atan2(across, ONTO_M)
        tight = 0.5 * self.width_m - scene.body.inner_m < ROOM_M
        return self, Twist(
            SLOWER_M_S if tight else SLOW_M_S, _limited(4.0 * wrap(wanted - theta), TURN_RAD_S)
        )

    def _place(self, x: float, y: float) -> tuple[float, float]:
        """Along the axis from the gap's middle, and across it to the left."""
        c, s = math.cos(self.direction_rad), math.sin(self.direction_rad)
        return c * (x - self.x_m) + s * (y - self.y_m), c * (y - self.y_m) - s * (x - self.x_m)

    def _measured(self, scene: Scene, points: FloatArray) -> NarrowPassage:
        """The same with the axis as the points are now: its direction from the ground, its middle from scans.

        Where a wall ends within a cell, the cell's mean is up to half a cell's width from the end.
        """
        found = _widest_strip(scene, np.array([self.x_m, self.y_m]), self.direction_rad)
        if found is None:
            return self
        x, y, direction, width = found
        ends = _ends_beside(points, np.array([x, y]), direction, width)
        if ends is None:
            ends = self.ends_m
        elif self.ends_m is not None:
            ends = self.ends_m + NEW_SHARE * (ends - self.ends_m)
        if ends is not None:
            left = np.array([-math.sin(direction), math.cos(direction)])
            to_middle = float((0.5 * (ends[0] + ends[1]) - [x, y]) @ left)
            x, y = x + to_middle * float(left[0]), y + to_middle * float(left[1])
        return replace(self, x_m=x, y_m=y, direction_rad=direction, width_m=width, ends_m=ends)


def _ends_beside(
    points: FloatArray, middle: FloatArray, direction_rad: float, width_m: float
) -> FloatArray | None:
    """(2, 2) the points of a scan (N, 2) to the left and to the right that are nearest to a gap's axis.

    Each is the mean of a few neighbouring beams. None where one side has none.
    """
    c, s = math.cos(direction_rad), math.sin(direction_rad)
    near = points[np.hypot(*(points - middle).T) < ALONG_M + width_m]
    if len(near) < BEAMS:
        return None
    weights = np.full(BEAMS, 1.0 / BEAMS)
    mean = np.column_stack([np.convolve(near[:, k], weights, mode="valid") for k in range(2)])
    apart = np.hypot(*(near[BEAMS - 1 :] - near[: 1 - BEAMS]).T)
    offset = mean - middle
    along, across = offset @ np.array([c, s]), offset @ np.array([-s, c])
    beside = (np.abs(along) < ALONG_M) & (apart < 2.0 * NEAR_M)
    ends = []
    for side in (1.0, -1.0):
        of_side = np.flatnonzero(beside & (side * across > 0.25 * width_m))
        if not of_side.size:
            return None
        ends.append(mean[of_side[int(np.argmin(side * across[of_side]))]])
    return np.array(ends)


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


def find_narrow_passage(scene: Scene, ahead_m: float, t_s: float) -> NarrowPassage | None:
    """The narrowest place of the way ahead, if a footprint has to stand straight to pass it.

    Its axis is that of the widest strip between the points to the left and to the right of the way there.
    None where the way is wide, one side is open, or the gap is closed.
    """
    path = np.ascontiguousarray(scene.path[: max(3, round(ahead_m / 0.1))])
    if path.shape[0] < 3:
        return None
    away = path_distances(path, scene.ground)
    at = min(max(int(np.argmin(away)), 1), path.shape[0] - 2)
    if away[at] > scene.body.outer_m + 0.03:
        return None
    place, tangent = path[at], path[at + 1] - path[at - 1]
    sides = _sides(scene, place, tangent / max(float(np.hypot(*tangent)), 1e-9))
    if sides is None:
        return None
    left, right = sides
    width = left - right
    # Square to the line between the sides, left on the left; from there the widest strip.
    direction = math.atan2(-width[0], width[1])
    middle = 0.5 * (left + right)
    found = _widest_strip(scene, middle, direction)
    if found is None:
        found = float(middle[0]), float(middle[1]), direction, float(np.hypot(*width))
    if found[3] < 2.0 * scene.body.inner_m - CLOSED_M:
        return None
    return NarrowPassage(*found, 0, t_s)


def _widest_strip(
    scene: Scene, middle: FloatArray, direction_rad: float
) -> tuple[float, float, float, float] | None:
    """Middle x, y, direction and width of the widest straight strip without a point in it, through a gap.

    Directions up to a quarter of a radian to either side are tried. None where one side is open.
    """
    offset = _points(scene, middle) - middle
    best: tuple[float, float, float, float] | None = None
    for turn in TURNS_RAD:
        c, s = math.cos(direction_rad + turn), math.sin(direction_rad + turn)
        along, across = offset @ np.array([c, s]), offset @ np.array([-s, c])
        beside = across[np.abs(along) < ALONG_M]
        left, right = beside[beside > 0.0], beside[beside <= 0.0]
        if not (left.size and right.size):
            continue
        low, high = float(right.max()), float(left.min())
        if best is None or high - low > best[3] + KEEP_M:
            to_middle = 0.5 * (low + high)
            best = (
                float(middle[0] - s * to_middle),
                float(middle[1] + c * to_middle),
                direction_rad + float(turn),
                high - low,
            )
    return best


def _points(scene: Scene, place: FloatArray) -> FloatArray:
    """(N, 2) obstacle points near a place."""
    n = scene.ground.hits.shape[0]
    rows, columns = np.nonzero(scene.ground.hits)
    points = scene.ground.mean[rows * n + columns]
    return np.asarray(points[np.hypot(*(points - place).T) < SIDES_M])


def _sides(scene: Scene, place: FloatArray, tangent: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """The nearest pair of obstacle points across a place, one on either side of the way."""
    points = _points(scene, place)
    offset = points - place
    across = tangent[0] * offset[:, 1] - tangent[1] * offset[:, 0]
    left, right = points[across > 0.02], points[across < -0.02]
    if not (left.shape[0] and right.shape[0]):
        return None
    apart = np.hypot(left[:, None, 0] - right[None, :, 0], left[:, None, 1] - right[None, :, 1])
    i, j = np.unravel_index(int(np.argmin(apart)), apart.shape)
    return left[i], right[j]


def _limited(value: float, most: float) -> float:
    return min(max(value, -most), most)
