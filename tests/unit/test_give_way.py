"""People who walk about are kept off the map and given way to, by whatever navigator and local controller."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pilotage.core.random import RandomStreams
from pilotage.core.types import STOP, FloatArray, Pose2, Twist
from pilotage.experiments.loop import simulate
from pilotage.experiments.mission import mission_of, read_mission
from pilotage.experiments.run import run_mission
from pilotage.kernels.control.closing_in import drive_closes_in
from pilotage.kernels.control.footprint import discs_clearance
from pilotage.kernels.geometry.motion import exact_arc
from pilotage.kernels.scans.rays import fan_ranges
from pilotage.maps.segment_map import SegmentMap
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import LidarScan, Readings
from pilotage.stack.control.give_way import GiveWay, GiveWayConfig
from pilotage.stack.control.make_room import MakeRoom, MakeRoomConfig
from pilotage.stack.interface import Belief
from pilotage.stack.knowledge import RobotKnowledge
from pilotage.stack.navigator.goal.escaping import Waiting
from pilotage.stack.perception.movers import Movers, MoversConfig
from pilotage.stack.perception.moving_bodies import MovingBodies, MovingBodiesConfig

LIDAR = LidarConfig(beams=539, max_range_m=12.0)
ROBOT = RobotKnowledge(
    Footprint.disc(0.3), DifferentialDriveConfig(), {"lidar": LIDAR}, 0.1, RandomStreams(0, "robot")
)
WALLS = np.array([[8.0, -6.0, 8.0, 6.0], [-6.0, 6.0, 8.0, 6.0], [-6.0, -6.0, 8.0, -6.0]])
CHART = WorldMap("room", (-6.0, -6.0, 8.0, 6.0), SegmentMap(WALLS, np.zeros((0, 3)), (-6.0, -6.0, 8.0, 6.0)))
BELIEF = Belief(Pose2(0.0, 0.0, 0.0), 1e-6 * np.eye(3))
NOTHING = np.zeros((0, 3))
POST = [3.0, -1.5, 0.15]


def _watch(bodies: MovingBodies, walker: tuple[float, float], velocity: tuple[float, float]) -> FloatArray:
    """Two seconds of somebody who walks to a place beside a post; the last scan as a mapper gets it."""
    angles = LIDAR.beam_angles_rad()
    seen = Readings(0.0)
    for t in np.arange(-1.9, 0.05, 0.1):
        place = [walker[0] + t * velocity[0], walker[1] + t * velocity[1], 0.25]
        circles = np.array([POST, place])
        ranges = fan_ranges(0.0, 0.0, float(angles[0]), LIDAR.beam_step_rad, 539, 12.0, WALLS, circles)
        seen = bodies.step(Readings(2.0 + t, {"lidar": LidarScan(ranges)}), BELIEF)
    scan = seen.by_sensor["lidar"]
    assert isinstance(scan, LidarScan)
    return scan.ranges_m


def test_a_mapper_is_shown_what_stands_and_not_who_walks() -> None:
    bodies = MovingBodies(MovingBodiesConfig(), ROBOT, CHART)
    ranges = _watch(bodies, (2.5, 1.0), (-1.0, 0.0))
    angles = LIDAR.beam_angles_rad()
    to_post, to_walker = math.atan2(POST[1], POST[0]), math.atan2(1.0, 2.5)
    assert abs(ranges[np.argmin(np.abs(angles - to_post))] - (math.hypot(*POST[:2]) - 0.15)) < 0.01
    assert np.isnan(ranges[np.argmin(np.abs(angles - to_walker))])
    assert bodies.about
    assert bodies.discs_m().shape == (1, 3)
    assert np.hypot(*(bodies.discs_m()[0, :2] - (2.5, 1.0))) < 0.15


@pytest.mark.parametrize("seed", [0, 7, 12, 14])
def test_nobody_walks_where_the_end_of_the_view_glides_along_a_wall(seed: int) -> None:
    """A robot drives away from an unknown wall, of which its last beams show more or less as it sways."""
    rng = np.random.default_rng(seed)
    walls = np.vstack([WALLS, [-8.2, 2.85, -1.5, 2.85]])
    bodies = MovingBodies(MovingBodiesConfig(), ROBOT, CHART)
    first = float(LIDAR.beam_angles_rad()[0])
    x, y = 0.0, 0.6
    for k in range(30):
        theta = -1.35 + 0.1 * math.sin(0.5 * k + seed) + 0.03 * float(rng.standard_normal())
        x, y = x + 0.1 * math.cos(theta), y + 0.1 * math.sin(theta)
        ranges = fan_ranges(x, y, theta + first, LIDAR.beam_step_rad, 539, 12.0, walls, NOTHING)
        ranges = np.where(ranges < 12.0, ranges + 0.003 * rng.standard_normal(539), ranges)
        belief = Belief(Pose2(x, y, theta), 1e-6 * np.eye(3))
        bodies.step(Readings(0.1 * k, {"lidar": LidarScan(ranges)}), belief)
        assert not bodies.about, f"step {k}"


def _looks(bodies: MovingBodies, t_s: float, circles: list[list[float]]) -> bool:
    """One scan from the origin; whether somebody is taken to walk about since."""
    first = float(LIDAR.beam_angles_rad()[0])
    discs = np.array(circles) if circles else NOTHING
    ranges = fan_ranges(0.0, 0.0, first, LIDAR.beam_step_rad, 539, 12.0, WALLS, discs)
    bodies.step(Readings(t_s, {"lidar": LidarScan(ranges)}), BELIEF)
    return bodies.about


@pytest.mark.parametrize("seconds", [0.3, 0.5, 0.8])
def test_what_is_seen_no_more_does_not_walk_on(seconds: float) -> None:
    """The visible end of a thing grows sideways and is hidden then: its drift alone makes no walker of it."""
    bodies = MovingBodies(MovingBodiesConfig(), ROBOT, CHART)
    for k in range(round(10 * seconds)):
        assert not _looks(bodies, 0.1 * k, [[3.0, 0.07 * k, 0.25]])
    for k in range(round(10 * seconds), 30):
        assert not _looks(bodies, 0.1 * k, []), f"step {k}"


@pytest.mark.parametrize("away_m", [1.0, 1.5, 2.0])
def test_what_appears_far_from_what_went_out_of_sight_has_not_walked_there(away_m: float) -> None:
    bodies = MovingBodies(MovingBodiesConfig(), ROBOT, CHART)
    for k in range(4):
        assert not _looks(bodies, 0.1 * k, [[3.0, 0.0, 0.25]])
    for k in range(4, 11):
        assert not _looks(bodies, 0.1 * k, [])
    for k in range(11, 40):
        assert not _looks(bodies, 0.1 * k, [[3.0, away_m, 0.25]]), f"step {k}"


@pytest.mark.parametrize("walks", [False, True])
@pytest.mark.parametrize("seed", range(6, 11))
def test_a_laser_that_is_wrong_now_and_then_shows_nobody_and_hides_nobody(seed: int, walks: bool) -> None:
    """A twentieth of the beams ends up to 3 m off, many of them near the robot and near each other."""
    rng = np.random.default_rng(seed)
    hall = np.array([[-6.0, 1.6, 8.0, 1.6], [-6.0, -1.6, 8.0, -1.6], [8.0, -1.6, 8.0, 1.6]])
    walls = SegmentMap(hall, np.zeros((0, 3)), (-6.0, -6.0, 8.0, 6.0))
    bodies = MovingBodies(MovingBodiesConfig(), ROBOT, WorldMap("hall", walls.bounds_m, walls))
    first = float(LIDAR.beam_angles_rad()[0])
    for k in range(200):
        x = 0.02 * k
        circles = np.array([[x + 2.0, -1.0 + 0.1 * min(k, 20), 0.25]]) if walks else NOTHING
        ranges = fan_ranges(x, 0.0, first, LIDAR.beam_step_rad, 539, 12.0, hall, circles)
        wrong = rng.random(539) < 0.05
        ranges = np.clip(np.where(wrong, ranges + rng.uniform(-3.0, 3.0, 539), ranges), 0.0, 12.0)
        belief = Belief(Pose2(x, 0.0, 0.0), 1e-6 * np.eye(3))
        bodies.step(Readings(0.1 * k, {"lidar": LidarScan(ranges)}), belief)
        if not walks:
            assert not bodies.about, f"step {k}"
        elif k == 20:
            assert bodies.about
            assert (np.hypot(*(bodies.discs_m()[:, :2] - circles[0, :2]).T) < 0.3).any()


def test_who_is_hidden_for_a_moment_has_walked_all_the_same() -> None:
    bodies = MovingBodies(MovingBodiesConfig(), ROBOT, CHART)
    seen = [
        _looks(bodies, 0.1 * k, [] if k in (5, 6, 7) else [[3.0, -1.0 + 0.12 * k, 0.25]]) for k in range(16)
    ]
    assert not seen[5]
    assert seen[-1]


def test_it_gives_way_ahead_and_may_drive_away_and_never_backs_blindly() -> None:
    bodies = MovingBodies(MovingBodiesConfig(), ROBOT, CHART)
    gives_way = GiveWay(GiveWayConfig(), ROBOT, bodies)
    here = Pose2(0.0, 0.0, 0.0)
    _watch(bodies, (0.9, 0.0), (-1.0, 0.0))
    assert not gives_way.allows(Twist(0.5, 0.0), here, NOTHING)
    assert gives_way.allows(Twist(0.0, 1.0), here, NOTHING)
    # Behind it the laser does not look, and somebody walks about.
    assert not gives_way.allows(Twist(-0.3, 0.0), here, NOTHING)
    assert gives_way.allows(Twist(0.5, 0.0), Pose2(0.0, 0.0, math.pi), NOTHING)
    far = MovingBodies(MovingBodiesConfig(), ROBOT, CHART)
    _watch(far, (4.0, 0.0), (-1.0, 0.0))
    assert GiveWay(GiveWayConfig(), ROBOT, far).allows(Twist(0.5, 0.0), here, NOTHING)


def test_who_has_mates_backs_where_it_looks_alone() -> None:
    here, back = Pose2(0.0, 0.0, 0.0), Twist(-0.3, 0.0)

    def allows(lidar: LidarConfig | None, mates: int) -> bool:
        robot = replace(ROBOT, sensors={} if lidar is None else {"lidar": lidar})
        bodies = MovingBodies(MovingBodiesConfig(), robot, CHART, mates=mates)
        return GiveWay(GiveWayConfig(), robot, bodies).allows(back, here, NOTHING)

    assert allows(LIDAR, 0)
    assert not allows(LIDAR, 1)
    assert allows(LidarConfig(field_of_view_rad=2.0 * math.pi), 1)
    # Who minds nobody anywhere backs as well.
    assert allows(None, 1)


def test_nobody_backs_into_the_mate_that_followed_it() -> None:
    """Three in a corridor to one place: the first stands there, the second cannot get past it."""
    mission = read_mission("museum-1") | {
        "robots": [{"name": f"r{k}", "start": {"x_m": 10.0 - 3.0 * k, "y_m": 0.8}} for k in range(3)]
    }
    walls = [[0.0, 0.0, 14.0, 0.0], [14.0, 0.0, 14.0, 1.6], [14.0, 1.6, 0.0, 1.6], [0.0, 1.6, 0.0, 0.0]]
    settings: dict[str, Any] = {
        "world.map": {"map": "corridor", "walls_m": walls},
        "world.start": None,
        "world.goal": {"x_m": 12.5, "y_m": 0.8},
        "world.obstacles": [],
        "stack.localizer": {"name": "ekf-walls"},
        "run.time_limit_s": 60.0,
    }
    robots = simulate(mission_of(mission, (), 1, settings)).finished.robots
    assert not any(robot.collisions for robot in robots)
    assert min(float(robot.trace["v_cmd_m_s"].min()) for robot in robots) >= 0.0


def test_driving_past_is_no_driving_away() -> None:
    def closes(bearing_rad: float, gap_m: float = 0.05) -> bool:
        away = 0.3 + 0.25 + gap_m
        discs = np.array([[[away * math.cos(bearing_rad), away * math.sin(bearing_rad), 0.25]]] * 4)
        disc = Footprint.disc(0.3).outline
        return bool(drive_closes_in((0.0, 0.0, 0.0), 0.5, 0.0, 0.1, 2.0, 0.05, disc, discs, 0.1))

    assert closes(0.0)
    assert closes(0.5 * math.pi)
    assert not closes(0.75 * math.pi)
    assert not closes(0.0, gap_m=0.5)


@pytest.mark.parametrize(
    ("at", "command", "closes"),
    [
        ((0.0, 0.42), (0.3, 0.0), False),  # along a side it slides, whose distance does not change
        ((0.0, 0.42), (-0.3, 0.0), False),
        ((0.0, 0.42), (0.0, 0.5), True),  # and no corner swings into who is beside it
        ((0.0, 0.42), (0.0, -0.5), True),
        ((0.35, 0.42), (0.3, 0.0), True),  # ahead of the side he is run into
        ((0.35, 0.42), (0.0, 0.5), True),
        ((0.35, 0.42), (0.0, -0.5), False),  # the side turns away from who is beside its end
        ((0.5, 0.0), (0.0, 0.5), True),
        ((0.5, 0.0), (-0.3, 0.0), False),
        ((0.2, 0.65), (0.3, 0.5), False),  # beyond the margin
    ],
)
def test_corners_slide_along_somebody_and_turn_away_from_him(
    at: tuple[float, float], command: tuple[float, float], closes: bool
) -> None:
    corners = np.array([[0.25, 0.16], [-0.25, 0.16], [-0.25, -0.16], [0.25, -0.16]])
    discs = np.array([[[*at, 0.25]]] * 4)
    found = drive_closes_in((0.0, 0.0, 0.0), *command, 0.2, 2.0, 0.05, (corners, 0.297, 0.16), discs, 0.1)
    assert found == closes


HALL: dict[str, Any] = {
    "world.map": {
        "map": "hall",
        "bounds_m": [-0.5, -0.5, 10.5, 8.5],
        "walls_m": [[0, 0, 10, 0], [10, 0, 10, 8], [10, 8, 0, 8], [0, 8, 0, 0]],
        "landmarks": [
            {"id": k, "x_m": x, "y_m": y} for k, (x, y) in enumerate([(0, 0), (10, 0), (10, 8), (0, 8)])
        ],
    },
    "world.start": {"x_m": 1.0, "y_m": 4.0, "theta_rad": 0.0},
    "world.goal": {"x_m": 9.0, "y_m": 4.0},
    "world.obstacles": [],
    "world.people": [{"name": "social-force", "count": 8, "doors_m": [[5, 1], [5, 7], [3, 1], [7, 7]]}],
    "run.time_limit_s": 150.0,
}


@pytest.mark.parametrize(
    ("base", "controller"),
    [
        ("museum-1", None),
        ("museum-1-fast", "gap-horizon"),
        ("museum-1-fast", "dwa"),
        ("museum-1-fast", "pure-pursuit"),
    ],
)
def test_it_comes_through_people_and_drives_into_nobody(base: str, controller: str | None) -> None:
    settings = HALL | ({"stack.local_controller": {"name": controller}} if controller else {})
    metrics: dict[str, Any] = dict(
        run_mission(mission_of(read_mission(base), (), 1, settings), save=False).metrics
    )
    assert metrics["success"], metrics["reason"]
    assert metrics["people_collisions"] == 0
    assert metrics["people_closest_m"] < 1.0, "nobody came near it: the test shows nothing"


def test_a_robot_in_a_door_makes_room_for_who_presses_and_stays_out_in_the_open() -> None:
    """A gap of 1.2 m in a wall, the robot in it, somebody before it: out on its own side."""
    ends = np.array([[0.0, -6.0, 0.0, -0.6], [0.0, 0.6, 0.0, 6.0]])
    chart = WorldMap(
        "door",
        (-6.0, -6.0, 8.0, 6.0),
        SegmentMap(np.vstack([WALLS, ends]), np.zeros((0, 3)), (-6.0, -6.0, 8.0, 6.0)),
    )
    bodies = MovingBodies(MovingBodiesConfig(), ROBOT, chart)
    _watch(bodies, (0.7, 0.0), (-1.0, 0.0))
    makes_room = MakeRoom(MakeRoomConfig(), ROBOT, chart.field, bodies)
    assert not makes_room.helps(Pose2(4.0, 0.0, 0.0), NOTHING)
    pose = Pose2(0.0, 0.0, 0.0)
    assert makes_room.helps(pose, NOTHING)
    makes_room.begin(0.0)
    for k in range(150):
        command = makes_room.step(0.1 * k, pose, NOTHING)
        if command is None:
            break
        pose = Pose2(
            *exact_arc(pose.x_m, pose.y_m, pose.theta_rad, 0.1 * command.v_m_s, 0.1 * command.w_rad_s)
        )
        gap_m = chart.field.at(np.array([[pose.x_m, pose.y_m]]))[0]
        assert gap_m > ROBOT.radius_m
    assert pose.x_m < -0.6
    assert gap_m > 0.85


@pytest.mark.parametrize("beside_m", [0.42, 0.7])
def test_who_has_corners_makes_room_only_where_they_touch_nothing_as_it_turns(beside_m: float) -> None:
    """A forklift that was shut in among mates turned on the spot, and its corner into the nearest one."""
    corners = np.array([[0.45, 0.3], [-0.45, 0.3], [-0.45, -0.3], [0.45, -0.3]])
    robot = replace(ROBOT, footprint=Footprint.polygon(corners))
    bodies = MovingBodies(MovingBodiesConfig(), robot, CHART)
    _watch(bodies, (2.0, 0.0), (-0.5, 0.0))
    makes_room = MakeRoom(MakeRoomConfig(), robot, CHART.field, bodies)
    makes_room.begin(0.0)
    command = makes_room.step(0.0, Pose2(0.0, 0.0, 0.0), np.array([[0.0, beside_m, 0.03]]))
    assert command is not None
    assert (command.w_rad_s == 0.0) == (beside_m < 0.5)


@pytest.mark.parametrize("beside", [(-0.3, 0.46, 0.25), (0.1, 0.465, 0.25), (0.45, -0.28, 0.2)])
def test_who_has_corners_gets_away_from_who_presses_against_its_side(
    beside: tuple[float, float, float],
) -> None:
    """Somebody mapped beside it left it neither a plan nor a turn, and it stood until time was up."""
    corners = np.array([[0.255, 0.215], [-0.255, 0.215], [-0.255, -0.215], [0.255, -0.215]])
    robot = replace(ROBOT, footprint=Footprint.polygon(corners))
    bodies = MovingBodies(MovingBodiesConfig(), robot, CHART)
    makes_room = MakeRoom(MakeRoomConfig(), robot, CHART.field, bodies)
    makes_room.begin(0.0)
    pose, somebody = Pose2(0.0, 0.0, 0.0), np.array([beside])
    assert not makes_room.may_turn(pose, somebody)
    for k in range(60):
        command = makes_room.step(0.1 * k, pose, somebody)
        if command is None or makes_room.may_turn(pose, somebody):
            break
        pose = pose.compose(Pose2(0.1 * command.v_m_s, 0.0, 0.1 * command.w_rad_s))
        gap_m = discs_clearance(pose.x_m, pose.y_m, pose.theta_rad, robot.footprint.points_m, somebody)
        assert gap_m > -1e-3
    assert makes_room.may_turn(pose, somebody)


@pytest.mark.parametrize(("y_m", "turns"), [(5.6, True), (5.66, False)])
def test_who_has_corners_waits_without_turning_them_into_a_wall(y_m: float, turns: bool) -> None:
    """Squeezed up to a wall's end, it turned to look around while it waited, and its corner met the wall."""
    corners = np.array([[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]])
    robot = replace(ROBOT, footprint=Footprint.polygon(corners))
    bodies = MovingBodies(MovingBodiesConfig(), robot, CHART)
    makes_room = MakeRoom(MakeRoomConfig(), robot, CHART.field, bodies)
    place = Pose2(0.0, y_m, 0.0)
    context: Any = SimpleNamespace(
        map_what_is_new=lambda *_: None,
        t_s=0.0,
        mode=None,
        turn_rate_rad_s=0.8,
        may_turn=lambda pose: makes_room.may_turn(pose, NOTHING),
        waits=lambda *_: False,
        meets_walls=lambda *_: False,
    )
    belief = Belief(place, np.eye(3))
    move = Waiting(context, context, 1.0).step(Readings(0.0), belief)
    assert (move.command != STOP) == turns


