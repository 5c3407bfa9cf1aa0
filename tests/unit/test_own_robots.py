"""A stranger's robots on a stranger's floor: each pairing drives, or is refused with what would."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pilotage as pl

CAR: dict[str, Any] = {
    "footprint": {"points_m": [[0.47, 0.2], [-0.13, 0.2], [-0.13, -0.2], [0.47, -0.2]]},
    "motion": {"name": "bicycle", "wheelbase_m": 0.35, "max_speed_m_s": 0.8, "max_steering_rad": 0.6},
}
DISC: dict[str, Any] = {
    "footprint": {"radius_m": 0.25},
    "motion": {"name": "differential-drive", "max_speed_m_s": 0.8},
}
START, GOAL = {"x_m": 1.2, "y_m": 1.0, "theta_rad": 0.0}, {"x_m": 4.6, "y_m": 3.6, "tolerance_m": 0.4}


@pytest.fixture
def floor(tmp_path: Path) -> Callable[[float], str]:
    """Two rooms of 3 m x 4.5 m and a door in cells of 5 cm."""

    def write(door_m: float) -> str:
        cells = np.full((90, 120), 254, np.uint8)
        cells[:2] = cells[-2:] = 0
        cells[:, :2] = cells[:, -2:] = cells[:, 59:61] = 0
        half = round(door_m / 0.1)
        cells[45 - half : 45 + half, 59:61] = 254
        (tmp_path / "floor.pgm").write_bytes(b"P5 120 90 255\n" + cells.tobytes())
        told = "image: floor.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n"
        (tmp_path / "floor.yaml").write_text(told + "occupied_thresh: 0.65\nfree_thresh: 0.196\n")
        return str(tmp_path / "floor.yaml")

    return write


def drive(
    floor: str,
    robot: dict[str, Any],
    time_limit_s: float = 90.0,
    goal: dict[str, Any] | None = None,
    task: Any = "reach",
    **stack: Any,
) -> pl.Run:
    """Run it on the given map; the pose is known so that driving alone is judged."""
    mission = {
        "mission": "own",
        "world": {"map": floor, "start": START, "goal": GOAL | (goal or {})},
        "robot": robot | {"sensors": {"odometry": {"name": "wheel-odometry"}, "laser": {"name": "lidar"}}},
        "task": task,
        "stack": {"initial": {"x_var_m2": 0.0, "y_var_m2": 0.0, "theta_var_rad2": 0.0}} | stack,
        "run": {"time_limit_s": time_limit_s, "oracles": ["localizer"]},
    }
    return pl.run(mission, save=False, progress=False)


@pytest.mark.parametrize(
    ("robot", "stack"),
    [
        (CAR, {"navigator": "maneuver", "planner": "hybrid-astar"}),
        (CAR, {"navigator": "maneuver", "planner": "rrt-star-reeds-shepp"}),
        (CAR, {"navigator": "maneuver", "planner": "rrt-star-dubins"}),
        (CAR, {"navigator": "maneuver", "planner": "rrt-star-dubins", "smoother": "shortcut"}),
        (CAR, {"navigator": "maneuver", "planner": "theta-star", "smoother": "shortcut"}),
        (DISC, {"navigator": "maneuver", "planner": "hybrid-astar"}),
        (DISC, {"navigator": "maneuver", "planner": "astar"}),
        (DISC, {"navigator": "curve", "planner": "theta-star", "controller": "kanayama"}),
        (
            DISC,
            {
                "navigator": "goal",
                "planner": "rrt-star-dubins",
                "local_planner": "dubins",
                "controller": "kanayama",
            },
        ),
    ],
)
def test_it_drives_through_a_door_of_its_own_floor(
    floor: Callable[[float], str], robot: dict[str, Any], stack: dict[str, Any]
) -> None:
    run = drive(floor(0.9), robot, **stack)
    assert run.success, run.reason
    assert run.metrics["collisions"] == 0


def test_what_a_planner_keeps_beside_the_outline_is_no_disc_s(floor: Callable[[float], str]) -> None:
    """More than the disc inside the outline measures: it was taken for the clearance of the centre."""
    planner = {"name": "hybrid-astar", "clearance_m": 0.3}
    run = drive(floor(0.6), CAR, navigator="maneuver", planner=planner)
    assert run.success, run.reason


def test_a_car_is_taken_for_a_disc_where_the_door_is_wide(floor: Callable[[float], str]) -> None:
    """Neither planner nor local planner is told a turning radius: they take what the motion can."""
    stack: dict[str, Any] = {
        "planner": "theta-star",
        "local_planner": "dubins",
        "controller": "kanayama",
    }
    assert drive(floor(1.5), CAR, navigator="goal", smoother="shortcut", **stack).success
    narrow = drive(floor(0.9), CAR, navigator="goal", smoother="shortcut", **stack)
    assert not narrow.success
    assert "navigator maneuver and planner hybrid-astar" in narrow.reason


@pytest.mark.parametrize(
    ("robot", "stack", "remedy"),
    [
        (
            CAR,
            {"navigator": "maneuver", "planner": "astar"},
            "hybrid-astar.* or take rrt-star-dubins, or",
        ),
        (
            CAR,
            {"navigator": "maneuver", "planner": "astar", "smoother": "none"},
            "hybrid-astar.* or take rrt-star-dubins, or",
        ),
        (
            CAR,
            {"navigator": "maneuver", "planner": "hybrid-astar", "controller": "pi-follower"},
            r"kanayama.*take navigator goal",
        ),
        (DISC, {"navigator": "curve", "planner": "astar", "controller": "pi-follower"}, "kanayama"),
        (
            DISC,
            {
                "navigator": "goal",
                "planner": "hybrid-astar",
                "local_planner": "dubins",
                "controller": "kanayama",
            },
            "take navigator maneuver",
        ),
        (
            DISC,
            {"navigator": "local", "planner": "rrt-star-reeds-shepp", "local_controller": "pure-pursuit"},
            "take navigator maneuver",
        ),
    ],
)
def test_what_cannot_work_is_refused_with_what_would(
    floor: Callable[[float], str], robot: dict[str, Any], stack: dict[str, Any], remedy: str
) -> None:
    with pytest.raises(pl.InputError, match=remedy):
        drive(floor(0.9), robot, **stack)


def test_a_curve_that_no_car_can_drive_fails_before_the_start(floor: Callable[[float], str]) -> None:
    run = drive(floor(1.5), CAR, navigator="curve", planner="astar", controller="kanayama")
    assert not run.success
    assert run.metrics["duration_s"] == 0.0
    assert "take navigator maneuver" in run.reason


def test_a_robot_that_crawls_is_given_time(floor: Callable[[float], str]) -> None:
    """At 2 cm/s it makes 0.4 m in the time in which others are taken to be stuck."""
    slow = DISC | {"motion": {"name": "differential-drive", "max_speed_m_s": 0.02}}
    local = {"name": "dubins", "speed_m_s": 0.02}
    stack: dict[str, Any] = {"planner": "theta-star", "local_planner": local, "controller": "kanayama"}
    run = drive(floor(0.9), slow, 400.0, navigator="goal", **stack)
    assert run.success, run.reason


def test_who_is_left_behind_by_its_curve_does_not_say_that_it_arrived(floor: Callable[[float], str]) -> None:
    lame = DISC | {"true_motion": {"max_speed_m_s": 0.1}}
    run = drive(floor(0.9), lame, navigator="curve", planner="theta-star", controller="kanayama")
    assert not run.success
    assert run.reason.startswith("the reference is at the curve's end, the robot ")


LOCAL: dict[str, Any] = {"navigator": "local", "planner": "theta-star", "local_controller": "pure-pursuit"}
DRIVERS: list[dict[str, Any]] = [
    LOCAL,
    {"navigator": "goal", "planner": "theta-star", "local_planner": "dubins", "controller": "kanayama"},
    {"navigator": "curve", "planner": "theta-star", "controller": "kanayama"},
]


@pytest.mark.parametrize("stack", DRIVERS, ids=lambda stack: stack["navigator"])
@pytest.mark.parametrize("heading_rad", [-2.0, 2.9])
def test_it_turns_to_the_heading_of_its_goal(
    floor: Callable[[float], str], stack: dict[str, Any], heading_rad: float
) -> None:
    """It stopped as it came, and its run failed for that: 'stands 0.01 m from its goal'."""
    goal = {"theta_rad": heading_rad, "tolerance_rad": 0.3}
    run = drive(floor(0.9), DISC, goal=goal, **stack)
    assert run.success, run.reason
    assert abs(run.metrics["goal_error_rad"]) <= 0.3


def test_who_drives_by_the_polar_law_turns_too(floor: Callable[[float], str]) -> None:
    """A metre is too short for the law to come round: it said that it had arrived 70 degrees off."""
    goal = {"x_m": 2.2, "y_m": 1.0, "theta_rad": 1.5, "tolerance_m": 0.2, "tolerance_rad": 0.1}
    run = drive(floor(0.9), DISC, goal=goal, navigator="pose")
    assert run.success, run.reason


def test_who_stands_the_wrong_way_is_told_so(floor: Callable[[float], str]) -> None:
    goal = {"theta_rad": -2.0, "tolerance_rad": 0.1}
    run = drive(floor(1.5), CAR, goal=goal, **DRIVERS[1], smoother="shortcut")
    assert not run.success
    assert run.reason.endswith(" degrees off its goal's heading")


@pytest.mark.parametrize("navigator", ["local", "maneuver", "curve", "pose"])
def test_further_goals_are_refused_by_who_drives_to_one(
    floor: Callable[[float], str], navigator: str
) -> None:
    """They were not visited, and nothing said why."""
    task = {"name": "reach", "goals": [{"x_m": 1.5, "y_m": 3.0}]}
    stack = LOCAL | {"navigator": navigator, "controller": "kanayama"}
    with pytest.raises(pl.InputError, match=f"'{navigator}': expected one goal, found 2.*navigator goal"):
        drive(floor(0.9), DISC, task=task, **stack)


def test_landmarks_inside_walls_are_refused(floor: Callable[[float], str]) -> None:
    """Nobody saw one, and the robot drove into a wall by its wheels alone."""
    world = {"map": floor(0.9), "start": START, "goal": GOAL}
    inside = [{"id": 1, "x_m": 0.025, "y_m": 2.0}, {"id": 2, "x_m": 3.0, "y_m": 0.5}]
    mission = {
        "mission": "hidden",
        "world": world | {"landmarks": inside},
        "robot": DISC | {"sensors": {"odometry": {"name": "wheel-odometry"}, "marks": {"name": "beacons"}}},
        "task": "drive",
        "stack": {"navigator": "open-loop", "localizer": "ekf-landmarks"},
        "run": {"time_limit_s": 1.0},
    }
    with pytest.raises(pl.InputError, match="found all 2 inside walls; put them"):
        pl.run(mission, save=False, progress=False)
    mission["world"] = world | {"landmarks": [*inside, {"id": 3, "x_m": 0.15, "y_m": 2.0}]}
    pl.run(mission, save=False, progress=False)


def test_who_believes_to_begin_inside_a_wall_looks_around_first(floor: Callable[[float], str]) -> None:
    """Of starts that are known to 0.1 m one in four was: it failed before its laser had turned once."""
    laser = {"name": "lidar", "beams": 180, "rate_hz": 2}
    sensors = {"odometry": {"name": "wheel-odometry"}, "laser": laser}
    mission = {
        "mission": "beside",
        "world": {
            "map": floor(0.9),
            "start": {"x_m": 0.38, "y_m": 1.0, "theta_rad": 0.5},
            "goal": {"x_m": 2.2, "y_m": 3.6},
        },
        "robot": DISC | {"sensors": sensors},
        "stack": LOCAL | {"localizer": "particle-filter", "initial": {"x_var_m2": 0.01, "y_var_m2": 0.0}},
        "run": {"time_limit_s": 60.0},
    }
    runs = [pl.run(mission, seed=seed, save=False, progress=False) for seed in range(6)]
    assert all(run.success for run in runs), [run.reason for run in runs]


def test_who_never_finds_itself_says_so(floor: Callable[[float], str]) -> None:
    """Either room may be the other: its plan began wherever the filter's cloud was thickest."""
    mission = {
        "mission": "nowhere",
        "world": {"map": floor(0.9), "start": START, "goal": GOAL},
        "robot": DISC | {"sensors": {"odometry": {"name": "wheel-odometry"}, "laser": {"name": "lidar"}}},
        "stack": LOCAL | {"localizer": "particle-filter", "initial": {"known": False}},
        "run": {"time_limit_s": 60.0},
    }
    run = pl.run(mission, save=False, progress=False)
    assert run.reason.endswith("it never knew where it was")


