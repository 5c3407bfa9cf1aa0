"""Dubins curves: the shortest forward paths of bounded curvature between poses, or to a point.

A curve is a word of three pieces, left arc (L), right arc (R) or straight (S), and their lengths.
The six words that can be shortest are those of Dubins (1957), Am. J. Math. 79(3); they are classified by
Shkel and Lumelsky (2001), Robotics and Autonomous Systems 34, and told in LaValle (2006), Planning
Algorithms, 15.3.1. The pieces are found here from the centres of the turning circles and the tangents
between them, not from the trigonometric identities of those texts: differences of large numbers do not
appear, and coincident poses need no special case beyond coincident centres.

With a free final heading the shortest path to a point is an arc and a straight, or two arcs (Bui,
Boissonnat, Soueres and Laumond 1994, ICRA, pp. 2-7): a word whose last piece is empty.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.jit import kernel

LSL, LSR, RSL, RSR, RLR, LRL = range(6)
WORD_NAMES = ("LSL", "LSR", "RSL", "RSR", "RLR", "LRL")
TURNS = np.array([[1, 0, 1], [1, 0, -1], [-1, 0, 1], [-1, 0, -1], [-1, 1, -1], [1, -1, 1]])
"""Sign of the curvature of each word's three pieces."""

TWO_PI = 2.0 * math.pi
SNAP_RAD = 1e-9
"""A turn that lacks less than this from a full circle is no turn: rounding must not cost a loop."""


class Curve(NamedTuple):
    """From which pose and how tightly it bends; its word, and the lengths of that word's pieces in metres."""

    x: float
    y: float
    th: float
    radius: float
    word: int
    l0: float
    l1: float
    l2: float


@kernel
def length_of(curve: Curve) -> float:
    """Of all three pieces."""
    return curve.l0 + curve.l1 + curve.l2


@kernel
def _turn(angle: float) -> float:
    """Angle in [0, 2 pi), where all but a full circle counts as zero."""
    wrapped = angle - TWO_PI * math.floor(angle / TWO_PI)
    if wrapped >= TWO_PI - SNAP_RAD:
        return 0.0
    return wrapped


@kernel
def word_lengths(
    x0: float, y0: float, th0: float, x1: float, y1: float, th1: float, radius: float, word: int
) -> tuple[float, float, float]:
    """Lengths in metres of one word's pieces from pose 0 to pose 1; all inf where the word has no solution.

    ``radius`` must be positive. Of the two three-arc curves of RLR and of LRL the one whose middle arc
    exceeds half a circle is taken: the other is never shortest (Dubins 1957). Ends meet within
    ``SNAP_RAD`` times the curve's length.
    """
    first, second, last = TURNS[word, 0], TURNS[word, 1], TURNS[word, 2]
    # Centre of the first and of the last turning circle.
    ax, ay = x0 - first * radius * math.sin(th0), y0 + first * radius * math.cos(th0)
    bx, by = x1 - last * radius * math.sin(th1), y1 + last * radius * math.cos(th1)
    vx, vy = bx - ax, by - ay
    between = math.sqrt(vx * vx + vy * vy)
    if second != 0:
        if between > 4.0 * radius:
            return math.inf, math.inf, math.inf
        aside = math.acos(min(1.0, between / (4.0 * radius)))
        middle = math.pi + 2.0 * aside
        # Heading where the first arc hands over to the middle one, on the far side of the line of centres.
        leave = math.atan2(vy, vx) + first * (0.5 * math.pi + aside)
        arrive = leave - first * middle
        return (
            radius * _turn(first * (leave - th0)),
            radius * middle,
            radius * _turn(last * (th1 - arrive)),
        )
    if first == last:
        if between <= SNAP_RAD * radius:
            return radius * _turn(first * (th1 - th0)), between, 0.0
        heading = math.atan2(vy, vx)
        # Rounding turns a short straight by this much: what then seems a full circle is none.
        doubt = max(SNAP_RAD, 1e-15 * (abs(ax) + abs(ay) + abs(bx) + abs(by) + radius) / between)
        arc0 = _turn(first * (heading - th0))
        if arc0 >= TWO_PI - doubt:
            heading, arc0 = th0, 0.0
        arc1 = _turn(first * (th1 - heading))
        if arc1 >= TWO_PI - doubt:
            arc0, arc1 = _turn(first * (th1 - th0)), 0.0
        return radius * arc0, between, radius * arc1
    squared = between * between - 4.0 * radius * radius
    # Circles that touch have a tangent of length zero, which rounding may make imaginary.
    if squared < -1e-12 * radius * radius:
        return math.inf, math.inf, math.inf
    straight = math.sqrt(max(0.0, squared))
    heading = math.atan2(vy, vx) + first * math.atan2(2.0 * radius, straight)
    return radius * _turn(first * (heading - th0)), straight, radius * _turn(last * (th1 - heading))