def test_what_has_stood_for_long_is_a_thing_until_it_moves() -> None:
    config = MoversConfig(enabled=True, stands_readings=20)
    movers = Movers(config)
    pose = np.zeros(3)

    def seen(x: float) -> FloatArray:
        y = np.linspace(-0.1, 0.1, 7)
        return np.column_stack([np.full(7, x), y])

    for _ in range(25):
        on_track, still = movers.update((0.0, 0.0), seen(2.0), pose, 0.1, (-2.0, 2.0))
    assert not on_track.any()
    assert still.all()
    assert movers.foretold(0.1, 0.1, 3).shape[1] == 0
    assert math.isinf(movers.nearest_m(0.0, 0.0))
    for k in range(8):
        on_track, still = movers.update((0.0, 0.0), seen(2.0 - 0.1 * k), pose, 0.1, (-2.0, 2.0))
    assert on_track.all()
    assert not still.any()
    assert movers.foretold(0.1, 0.1, 3).shape[1] == 1


def test_corners_are_not_swung_back_where_somebody_may_have_come() -> None:
    """Somebody followed a rectangle out of its laser's sight, and its rear corner was turned into him."""
    corners = np.array([[0.25, 0.2], [-0.25, 0.2], [-0.25, -0.2], [0.25, -0.2]])
    here, turn, arc = Pose2(0.0, 0.0, 0.0), Twist(0.0, 0.5), Twist(0.3, 0.5)

    def allowed(robot: RobotKnowledge, walker: tuple[float, float]) -> tuple[bool, bool]:
        bodies = MovingBodies(MovingBodiesConfig(), robot, CHART)
        _watch(bodies, walker, (-1.0, 0.0))
        gives_way = GiveWay(GiveWayConfig(), robot, bodies)
        return gives_way.allows(turn, here, NOTHING), gives_way.allows(arc, here, NOTHING)

    far = (4.0, 2.0)
    sees_all = LidarConfig(beams=539, max_range_m=12.0, field_of_view_rad=2.0 * math.pi)
    rectangle = replace(ROBOT, footprint=Footprint.polygon(corners))
    assert allowed(rectangle, far) == (False, True)
    assert allowed(ROBOT, far) == (True, True)
    assert GiveWay(GiveWayConfig(), rectangle, MovingBodies(MovingBodiesConfig(), rectangle, CHART)).allows(
        turn, here, NOTHING
    )
    assert not MovingBodies(
        MovingBodiesConfig(), replace(rectangle, sensors={"lidar": sees_all}), CHART
    ).may_have_come_to(math.pi)


def test_nobody_backs_before_it_has_looked_around() -> None:
    """A crowd that had come to a stand was backed into half a minute later."""
    bodies = MovingBodies(MovingBodiesConfig(), ROBOT, CHART)
    _watch(bodies, (4.0, 2.0), (-1.0, 0.0))
    first = float(LIDAR.beam_angles_rad()[0])

    def backs_at(t_s: float, theta_rad: float) -> bool:
        ranges = fan_ranges(0.0, 0.0, theta_rad + first, LIDAR.beam_step_rad, 539, 12.0, WALLS, NOTHING)
        belief = Belief(Pose2(0.0, 0.0, theta_rad), 1e-6 * np.eye(3))
        bodies.step(Readings(t_s, {"lidar": LidarScan(ranges)}), belief)
        return not bodies.may_be_at(math.pi)

    assert not backs_at(5.0, 0.0)
    assert not backs_at(40.0, 0.0)
    assert backs_at(40.1, 1.0)
