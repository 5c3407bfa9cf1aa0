"""The last word before a command leaves: no navigator drives into what its lasers show."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pilotage.core.types import STOP, Twist
from pilotage.experiments.mission import mission_of
from pilotage.experiments.run import run_mission
from pilotage.kernels.bodies.beam_contact import touches_an_end
from pilotage.kernels.scans.rays import fan_ranges
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, OdometryIncrement, Reading, Readings
from pilotage.sensors.sensor import Mount, SensorConfig
from pilotage.sensors.wheel_odometry import WheelOdometryConfig
from pilotage.stack.control.last_word import LastWord
from pilotage.stack.control.scan_guard import LaserView
from pilotage.stack.control.wander import WanderConfig
from pilotage.stack.interface import Belief
from pilotage.stack.navigator.wandering import Wandering
from support.robots import told_of
from support.worlds import alone, robot

NO_DISCS = np.zeros((0, 3))
RECTANGLE = np.array([[0.255, 0.215], [-0.255, 0.215], [-0.255, -0.215], [0.255, -0.215]])
AHEAD = [0.37, -3.0, 0.37, 3.0]
BESIDE, POST = [-3.0, 0.306, 3.0, 0.306], [-0.002, 0.3, 0.002, 0.3]
AHEAD_M_S, BACK_M_S = Twist(0.5, 0.0), Twist(-0.5, 0.0)
TOLD: dict[str, SensorConfig] = {"odometry": WheelOdometryConfig(rate_hz=10.0)}
ALL_ROUND = LidarConfig(beams=2880, field_of_view_rad=2.0 * math.pi)


def scan_of(sheet: LidarConfig, *walls: list[float]) -> LidarScan:
    """What a laser reads beside walls, without noise."""
    mount, segments = sheet.mount, np.array(walls, dtype=np.float64).reshape(-1, 4)
    first_rad = mount.theta_rad + float(sheet.beam_angles_rad()[0])
    ranges_m = fan_ranges(
        mount.x_m,
        mount.y_m,
        first_rad,
        sheet.beam_step_rad,
        sheet.beams,
        sheet.max_range_m,
        segments,
        NO_DISCS,
    )
    return LidarScan(ranges_m)


class Stub:
    """A localizer that believes what it was told."""

    def __init__(self, belief: Belief) -> None:
        self.belief = belief

    def step(self, readings: Readings) -> Belief:  # noqa: ARG002
        return self.belief


def word_of(sheets: Mapping[str, SensorConfig], footprint: Footprint | None = None) -> LastWord:
    told = told_of().robot
    return LastWord(replace(told, sensors=sheets, footprint=footprint or told.footprint))


def hears(word: LastWord, t_s: float, **readings: Reading) -> LastWord:
    word.take_in(Readings(t_s, readings))
    return word


def rolls(word: LastWord, **readings: Reading) -> LastWord:
    """It is as fast already as it is told to be: from rest no step gets it there."""
    return hears(word, 0.1, odometry=OdometryIncrement(0.05, 0.15), **readings)


def test_a_command_is_looked_at_by_what_the_laser_shows_as_far_as_it_takes_to_stop() -> None:
    sheets = {"lidar": LidarConfig()} | TOLD
    seen = scan_of(LidarConfig(), AHEAD)
    word = rolls(word_of(sheets), lidar=seen)
    assert not word.allows(AHEAD_M_S)
    assert word.shown_m[:, 0].min() == pytest.approx(0.37)
    # Slowly there is room to stop; away, along, on the spot and without a scan as well.
    for command in (Twist(0.1, 0.0), BACK_M_S, Twist(0.0, 1.0), Twist(0.0, 0.0, 0.5), STOP):
        assert word.allows(command)
    assert hears(word_of(sheets), 0.1).allows(AHEAD_M_S)
    assert rolls(word_of(dict(TOLD)), lidar=seen).allows(AHEAD_M_S)
    # Corners swing where a disc does not.
    corners_m = np.array([[0.35, 0.2], [-0.1, 0.2], [-0.1, -0.2], [0.35, -0.2]])
    angular = rolls(word_of(sheets, Footprint.polygon(corners_m)), lidar=seen)
    assert not angular.allows(Twist(0.0, -1.5))
    assert angular.allows(Twist(-0.3, 0.0))


@pytest.mark.parametrize(("moves_m", "held_s"), [(0.0, 2.9), (0.05, 0.5)])
def test_who_gets_on_is_held_by_nothing(moves_m: float, held_s: float) -> None:
    """At 1.5 m/s it was refused now and then: after 2 s it took a step clear, at a tenth of its speed."""
    word, seen = word_of({"lidar": ALL_ROUND} | TOLD), scan_of(ALL_ROUND, BESIDE)
    held = []
    for k in range(1, 31):
        hears(word, 0.1 * k, lidar=seen, odometry=OdometryIncrement(moves_m, 0.0))
        assert not word.allows(Twist(0.3, 1.5))
        held.append(word.held_s)
    assert max(held) == pytest.approx(held_s)


def test_what_was_shown_last_counts_where_no_scan_comes() -> None:
    """Of scans of which three tenths were lost four were so in a row: who had stood drove into the wall."""
    word = rolls(word_of({"lidar": LidarConfig()} | TOLD), lidar=scan_of(LidarConfig(), AHEAD))
    for k in range(2, 30):
        still = hears(word, 0.1 * k, odometry=OdometryIncrement(0.0, 0.0))
        assert not still.allows(AHEAD_M_S)
    assert hears(word, 3.0, lidar=scan_of(LidarConfig())).allows(AHEAD_M_S), "it has gone"
    # Once it was far from where it was taken, or where the way there is not known, it tells nothing.
    word = rolls(word_of({"lidar": LidarConfig()} | TOLD), lidar=scan_of(LidarConfig(), AHEAD))
    assert hears(word, 5.0, odometry=OdometryIncrement(0.05, 0.0)).allows(AHEAD_M_S)
    word = rolls(word_of({"lidar": LidarConfig()} | TOLD), lidar=scan_of(LidarConfig(), AHEAD))
    for k in range(2, 44):  # 1.05 m back, and as far forth again
        hears(word, 0.1 * k, odometry=OdometryIncrement(-0.05 if k < 23 else 0.05, 0.0))
    assert word.allows(AHEAD_M_S)


def test_what_is_touched_already_says_nothing_of_what_is_ahead() -> None:
    """Of all together the nearest got no nearer: beside a wall that it touched it drove into the next."""
    word = rolls(word_of({"lidar": ALL_ROUND} | TOLD), lidar=scan_of(ALL_ROUND, POST, AHEAD))
    assert word.allows(BACK_M_S)
    assert not word.allows(AHEAD_M_S)
    assert not word.allows(Twist(0.0, 0.0, 0.3))
    along = rolls(word_of({"lidar": ALL_ROUND} | TOLD), lidar=scan_of(ALL_ROUND, BESIDE))
    assert along.allows(AHEAD_M_S)
    assert along.allows(Twist(0.3, -1.5))
    assert not along.allows(Twist(0.3, 1.5))
    assert not along.allows(Twist(0.0, 0.0, 0.3))


def test_from_rest_it_gets_no_faster_than_it_can_in_a_step() -> None:
    """With weak brakes it stood before every wall that it could have crept up to, for good."""
    weak = replace(told_of().robot, sensors={"lidar": ALL_ROUND, **TOLD})
    weak = replace(weak, motion=DifferentialDriveConfig(max_speed_m_s=1.5, max_acceleration_m_s2=0.3))
    near, fast = scan_of(ALL_ROUND, [0.34, -3.0, 0.34, 3.0]), Twist(1.0, 0.0)
    stands = hears(LastWord(weak), 0.1, lidar=near, odometry=OdometryIncrement(0.0, 0.0))
    assert stands.allows(fast)
    assert not hears(LastWord(weak), 0.1, lidar=near, odometry=OdometryIncrement(0.015, 0.0)).allows(fast)


@pytest.mark.parametrize(("beams", "field_rad"), [(720, 2.0 * math.pi), (90, 2.0 * math.pi), (181, math.pi)])
def test_what_one_beam_alone_sees_is_dust(beams: int, field_rad: float) -> None:
    """Wrong by the way, two of a hundred ranges ended a run: one near the robot in each scan kept it."""
    sheet = LidarConfig(beams=beams, field_of_view_rad=field_rad)
    ahead = int(np.argmin(np.abs(sheet.beam_angles_rad())))

    def allows(near: list[int]) -> bool:
        ranges_m = np.full(beams, 3.0)
        ranges_m[near] = 0.35
        return rolls(word_of({"lidar": sheet} | TOLD), lidar=LidarScan(ranges_m)).allows(AHEAD_M_S)

    assert allows([ahead])
    assert allows([ahead - 5, ahead, ahead + 5])
    assert not allows([ahead, ahead + 1])
    assert not allows([ahead - 1, ahead + 1])  # the one between measured nothing, or something else


def test_the_end_of_a_wall_that_is_met_edge_on_is_seen_scan_by_scan() -> None:
    """One beam at a time hits it, those beside it pass: a robot drove into what it had seen five times."""
    sheet = LidarConfig(beams=90, field_of_view_rad=2.0 * math.pi, range_var_m2=1e-6)
    word, at_m, allowed = word_of({"lidar": sheet} | TOLD), 0.0, True
    for k in range(1, 20):
        wall = [1.0 - at_m, 0.03, 3.0 - at_m, 0.03]
        hears(word, 0.1 * k, lidar=scan_of(sheet, wall), odometry=OdometryIncrement(0.05, 0.0))
        allowed = word.allows(AHEAD_M_S)
        if not allowed:
            break
        at_m += 0.05
    assert not allowed
    assert 1.0 - at_m > 0.3, "the disc of 0.3 m has not touched it"
    assert len(word.shown_m)
    assert abs(word.shown_m[:, 1] - 0.03).max() < 0.02


def test_of_a_laser_without_beams_beside_each_other_each_is_believed() -> None:
    sheet = LidarConfig(beams=3, field_of_view_rad=math.pi)
    word = rolls(word_of({"lidar": sheet} | TOLD), lidar=LidarScan(np.array([3.0, 0.35, 3.0])))
    assert not word.allows(AHEAD_M_S)


def test_each_laser_is_heeded_where_it_sits() -> None:
    """With two lasers it was idle."""
    half = LidarConfig(beams=360, field_of_view_rad=math.pi)
    sheets = {
        "front": half.model_copy(update={"mount": Mount(x_m=0.2)}),
        "back": half.model_copy(update={"mount": Mount(x_m=-0.2, theta_rad=math.pi)}),
    }
    behind = [-0.37, -3.0, -0.37, 3.0]
    word = rolls(
        word_of({**sheets, **TOLD}), **{name: scan_of(sheet, behind) for name, sheet in sheets.items()}
    )
    assert not word.allows(BACK_M_S)
    assert word.allows(AHEAD_M_S)


@pytest.mark.parametrize("told", [True, False])
def test_a_scan_counts_for_three_periods_from_where_the_robot_has_come_since(told: bool) -> None:
    """Between two scans of a slow laser it drove on as if it were blind."""
    slow = LidarConfig(rate_hz=1.0)
    sheets: dict[str, SensorConfig] = {"lidar": slow}
    if told:
        sheets["odometry"] = WheelOdometryConfig(rate_hz=10.0)
    word = hears(word_of(sheets), 0.0, lidar=scan_of(slow, [0.9, -3.0, 0.9, 3.0]))
    step, at_m, last_m = Twist(0.3, 0.0), 0.0, math.nan
    for k in range(1, 27):
        if word.allows(step):
            at_m, last_m = at_m + 0.03, 0.03
        else:
            last_m = 0.0
        odometry = {"odometry": OdometryIncrement(last_m, 0.0)} if told else {}
        hears(word, 0.1 * k, **odometry)
    # It stands where the disc of 0.3 m nearly touches, by the scan of long ago.
    assert 0.9 - 0.3 - 0.08 < at_m < 0.9 - 0.3
    assert not word.allows(step)
    assert word.held_s == pytest.approx(0.1 * (27 - 1 - round(at_m / 0.03)), abs=0.11)
    assert hears(word, 3.05).allows(AHEAD_M_S)


@pytest.mark.parametrize("wrong", [OdometryIncrement(0.5, 0.0), OdometryIncrement(0.02, 0.5)])
def test_odometry_that_no_such_robot_drives_moves_no_walls(wrong: OdometryIncrement) -> None:
    """Two per cent of outliers put walls on its map that are nowhere, until no plan was left."""
    right = OdometryIncrement(0.02, 0.0)
    word = word_of({"lidar": ALL_ROUND} | TOLD)
    seen = scan_of(ALL_ROUND, [0.75, -3.0, 0.75, 3.0], [-3.0, 0.4, 3.0, 0.4])
    hears(word, 0.1, lidar=seen, odometry=right)
    hears(word, 0.2, odometry=wrong)
    assert word.allows(Twist(0.2, 0.0))
    x_m, y_m = word._guard.place_m
    assert (x_m, y_m) == pytest.approx((0.04, 0.0))
    # Of half a second in which it told nothing as much is possible, and counts.
    hears(word, 0.3)
    for k in range(4, 8):
        hears(word, 0.1 * k)
    hears(word, 0.8, odometry=OdometryIncrement(0.5, 0.0))
    assert word._guard.place_m[0] == pytest.approx(0.54)


def test_what_lies_deep_in_the_body_is_its_own() -> None:
    """Dirt on a laser's window: a robot that heeds it never moves again."""
    ranges_m = np.full(539, 20.0)
    ranges_m[200:220] = 0.0
    ranges_m[300] = math.nan
    word = hears(word_of({"lidar": LidarConfig()}), 0.1, lidar=LidarScan(ranges_m))
    for command in (AHEAD_M_S, BACK_M_S, Twist(0.2, 1.0)):
        assert word.allows(command)


