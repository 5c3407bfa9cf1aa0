"""Live topics of real ROS 2: another process drives our robot, and our stack drives another's."""

from __future__ import annotations

import importlib.util
import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import pilotage as pl
from pilotage.bridges.ros import messages as ros
from pilotage.bridges.ros.driving import LiveReadings, _increment, _ranges
from pilotage.bridges.ros.serving import moved
from pilotage.cli.main import main
from pilotage.core.angles import wrap_to_pi
from pilotage.sensors.lidar import LidarConfig
from pilotage.sensors.readings import OdometryIncrement

STRANGER = Path(__file__).parents[1] / "support" / "ros" / "route_driver.py"
LISTENER = STRANGER.with_name("transform_listener.py")
RUN = "import sys; from pilotage.cli.main import main; sys.exit(main(sys.argv[1:]))"
EXACT = [f"robot.sensors.odometry.{key}=0" for key in ("distance_var_m2_per_m", "angle_var_rad2_per_rad")]
WALL_S = float(os.environ.get("PILOTAGE_ROS_SECONDS", "12"))
"""Of each drive; 60 is what is promised, and takes as long."""


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> str:
    """A domain of its own, so that two test runs do not hear each other."""
    pytest.importorskip("rclpy", reason="needs the extra 'ros2'")
    number = str(1 + os.getpid() % 100)
    monkeypatch.setenv("ROS_DOMAIN_ID", number)
    monkeypatch.setenv("ROS_LOCALHOST_ONLY", "1")
    return number


def process(*words: str) -> subprocess.Popen[str]:
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def answer(running: subprocess.Popen[str], code: int = 0) -> dict[str, object]:
    out, err = running.communicate(timeout=20.0 * WALL_S + 200.0)
    assert running.returncode == code, err
    told = json.loads(out.splitlines()[-1])
    assert isinstance(told, dict)
    return told