@pytest.mark.parametrize("controller", ["mppi", "dwa", "gap-horizon"])
def test_weak_brakes_do_not_carry_it_through_its_goal(floor: Callable[[float], str], controller: str) -> None:
    """It said that it had arrived at 1 m/s, and rolled on for 2 m."""
    fast = {"name": "differential-drive", "max_speed_m_s": 1.5, "max_acceleration_m_s2": 0.3}
    goal = {"x_m": 2.2, "y_m": 3.6, "tolerance_m": 0.3}
    run = drive(
        floor(0.9), DISC | {"motion": fast}, goal=goal, navigator="local", local_controller=controller
    )
    assert run.success, run.reason
    names = ("true_x_m", "true_y_m", "true_theta_rad", "v_true_m_s")
    x_m, y_m, theta, v_m_s = (float(run.trace[name][-1]) for name in names)
    rolls_m = v_m_s * abs(v_m_s) / 0.6
    assert np.hypot(x_m + rolls_m * np.cos(theta) - 2.2, y_m + rolls_m * np.sin(theta) - 3.6) < 0.3


def test_a_goal_too_near_a_wall_for_the_disc_says_who_drives_the_outline(
    floor: Callable[[float], str],
) -> None:
    """It told a distance alone: nobody learns from that why a car that fits does not get there."""
    near = {"y_m": 0.5}
    goal_only: dict[str, Any] = {"navigator": "goal", "planner": "rrt-star-dubins", "local_planner": "dubins"}
    run = drive(floor(1.4), CAR, goal=near, controller="kanayama", **goal_only)
    assert not run.success
    assert "goal blocked" in run.reason
    assert "maneuver with hybrid-astar drives its outline" in run.reason
    assert drive(floor(1.4), CAR, goal=near, navigator="maneuver", planner="hybrid-astar").success


def test_a_sensor_that_is_missing_is_called_by_the_name_that_a_mission_has_for_it() -> None:
    """It was called by its class: WheelOdometry."""
    with pytest.raises(pl.InputError, match="expected one wheel-odometry among"):
        pl.run(
            pl.load("museum-walls", set={"robot.sensors.odometry": None, "stack.localizer": "dead-reckoning"})
        )
