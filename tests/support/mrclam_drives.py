"""A simulated robot of the MRCLAM kind, written as the data set's files, with everything that real ones do.

Motion (world at 20 Hz):  v = (g - loss min(|w_c|, 0.45)) v_c (1 + e_v),  w = turn w_c (1 + e_w) + bend v,
commands late, travel a little aside of the heading, wheels that jerk; e_v, e_w first-order Gauss-Markov.
Camera: (r scale + offset) cos(bearing)^power (1 + axis tan(bearing) + e_landmark) + white, bearings of a
moment ago with an error of each landmark. The scatter and correlation of windows and readings are those of
the recorded robots.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
DT_S = 0.05
CLOCK_S = 1_300_000_000.0
ARENA_M = (0.3, 4.2, -4.0, 5.2)
LANDMARKS = 15
BARCODES = {1: 5, 2: 14, 3: 41, 4: 32, 5: 23} | {6 + i: 60 + 2 * i for i in range(LANDMARKS)}
UNKNOWN_BARCODE = 99
TRUTH_STDS = np.array([5e-4, 5e-4, 1e-3])
"""Of the cameras that know the pose: m, m, rad."""


@dataclass(frozen=True)
class Robot:
    """What drives; stds of the Gauss-Markov errors are relative or radians."""

    speed_gain: float = 1.042
    speed_loss: float = 1.12
    turn_gain: float = 0.944
    bend_rad_per_m: float = -0.043
    delay_s: float = 0.2
    course_rad: float = 0.02
    speed_error_std: float = 0.04
    turn_error_std: float = 0.03
    range_scale: float = 1.034
    depth_power: float = 0.905
    speed_jerk_std: float = 0.018
    turn_jerk_std: float = 0.07
    """In arcs twice that."""
    range_offset_m: float = 0.0
    axis_rad: float = 0.0
    """Of the optical axis, along which depth is measured."""
    landmark_range_std: float = 0.007
    landmark_bearing_std_rad: float = 0.007
    landmark_error_s: float = 15.0
    range_std: float = 0.006
    """Relative, white."""
    bearing_std_rad: float = 0.007
    bearing_offset_rad: float = 0.005
    bearing_age_s: float = 0.05


@dataclass(frozen=True)
class Events:
    """What befalls it, in seconds since the begin; stretches are (begin, end)."""

    duration_s: float = 600.0
    wrong_barcodes: float = 0.0
    """Share of the readings that carry another landmark's barcode."""
    unknown_barcodes: float = 0.0
    robots_seen: float = 0.05
    blind_s: tuple[tuple[float, float], ...] = ()
    standing_s: tuple[tuple[float, float], ...] = ()
    odometry_gaps_s: tuple[tuple[float, float], ...] = ()
    """The robot drives on, its commands were not logged."""
    truth_gaps_s: tuple[tuple[float, float], ...] = ()
    pushes: tuple[tuple[float, float, float], ...] = ()
    """Time, distance in metres (in a random direction), turn in radians."""


@dataclass
class _World:
    truth: list[tuple[float, float, float, float]] = field(default_factory=list)
    odometry: list[tuple[float, float, float]] = field(default_factory=list)
    readings: list[tuple[float, int, float, float]] = field(default_factory=list)


def one_of_a_kind(rng: np.random.Generator) -> Robot:
    """A robot as the five recorded ones are spread."""
    return Robot(
        speed_gain=rng.normal(1.042, 0.01),
        speed_loss=rng.normal(1.12, 0.03),
        turn_gain=rng.normal(0.944, 0.015),
        bend_rad_per_m=rng.normal(-0.043, 0.015),
        course_rad=rng.normal(0.0, 0.02),
        range_scale=rng.normal(1.018, 0.018),
        depth_power=rng.normal(0.905, 0.05),
        range_offset_m=rng.normal(0.05, 0.035),
        axis_rad=rng.normal(0.0, 0.025),
        bearing_offset_rad=rng.normal(0.0, 0.007),
    )