def refused_share(walls: list[list[float]], command: Twist, draws: int = 200) -> float:
    """How often a laser whose ranges are 3 cm off makes it refuse a command."""
    vague = ALL_ROUND.model_copy(update={"range_var_m2": 9e-4})
    rng, clean = np.random.default_rng(5), scan_of(vague, *walls).ranges_m
    refused = 0
    for _ in range(draws):
        word = word_of({"lidar": vague})
        for k in range(3):
            hears(word, 0.1 * (k + 1), lidar=LidarScan(clean + 0.03 * rng.standard_normal(len(clean))))
        refused += not word.allows(command)
    return refused / draws


def test_a_vague_laser_neither_stops_it_in_a_corridor_nor_lets_it_into_a_wall() -> None:
    """Two deviations of 3 cm were taken off what counts as touched: a wall was in it before that was."""
    slowly = Twist(0.1, 0.0)
    assert refused_share([[0.31, -3.0, 0.31, 3.0]], slowly) > 0.95
    assert refused_share([[0.31, -0.006, 0.31, 0.006]], slowly) > 0.75
    assert refused_share([[-3.0, 0.42, 3.0, 0.42], [-3.0, -0.42, 3.0, -0.42]], AHEAD_M_S) == 0.0


def test_the_reach_of_a_short_sighted_laser_is_no_wall() -> None:
    short = LidarConfig(max_range_m=0.35)
    word = hears(word_of({"lidar": short}), 0.1, lidar=LidarScan(np.full(539, 0.35)))
    assert word.allows(AHEAD_M_S)