@pytest.mark.slow
@pytest.mark.usefixtures("domain")
@pytest.mark.parametrize("speed", [1.0, 5.0])
def test_another_process_drives_the_museum_route(speed: float) -> None:
    mission = pl.load("museum-route")
    start = mission.world.start
    assert start is not None
    points = mission.stack.planner.model_dump()["points_m"]  # type: ignore[union-attr]
    frame = [start.x_m, start.y_m, start.theta_rad]
    stranger = process(sys.executable, str(STRANGER), json.dumps(points), json.dumps(frame))
    by_dds = (
        importlib.util.find_spec("tf2_msgs") is None and importlib.util.find_spec("cyclonedds") is not None
    )
    listener = process(sys.executable, str(LISTENER)) if by_dds else None
    for waits in (stranger, listener):
        assert waits is None or (waits.stdout is not None and waits.stdout.readline() == "listens\n")
    words = ("serve", "museum-route", "--speed", str(speed), "--duration", str(speed * WALL_S), "--json")
    served = process(sys.executable, "-c", RUN, *words, *(w for key in EXACT for w in ("--set", key)))
    ours, theirs = answer(served), answer(stranger)
    topics = theirs["topics"]
    assert isinstance(topics, dict)
    for topic in ("/odom", "/scan", "/clock"):
        count, first, last = topics[topic]
        # From the first that was heard on, not one is missing; the very first ones pass before both have met.
        assert last == pytest.approx(speed * WALL_S)
        assert count == round((last - first) / 0.1) + 1
    assert ours["received"] == {"/cmd_vel": theirs["sent"]}
    assert ours["collisions"] == 0
    silent, sent = ours["silent"], ours["sent"]
    assert isinstance(silent, dict)
    assert isinstance(sent, dict)
    assert {*silent, *sent} == {"/clock", "/odom", "/scan", "/tf"}, "each is spoken, or named as silent"
    assert set(silent) <= {"/tf"}
    if listener is not None:
        assert not silent
        tf, seen = answer(listener), theirs["seen"]
        assert isinstance(seen, dict)
        assert seen["/tf"] == ["tf2_msgs/msg/TFMessage"]
        first, last = tf["times"]  # type: ignore[misc]
        assert last == pytest.approx(speed * WALL_S)
        assert tf["count"] == round((last - first) / 0.1) + 1
        assert tf["frames"] == [["odom", "base_link"], ["base_link", "laser"]]
    passed = theirs["passed"]
    assert isinstance(passed, int)
    assert passed >= min(len(points), 1 + speed * WALL_S // 45)


@pytest.mark.slow
@pytest.mark.usefixtures("domain")
def test_our_stack_drives_over_topics() -> None:
    """The walls' filter and its planner in one process, the world in another: as good as in one."""
    drives = process(
        sys.executable, "-c", RUN, "drive", "museum-walls", "--ros2", "--duration", "20", "--json"
    )
    time.sleep(6.0)
    served = process(
        sys.executable, "-c", RUN, "serve", "museum-walls", "--speed", "2", "--duration", "26", "--json"
    )
    ours, theirs = answer(drives, 1), answer(served)
    assert "time limit of 20 s" in str(ours["reason"])
    assert theirs["collisions"] == 0
    believed, end = ours["believed"], theirs["end"]
    assert isinstance(believed, dict)
    assert isinstance(end, dict)
    # It rolls on until the last command is heard, or is too old.
    assert math.hypot(believed["x_m"] - end["x_m"], believed["y_m"] - end["y_m"]) < 0.4
    assert math.hypot(end["x_m"] - 1.0, end["y_m"] - 1.0) > 3.0


def test_increments_survive_the_way_through_poses() -> None:
    rng = np.random.default_rng(0)
    for values in rng.uniform(-0.3, 0.3, (50, 3)):
        ahead_m, turn_rad, left_m = values.tolist()
        increment = OdometryIncrement(ahead_m, turn_rad, left_m)
        before = pl.Pose2(*map(float, rng.uniform(-2.0, 2.0, 3)))
        back = _increment(before, before.compose(moved(increment)))
        assert (back.distance_m, back.angle_rad, back.lateral_m) == pytest.approx(tuple(values))


def _scan(
    first_rad: float,
    step_rad: float,
    ranges: list[float],
    range_min: float = 0.1,
    range_max: float = 8.0,
    t_s: int = 0,
) -> SimpleNamespace:
    rest = {"range_min": range_min, "range_max": range_max, "header": _header(t_s)}
    return SimpleNamespace(angle_min=first_rad, angle_increment=step_rad, ranges=ranges, **rest)


def test_scans_of_other_beams_are_taken_by_the_nearest() -> None:
    ranges = [float(k) for k in range(1, 202)]
    message = _scan(-1.0, 0.01, ranges, range_max=300.0)

    sheet = LidarConfig(beams=21, field_of_view_rad=2.0, max_range_m=150.0)
    assert _ranges(message, sheet).tolist() == [min(1.0 + 10.0 * k, 150.0) for k in range(21)]
    wide = LidarConfig(beams=3, field_of_view_rad=4.0, max_range_m=150.0)
    assert _ranges(message, wide).tolist() == pytest.approx([math.nan, 101.0, math.nan], nan_ok=True)


@pytest.mark.parametrize(("first_rad", "step_deg"), [(0.0, 1.0), (2.0 * math.pi, -1.0), (-math.pi, 1.0)])
def test_a_scanner_that_looks_all_around_may_begin_anywhere(first_rad: float, step_deg: float) -> None:
    """Of one that counts from 0 to 2 pi half the beams read as far as the data sheet says: nothing there."""

    step_rad = math.radians(step_deg)
    ranges = [1.0 + abs(wrap_to_pi(first_rad + step_rad * k)) for k in range(360)]
    message = _scan(first_rad, step_rad, ranges)
    sheet = LidarConfig(beams=72, field_of_view_rad=2.0 * math.pi)
    assert _ranges(message, sheet) == pytest.approx(1.0 + np.abs(sheet.beam_angles_rad()))


def test_what_a_driver_says_of_beams_without_a_range_is_understood() -> None:
    """A wall too near to be measured read as nothing there, and what was not measured at all, too."""
    sheet = LidarConfig(beams=7, field_of_view_rad=0.6, max_range_m=5.0)
    message = _scan(-0.3, 0.1, [-math.inf, 0.0, 0.05, 3.0, 9.0, math.inf, math.nan])
    read = [0.1, math.nan, 0.1, 3.0, 5.0, 5.0, math.nan]
    assert _ranges(message, sheet).tolist() == pytest.approx(read, nan_ok=True)
    far = sheet.model_copy(update={"max_range_m": 20.0})  # that nothing is there the scanner says up to 8 m
    assert _ranges(message, far).tolist() == pytest.approx([*read[:4], *[math.nan] * 3], nan_ok=True)
    unset = _scan(-0.3, 0.1, [3.0] * 7, range_max=0.0)
    assert _ranges(unset, sheet).tolist() == [3.0] * 7


def _header(t_s: int) -> SimpleNamespace:
    return SimpleNamespace(stamp=SimpleNamespace(sec=t_s, nanosec=0))


def _odometry(t_s: int, x_m: float, w: float = 1.0, z: float = 0.0) -> SimpleNamespace:
    pose = SimpleNamespace(
        position=SimpleNamespace(x=x_m, y=0.0), orientation=SimpleNamespace(x=0.0, y=0.0, z=z, w=w)
    )
    return SimpleNamespace(header=_header(t_s), pose=SimpleNamespace(pose=pose))


def test_messages_that_say_nothing_are_counted_and_not_driven_by() -> None:
    """One NaN of /odom made the belief NaN for good, and the robot drove by it; 1e308 was a traceback."""
    nan, hear = math.nan, dict[str, Callable[[Any], None]]()
    node: Any = SimpleNamespace(
        spin_until=lambda _: None, listens=lambda topic, _, heard: hear.update({topic: heard})
    )
    source = LiveReadings(node, ("lidar", LidarConfig(beams=3)), "odometry", 0.5)
    hear["/odom"](_odometry(1, 0.0))
    for wrong in (_odometry(2, nan), _odometry(2, 1e308), _odometry(2, 1.0, w=0.0), _odometry(2, 1.0, z=nan)):
        hear["/odom"](wrong)
    hear["/odom"](_odometry(1, 5.0))  # not later
    for first_rad, step_rad in ((nan, 0.1), (0.0, nan), (0.0, 0.0), (1e30, 0.1), (0.0, 1e30)):
        hear["/scan"](_scan(first_rad, step_rad, [1.0] * 3))
    assert source.refused == {"/odom": 5, "/scan": 5}


def test_one_scan_with_a_time_far_ahead_hides_no_later_one() -> None:
    """The robot drove on blind for good, and nothing told of it; a scan said twice is one."""
    hear = dict[str, Callable[[Any], None]]()
    times = iter((0, 1, 2, 2**31 - 1, 4, 5))

    def spin(_: float) -> None:
        said.append(len(said))
        hear["/scan"](_scan(-1.0, 1.0, [1.0, 2.0, 3.0], t_s=next(times)))
        hear["/odom"](_odometry(said[-1], 0.1))

    said: list[int] = []
    node: Any = SimpleNamespace(spin_until=spin, listens=lambda topic, _, heard: hear.update({topic: heard}))
    source = LiveReadings(node, ("lidar", LidarConfig(beams=3)), "odometry", 1.0)
    steps = [source.next() for _ in range(5)]
    assert all(step is not None and "lidar" in step.by_sensor for step in steps)
    hear["/scan"](_scan(-1.0, 1.0, [1.0, 2.0, 3.0], t_s=5))
    assert source.refused == {"/odom": 0, "/scan": 1}


@pytest.mark.parametrize("step_rad", [0.0, 1e-30, 1.0])
def test_a_scan_of_one_beam_has_no_step(step_rad: float) -> None:
    """A tiny one was divided by, and gave a warning for a direction."""
    sheet = LidarConfig(beams=3, field_of_view_rad=2.0)
    assert sheet.along_own_beams(np.array([1.5]), 0.0, step_rad).tolist() == pytest.approx(
        [math.nan, 1.5, math.nan], nan_ok=True
    )


def test_times_are_whole_nanoseconds() -> None:
    assert ros.stamp(1.1 * 3) == {"sec": 3, "nanosec": 300_000_000}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["drive", "museum-walls"], "expected --ros2"),
        (["serve", "museum-route", "--duration", "-1"], "--duration: expected seconds above 0"),
        (["serve", "museum-route", "--speed", "0"], "--speed: expected a number above 0"),
        (["serve", "musem-route"], "did you mean 'museum-route'"),
    ],
)
def test_what_cannot_be_served_is_one_line(
    words: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 2
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert told in said.err


@pytest.mark.parametrize("words", [["serve", "museum-route"], ["drive", "museum-walls", "--ros2"]])
def test_without_ros_the_remedy_is_said(
    words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "rclpy", None)
    assert main(words) == 2
    said = capsys.readouterr()
    assert said.err.count("\n") == 1
    assert "pip install -e '.[ros2]'" in said.err