def landmark_places(seed: int = 0) -> FloatArray:
    """(15, 2): five groups of three, four on the arena's rim."""
    rng = np.random.default_rng([seed, 99])
    x0, x1, y0, y1 = ARENA_M
    places = []
    for group in range(5):
        at = (group + rng.uniform(-0.3, 0.3)) / 5 * 2.0 * math.pi
        out = 0.4 if group == 0 else 1.05
        middle = [x0 + x1 + out * (x1 - x0) * math.cos(at), y0 + y1 + out * (y1 - y0) * math.sin(at)]
        places += [0.5 * np.array(middle) + rng.uniform(-0.4, 0.4, 2) for _ in range(3)]
    return np.array(places)


def drive(seed: int, robot: Robot, events: Events, places: FloatArray) -> _World:
    """Simulate one robot."""
    rng = np.random.default_rng(seed)
    x0, x1, y0, y1 = ARENA_M
    x, y, theta = rng.uniform(x0, x1), rng.uniform(y0, y1), rng.uniform(-math.pi, math.pi)
    goal = x, y
    late = deque([(0.0, 0.0)] * round(robot.delay_s / DT_S))
    ages = round(robot.bearing_age_s / DT_S) + 1
    before = deque([(x, y, theta)] * ages, maxlen=ages)
    count = len(places)
    stds = np.array(
        [robot.speed_error_std, robot.turn_error_std]
        + [robot.landmark_range_std] * count
        + [robot.landmark_bearing_std_rad] * count
    )
    taus = np.array([20.0, 20.0] + [robot.landmark_error_s] * (2 * count))
    errors = rng.normal(0.0, stds)
    keep = np.exp(-DT_S / taus)
    shock = stds * np.sqrt(1.0 - keep**2)
    pushes = list(events.pushes)
    next_picture, pause_until = 1.0, 0.0
    world = _World()
    for k in range(round(events.duration_s / DT_S)):
        t = k * DT_S
        if pushes and t >= pushes[0][0]:
            _, far, turn = pushes.pop(0)
            direction = rng.uniform(-math.pi, math.pi)
            x, y, theta = x + far * math.cos(direction), y + far * math.sin(direction), theta + turn
        if not _in(events.truth_gaps_s, t):
            off_x, off_y, off_theta = (TRUTH_STDS * rng.standard_normal(3)).tolist()
            world.truth.append((t, x + off_x, y + off_y, theta + off_theta))
        command = (0.0, 0.0)
        if not _in(events.standing_s, t) and t >= pause_until:
            to_goal = goal[0] - x, goal[1] - y
            if math.hypot(*to_goal) < 0.3:
                goal = rng.uniform(x0, x1), rng.uniform(y0, y1)
                pause_until = t + (rng.uniform(2.0, 12.0) if rng.random() < 0.4 else 0.0)
            off = _wrap(math.atan2(to_goal[1], to_goal[0]) - theta)
            w = min(max(0.8 * off, -0.45), 0.45)
            command = (0.086 if abs(off) < 0.3 else 0.067, w if abs(off) > 0.05 else 0.0)
        if not _in(events.odometry_gaps_s, t):
            world.odometry.append((t, round(command[0], 3), round(command[1], 3)))
        late.append(command)
        v_c, w_c = late.popleft()
        faster, turns_more = errors[:2].tolist()
        v = (robot.speed_gain - robot.speed_loss * min(abs(w_c), 0.45)) * v_c * (1.0 + faster)
        w = robot.turn_gain * w_c * (1.0 + turns_more) + robot.bend_rad_per_m * v
        v += rng.normal(0.0, robot.speed_jerk_std) if v_c else 0.0
        jerk = robot.turn_jerk_std * (2.0 if abs(w_c) > 0.1 else 1.0)
        w += rng.normal(0.0, jerk) if v_c or w_c else 0.0
        middle = theta + robot.course_rad + 0.5 * w * DT_S
        x, y = x + v * DT_S * math.cos(middle), y + v * DT_S * math.sin(middle)
        theta += w * DT_S
        errors = keep * errors + shock * rng.standard_normal(len(errors))
        before.append((x, y, theta))
        after = t + DT_S
        if after >= next_picture:
            next_picture = after + rng.choice([0.2, 0.25, 0.45])
            if not _in(events.blind_s, after):
                _picture(
                    world,
                    after,
                    before[0],
                    (x, y, theta),
                    robot,
                    events,
                    places.tolist(),
                    errors[2:].tolist(),
                    rng,
                )
    return world