def test_who_wanders_turns_away_from_what_it_would_touch() -> None:
    """With so little care of its own it drove into the first wall."""
    spec = robot({"lidar": ALL_ROUND})
    sim, told = alone(spec), told_of()
    known = replace(told.robot, sensors={"lidar": ALL_ROUND})
    word = LastWord(known)
    careless = WanderConfig(stop_m=0.01, go_m=0.02, margin_m=0.01)
    wandering = Wandering(careless, known, Stub(told.initial), word)
    command = STOP
    for _ in range(600):
        readings = sim.step(command)
        word.take_in(readings)
        command = wandering.step(readings)
    assert sim.body.collisions == 0
    assert sim.body.driven_m > 5.0


VARIANCES = {"x_var_m2": 1e-4, "y_var_m2": 1e-4, "theta_var_rad2": 1e-4}
WALLS = [[0, 0, 9, 0], [9, 0, 9, 6], [9, 6, 0, 6], [0, 6, 0, 0], [4.5, 0, 4.5, 2.5], [4.5, 3.5, 4.5, 6]]
LIDAR = {"name": "lidar", "beams": 720, "field_of_view_rad": 2.0 * math.pi, "max_range_m": 12.0}


def through_the_door(body: dict[str, Any], stack: dict[str, Any]) -> dict[str, Any]:
    """From one of two rooms to the other, with the walls as they are and a pose that is known."""
    return {
        "mission": "through-the-door",
        "world": {
            "map": {"map": "rooms", "bounds_m": [0, 0, 9, 6], "walls_m": WALLS},
            "start": {"x_m": 1.5, "y_m": 3.0, "theta_rad": 0.0},
            "goal": {"x_m": 7.5, "y_m": 3.0, "theta_rad": 0.0, "tolerance_m": 0.8, "tolerance_rad": 0.5},
        },
        "robot": {**body, "sensors": {"odometry": {"name": "wheel-odometry"}, "lidar": LIDAR}},
        "stack": {"initial": VARIANCES, **stack},
        "run": {"time_limit_s": 120.0, "oracles": ["localizer"]},
    }