@kernel
def shortest(x0: float, y0: float, th0: float, x1: float, y1: float, th1: float, radius: float) -> Curve:
    """The shortest Dubins curve from pose 0 to pose 1.

    At equal lengths the first word in the order of ``WORD_NAMES`` wins. Poses that differ by less than
    about ``SNAP_RAD`` turning radii are the same pose.
    """
    best_word, best = 0, math.inf
    best0, best1, best2 = math.inf, math.inf, math.inf
    # Circles farther apart than four radii leave no room for three arcs: six radii between the poses do.
    far = (x1 - x0) ** 2 + (y1 - y0) ** 2 > 36.0 * radius * radius
    for word in range(4 if far else 6):
        a, b, c = word_lengths(x0, y0, th0, x1, y1, th1, radius, word)
        if a + b + c < best:
            best_word, best = word, a + b + c
            best0, best1, best2 = a, b, c
    return Curve(x0, y0, th0, radius, best_word, best0, best1, best2)


@kernel
def shortest_to_point(x0: float, y0: float, th0: float, x1: float, y1: float, radius: float) -> Curve:
    """The shortest curve from a pose to a point reached with any heading.

    An arc and its tangent through the point, or, for a point inside a turning circle, two arcs; the
    third piece is empty.
    """
    if math.hypot(x1 - x0, y1 - y0) <= SNAP_RAD * radius:
        return Curve(x0, y0, th0, radius, LSL, 0.0, 0.0, 0.0)  # by rounding it would be a whole circle
    best_word, best, best0, best1 = LSL, math.inf, math.inf, math.inf
    for side in (1, -1):
        cx, cy = x0 - side * radius * math.sin(th0), y0 + side * radius * math.cos(th0)
        vx, vy = x1 - cx, y1 - cy
        away = math.sqrt(vx * vx + vy * vy)
        direction = math.atan2(vy, vx)
        squared = away * away - radius * radius
        if squared >= -1e-12 * radius * radius:
            straight = math.sqrt(max(0.0, squared))
            heading = direction + side * math.atan2(radius, straight)
            arc = radius * _turn(side * (heading - th0))
            if arc + straight < best:
                best_word, best, best0, best1 = (LSL if side > 0 else RSR), arc + straight, arc, straight
        if radius <= away <= 3.0 * radius:
            # The second circle's centre is 2 r from the first one's and r from the point.
            cosine = (away * away + 3.0 * radius * radius) / (4.0 * away * radius)
            aside = math.acos(min(1.0, cosine))
            for mirror in (1, -1):
                toward = direction + mirror * aside
                mx, my = cx + 2.0 * radius * math.cos(toward), cy + 2.0 * radius * math.sin(toward)
                leave = toward + side * 0.5 * math.pi
                # The second arc turns the other way: its heading lies a quarter turn off the radius.
                arrive = math.atan2(y1 - my, x1 - mx) - side * 0.5 * math.pi
                arc0 = radius * _turn(side * (leave - th0))
                arc1 = radius * _turn(side * (leave - arrive))
                if arc0 + arc1 < best:
                    best_word, best, best0, best1 = (LRL if side > 0 else RLR), arc0 + arc1, arc0, arc1
    return Curve(x0, y0, th0, radius, best_word, best0, best1, 0.0)


@kernel
def connect(
    x0: float, y0: float, th0: float, x1: float, y1: float, th1: float, free: bool, radius: float
) -> Curve:
    """The shortest curve from pose 0 to pose 1, or to the point where its heading is free."""
    if free:
        return shortest_to_point(x0, y0, th0, x1, y1, radius)
    return shortest(x0, y0, th0, x1, y1, th1, radius)


@kernel
def advance(
    x: float, y: float, th: float, turn: int, radius: float, length: float
) -> tuple[float, float, float]:
    """Pose after ``length`` metres of one piece: ``turn`` is 1 left, -1 right, 0 straight."""
    if turn == 0:
        return x + length * math.cos(th), y + length * math.sin(th), th
    swept = th + turn * length / radius
    half = 0.5 * length / radius
    # The chord keeps its digits for arcs so short that sin(swept) - sin(th) would lose them.
    chord = 2.0 * radius * math.sin(half)
    middle = th + turn * half
    return x + chord * math.cos(middle), y + chord * math.sin(middle), swept


@kernel
def pose_at(curve: Curve, s: float) -> tuple[float, float, float]:
    """Pose at arc length ``s`` along a curve, its heading in [-pi, pi)."""
    x, y, th = curve.x, curve.y, curve.th
    left = s
    for piece in range(3):
        length = curve.l0 if piece == 0 else (curve.l1 if piece == 1 else curve.l2)
        part = min(left, length)
        if part > 0.0:
            x, y, th = advance(x, y, th, TURNS[curve.word, piece], curve.radius, part)
            left -= part
    th = th - TWO_PI * math.floor((th + math.pi) / TWO_PI)
    if th >= math.pi:
        th = -math.pi
    return x, y, th


@kernel
def sample(curve: Curve, spacing: float) -> FloatArray:
    """States (N, 3) x, y, theta evenly along a curve, at most ``spacing`` apart, with both its ends."""
    total = length_of(curve)
    count = max(1, math.ceil(total / spacing - 1e-9))
    out = np.empty((count + 1, 3))
    for i in range(count + 1):
        s = total if i == count else total * i / count
        out[i, 0], out[i, 1], out[i, 2] = pose_at(curve, s)
    return out