def _picture(
    world: _World,
    t: float,
    seen_from: tuple[float, float, float],
    pose: tuple[float, float, float],
    robot: Robot,
    events: Events,
    places: list[list[float]],
    landmark_errors: list[float],
    rng: np.random.Generator,
) -> None:
    for i, (x, y) in enumerate(places):
        r = math.hypot(x - pose[0], y - pose[1])
        b = _wrap(math.atan2(y - seen_from[1], x - seen_from[0]) - seen_from[2])
        if abs(b) > 0.58 or not 0.8 < r < 7.0 or rng.random() > 0.25:
            continue
        reading = (r * robot.range_scale + robot.range_offset_m) * math.cos(b) ** robot.depth_power
        reading *= 1.0 + robot.axis_rad * math.tan(b) + landmark_errors[i] + rng.normal(0.0, robot.range_std)
        barcode = BARCODES[6 + i]
        luck = rng.random()
        if luck < events.wrong_barcodes:
            barcode = BARCODES[6 + int((i + rng.integers(1, len(places))) % len(places))]
        elif luck < events.wrong_barcodes + events.unknown_barcodes:
            barcode = UNKNOWN_BARCODE
        bearing = b + landmark_errors[len(places) + i] + robot.bearing_offset_rad
        bearing += rng.normal(0.0, robot.bearing_std_rad)
        world.readings.append((t, barcode, max(reading, 0.05), bearing))
    if rng.random() < events.robots_seen:
        world.readings.append(
            (t, BARCODES[int(rng.integers(2, 6))], rng.uniform(0.5, 4.0), rng.uniform(-0.5, 0.5))
        )


def write_mrclam(
    folder: Path, robots: Sequence[tuple[int, int, Robot, Events]], places_seed: int = 0
) -> Path:
    """Write a data set: for each robot its number, seed, parameters and events."""
    folder.mkdir(parents=True, exist_ok=True)
    places = landmark_places(places_seed)
    note = "# simulated robots, in the form of the MRCLAM data set\n"
    rows = "".join(f"{6 + i}\t{x:.8f}\t{y:.8f}\t0.0001\t0.0001\n" for i, (x, y) in enumerate(places))
    (folder / "Landmark_Groundtruth.dat").write_text(note + rows)
    (folder / "Barcodes.dat").write_text(note + "".join(f"{s:3d} \t {b:3d}\n" for s, b in BARCODES.items()))
    for number, seed, robot, events in robots:
        world = drive(seed, robot, events, places)
        begin = CLOCK_S + 1e5 * seed
        for kind, lines in (
            (
                "Groundtruth",
                [f"{begin + t:.3f}\t{x:.8f}\t{y:.8f}\t{_wrap(a):.8f}" for t, x, y, a in world.truth],
            ),
            ("Odometry", [f"{begin + t:.3f}\t{v:.3f}\t{w:.3f}" for t, v, w in world.odometry]),
            ("Measurement", [f"{begin + t:.3f}\t{c}\t{r:.3f}\t{b:.3f}" for t, c, r, b in world.readings]),
        ):
            (folder / f"Robot{number}_{kind}.dat").write_text(note + "\n".join(lines) + "\n")
    return folder


def _in(stretches: Sequence[tuple[float, float]], t: float) -> bool:
    return any(begin <= t < end for begin, end in stretches)


def _wrap(angle: float) -> float:
    return (angle + math.pi) % (2.0 * math.pi) - math.pi