CAR = {
    "footprint": {"points_m": [[0.6, 0.25], [-0.2, 0.25], [-0.2, -0.25], [0.6, -0.25]]},
    "motion": {"name": "bicycle", "wheelbase_m": 0.45, "max_speed_m_s": 0.8, "max_acceleration_m_s2": 1.0},
}
DISC = {
    "footprint": {"radius_m": 0.25},
    "motion": {"name": "differential-drive", "max_speed_m_s": 0.8},
}
MANEUVER = {"navigator": {"name": "maneuver", "speed_m_s": 0.5}, "planner": "hybrid-astar"}


@pytest.mark.parametrize("seed", [1, 2])
def test_maneuver_plans_around_walls_that_stand_elsewhere(seed: int) -> None:
    """By its own reckoning there was room beside what it drove into."""
    walls: list[list[float]] = [[0, 0, 12, 0], [12, 0, 12, 9], [12, 9, 0, 9], [0, 9, 0, 0]]
    for x, low, high in ((4.0, 1.0, 2.7), (8.0, 2.6, 4.3)):
        walls += [[x, 0, x, low], [x, high, x, 9]]
    for x, y, half in ((1.7, 2.7, 0.3), (7.1, 4.7, 0.3), (1.4, 1.9, 0.3), (1.7, 6.0, 0.3)):
        corners = [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]
        walls += [[*a, *b] for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    values = through_the_door(CAR, {**MANEUVER, "localizer": "dead-reckoning"})
    values["world"] = {
        "map": {"map": "rooms", "bounds_m": [0, 0, 12, 9], "walls_m": walls},
        "start": {"x_m": 2.7, "y_m": 4.4, "theta_rad": -3.1},
        "goal": {"x_m": 9.4, "y_m": 3.1, "tolerance_m": 0.8},
    }
    values["stack"]["initial"] = {"x_var_m2": 0.06, "y_var_m2": 0.06, "theta_var_rad2": 4e-4}
    values["run"] = {"time_limit_s": 120.0}
    found = run_mission(mission_of(values, seed=seed), save=False)
    assert found.metrics["collisions"] == 0
    assert found.success, found.metrics["reason"]
    assert cast(int, found.metrics.get("replans", 0)) > 0


def test_pose_stands_before_what_it_knows_no_way_around() -> None:
    values = through_the_door(DISC, {"navigator": {"name": "pose", "patience_s": 3.0}})
    values["world"]["goal"]["y_m"] = 5.0
    values["world"]["start"]["y_m"] = 5.0
    found = run_mission(mission_of(values), save=False)
    assert found.metrics["collisions"] == 0
    assert "for 3 s its lasers have shown something" in str(found.metrics["reason"])

    assert float(str(found.metrics["min_clearance_m"])) < 0.2


CURVE = {
    "navigator": {"name": "curve", "patience_s": 4.0},
    "planner": {"name": "theta-star", "clearance_m": 0.3},
    "controller": "kanayama",
}


def on_a_grid(folder: Path, **world: Any) -> dict[str, Any]:
    """The same rooms as cells of 0.1 m, for a disc that follows a curve through the door."""
    cells = np.ones((60, 90), dtype=np.uint8)
    cells[[0, -1], :] = cells[:, [0, -1]] = cells[:25, 45] = cells[35:, 45] = 0
    np.save(folder / "rooms.npy", cells)
    values = through_the_door(DISC, CURVE)
    values["world"] |= world
    values["world"]["map"] = {"name": "grid", "file": str(folder / "rooms.npy"), "resolution_m": 0.1}
    return values


def test_curve_stands_before_what_stays_and_fails(tmp_path: Path) -> None:
    """It drove over what was on no map."""
    box = {"kind": "circle", "centre_m": [3.0, 3.0], "radius_m": 0.3}
    found = run_mission(mission_of(on_a_grid(tmp_path, obstacles=[box])), save=False)
    assert found.metrics["collisions"] == 0
    assert "for 4 s its lasers have shown something" in str(found.metrics["reason"])


def test_curve_goes_on_where_somebody_has_gone(tmp_path: Path) -> None:
    """Its reference waits for it: it does not hurry after one that ran on."""
    rows = [
        f"{frame} 1 3.0 {3.0 if frame < 200 else 3.0 - 0.04 * (frame - 200)}" for frame in range(0, 260, 10)
    ]
    (tmp_path / "stands.txt").write_text("\n".join(rows))
    values = on_a_grid(tmp_path, people=[{"name": "track", "file": str(tmp_path / "stands.txt")}])
    values["stack"]["navigator"]["patience_s"] = 30.0
    found = run_mission(mission_of(values), save=False)
    assert found.metrics["collisions"] == 0
    assert found.success, found.metrics["reason"]
    alone_s = run_mission(mission_of(on_a_grid(tmp_path)), save=False).metrics["duration_s"]
    assert float(str(found.metrics["duration_s"])) > float(str(alone_s)) + 1.0


@given(
    st.floats(0.0, 0.02), st.floats(0.6, 1.2), st.floats(0.2, 0.5 * math.pi - 0.2), st.sampled_from((-1, 1))
)
@settings(max_examples=200)
def test_corners_between_beams_are_not_driven_into(
    depth_m: float, ahead_m: float, turned_rad: float, side: int
) -> None:
    """The corner of a box sticks out beyond the ends of beams 4 degrees apart; a robot clipped one."""
    sheet = LidarConfig(beams=90, field_of_view_rad=2.0 * math.pi * 89.0 / 90.0, range_var_m2=0.0)
    cosine, sine = math.cos(turned_rad), math.sin(turned_rad)
    box = np.array([[cosine, -sine], [sine, cosine]]) @ np.array([[0.0, 0.3, 0.3, 0.0], [0.0, 0.0, 0.3, 0.3]])
    # Its corner reaches so deep into what the robot's side sweeps.
    box += np.array([[ahead_m - box[0].min()], [0.215 - depth_m - box[1].min()]])
    box[1] *= side
    sides = np.column_stack([box.T, np.roll(box, -1, axis=1).T])
    touches = touches_an_end(
        scan_of(sheet, *sides.tolist()).ranges_m[None], np.zeros((1, 3)), np.array([3.0]),
        LaserView("laser", sheet).fan, (1.2, 0.0, 0.0), 120, (RECTANGLE, 0.34, 0.2),
        (0.01, sheet.beam_step_rad, 0.05, 0.0),
    )  # fmt: skip
    assert touches
