"""``localize``, ``calibrate`` and ``evaluate`` on ROS 1 bags, ROS 2 bags and MCAP files."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

import pilotage as pl
from pilotage.bridges.ros import messages as ros
from pilotage.bridges.ros.bag_files import write_mcap, write_ros1, write_ros2
from pilotage.bridges.ros.run_messages import RunMessages, Stamped
from pilotage.cli.app import dispatch
from pilotage.core.errors import InputError
from pilotage.core.types import FloatArray, Pose2
from pilotage.experiments.recordings.bag_drive import _moves, _part_var, _periods_s, _scans, _sheet
from pilotage.experiments.recordings.run_scans import read_run_scans
from pilotage.logs.bag_kinds import LANDMARKS, POSES
from pilotage.logs.bag_series import landmarks_in_base, read_series
from pilotage.logs.laser_log import RawScan, assemble
from pilotage.logs.laser_recordings import read_laser_log
from pilotage.maps.ros_map import RosMap, write_ros_map
from support.command_bags import commanded
from support.landmark_bags import DETECTIONS, MOUNT, PLACES, circle, detected, noisy, steady, write_table

pytest.importorskip("rosbags")

WRITERS: dict[str, Callable[[Path, RunMessages], None]] = {
    "a.bag": write_ros1,
    "folder": write_ros2,
    "a.mcap": write_mcap,
}


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_table(tmp_path_factory.mktemp("table") / "landmarks.csv")


@pytest.fixture(scope="module")
def museum(tmp_path_factory: pytest.TempPathFactory) -> tuple[pl.Run, dict[str, Path]]:
    """A short run, and the same in every form that is written."""
    folder = tmp_path_factory.mktemp("museum")
    mission = pl.load("museum-route", seed=4, set={"run.time_limit_s": 15.0})
    run = pl.run(mission, out=folder)
    return run, {
        "ros1": pl.export(run, "rosbag", folder / "a.bag"),
        "ros2": pl.export(run, "rosbag", folder / "b"),
        "mcap": pl.export(run, "mcap", folder / "c.mcap"),
    }


def test_scans_are_localized_alike_in_every_form(
    museum: tuple[pl.Run, dict[str, Path]], tmp_path: Path
) -> None:
    """The truth is a topic of the bag; without one and with a start given the path is the same."""
    found = {form: pl.localize(path, map="museum", out=tmp_path) for form, path in museum[1].items()}
    for run in found.values():
        assert run.success
        assert run.metrics["position_rmse_m"] < 0.05
        assert run.metrics["position_rmse_m"] == found["ros1"].metrics["position_rmse_m"]
    start = np.array([found["mcap"].trace[f"true_{part}"][0] for part in ("x_m", "y_m", "theta_rad")])
    window = pl.localize(museum[1]["mcap"], map="museum", start=start, to_s=10.0, out=tmp_path)
    assert window.success
    assert 9.0 < window.metrics["duration_s"] <= 10.0
    lines = (window.folder / "trajectory.tum").read_text().splitlines()
    assert len(lines) == len(window.trace["t_s"])


def test_a_recording_of_which_nobody_knows_where_it_begins(
    museum: tuple[pl.Run, dict[str, Path]], tmp_path: Path
) -> None:
    """The filter finds itself in the map; errors, and the path by the recording's clock, begin there."""
    run = pl.localize(museum[1]["mcap"], map="museum", start="unknown", localizer="ekf-walls", out=tmp_path)
    assert run.success
    assert 0.5 < run.metrics["found_after_s"] < 12.0
    assert run.metrics["position_rmse_m"] < 0.05
    assert 0.2 < run.metrics["localized_share"] < 0.99
    lines = (run.folder / "trajectory.tum").read_text().splitlines()
    assert len(lines) == round(run.metrics["localized_share"] * len(run.trace["t_s"]))
    assert run.report().is_file()
    with pytest.raises(InputError, match="start: expected x, y, theta or 'unknown', found 'home'"):
        pl.localize(museum[1]["mcap"], map="museum", start="home", out=tmp_path)  # type: ignore[arg-type]


def test_a_run_folder_holds_the_scans_and_odometry_of_its_bag(
    museum: tuple[pl.Run, dict[str, Path]],
) -> None:
    own, bag = read_run_scans(museum[0].folder), read_laser_log(museum[1]["mcap"])
    assert own.t_s == pytest.approx(bag.t_s, abs=1e-6)
    assert np.array_equal(np.isfinite(own.ranges_m), np.isfinite(bag.ranges_m))
    hit = np.isfinite(own.ranges_m)
    assert own.ranges_m[hit] == pytest.approx(bag.ranges_m[hit], abs=1e-5)
    assert own.angles_rad(0) == pytest.approx(bag.angles_rad(0), abs=1e-5)
    assert own.mount == bag.mount
    theirs, mine = bag.odometry_at_scans(), own.odometry_at_scans()
    assert theirs is not None
    assert mine == pytest.approx(theirs, abs=1e-6)


def test_an_own_grid_and_a_page(museum: tuple[pl.Run, dict[str, Path]], tmp_path: Path) -> None:
    """What the bag's own ``/map`` shows, as a ROS map with a rim that nobody knows."""
    from pilotage.experiments.build.charts import load_chart
    from pilotage.maps.occupancy_grid import OccupancyGrid
    from pilotage.maps.rasterize import rasterized

    cells = rasterized(load_chart("museum").walls, 0.05)
    known = cells.cells.copy()
    known[:40] = -1
    grid = OccupancyGrid(known, cells.resolution_m, cells.origin)
    write_ros_map(tmp_path / "map.yaml", RosMap.of(grid, "map.pgm"))
    run = pl.localize(museum[1]["mcap"], map=tmp_path / "map.yaml", out=tmp_path)
    assert run.metrics["position_rmse_m"] < 0.1
    assert "localize-c-particle-filter" in Path(run.report()).read_text()


@pytest.mark.parametrize("form", list(DETECTIONS))
def test_landmarks_of_every_message(form: str, table: Path, tmp_path: Path) -> None:
    name = list(WRITERS)[list(DETECTIONS).index(form) % 3]
    WRITERS[name](tmp_path / name, circle(form))
    run = pl.localize(tmp_path / name, landmarks=table, out=tmp_path)
    assert run.success
    assert "ekf-landmarks" in run.folder.name
    assert run.metrics["position_rmse_m"] < 0.02
    reckoned = pl.localize(tmp_path / name, landmarks=table, localizer="dead-reckoning", out=tmp_path)
    assert reckoned.metrics["position_rmse_m"] > 0.1


def test_landmarks_of_two_cameras_on_one_topic_are_told_apart(tmp_path: Path) -> None:
    """What the second camera saw was placed as if the first one had seen it."""
    one = circle()
    fields = detected("vision", ros.header(1000.2, "rear"), {1: (3.0, 1.0)})
    other = Stamped("/tags", ros.nanoseconds(1000.2), DETECTIONS["vision"][0], fields)
    write_mcap(tmp_path / "a.mcap", RunMessages([*one.stamped, other], one.own_types))
    found = landmarks_in_base(tmp_path / "a.mcap", None, ("base_link",))
    assert len(found.t_s) == len(PLACES) * 121
    said = (
        "1 of the landmarks in /tags are another sensor's, in the frame 'rear': those in 'camera' are taken"
    )
    assert said in found.warnings


def test_odometry_is_calibrated_as_from_the_run_itself(
    museum: tuple[pl.Run, dict[str, Path]], tmp_path: Path
) -> None:
    run, bags = museum
    whole = pl.calibrate("odometry", run.folder, out=tmp_path)
    for place, truth in (
        (bags["ros1"], None),
        (bags["ros2"], "/truth"),
        (bags["mcap"], "/tf:map:base_link_truth"),
    ):
        found = pl.calibrate("odometry", place, truth=truth, out=tmp_path)
        for key in ("distance_scale", "angle_scale"):
            assert found[key]["value"] == pytest.approx(whole[key]["value"], rel=1e-3)
    # By a path of its own, as SLAM leaves one: here the truth, with the bag's clock.
    rows = museum[0].trace
    lines = [
        f"{t} {x} {y} 0 0 0 {math.sin(th / 2)} {math.cos(th / 2)}\n"
        for t, x, y, th in zip(
            *(rows[n] for n in ("t_s", "true_x_m", "true_y_m", "true_theta_rad")), strict=True
        )
    ]
    (tmp_path / "own.tum").write_text("".join(lines))
    found = pl.calibrate("odometry", bags["ros1"], truth=tmp_path / "own.tum", out=tmp_path)
    assert found["distance_scale"]["value"] == pytest.approx(whole["distance_scale"]["value"], rel=1e-3)


def test_which_part_of_a_slow_increment_is_whose_is_unsure_where_the_robot_turns() -> None:
    """Turns in between were claimed to be even: with odometry at 1 Hz a robot that swung was lost."""
    clock, slow_s = np.arange(0.0, 10.05, 0.1), np.arange(0.0, 10.5, 0.5)

    def turned_rad(t_s: FloatArray) -> FloatArray:
        return np.where(t_s > 4.0, 1.0 - np.cos(2.0 * (t_s - 4.0)), 0.0)

    def driven(t_s: FloatArray) -> FloatArray:
        return np.column_stack([0.0 * t_s, 0.0 * t_s, turned_rad(t_s)])

    every = np.ones(len(clock), dtype=np.bool_)
    var = _part_var(slow_s, driven(slow_s), clock, every)
    assert (var[clock < 3.0] == 0.0).all(), "standing, and even motion, is known in all its parts"
    off_rad = turned_rad(clock) - np.interp(clock, slow_s, turned_rad(slow_s))
    turning = clock > 4.5
    told_rad = float(np.sqrt(var[turning, 2].mean()))
    assert np.diff(off_rad)[turning[1:]].std() < told_rad < 3.0 * np.abs(off_rad).max()
    assert (_part_var(clock, driven(clock), slow_s, every[: len(slow_s)]) == 0.0).all(), "faster"
    # Steps between readings are parts of a whole that is known where odometry came with both.
    assert (_part_var(slow_s, driven(slow_s), clock, np.isin(clock, slow_s)) == 0.0).all()


def test_readings_that_arrive_in_bursts_were_driven_at_usual_speeds() -> None:
    """Stamped on arrival, a millisecond apart after each pause: 30 m/s were believed, and any heading."""
    told_s = np.arange(0.0, 60.0, 0.1)
    stamped_s = np.ceil(told_s / 0.5 - 1e-9) * 0.5 + 1e-3 * ((np.arange(len(told_s)) - 1) % 5)
    poses = np.column_stack([0.5 * told_s, 0.0 * told_s, 0.0 * told_s])
    moved = _moves(poses)[1:, 0]
    sure, bursts = (moved / _periods_s(t_s) for t_s in (told_s, stamped_s))
    assert bursts.max() < 1.5 * sure.max()
    read = np.arange(len(told_s)) % 3 == 0
    var = _part_var(stamped_s, poses, stamped_s, read)
    assert var.max() < 1e-12, "each reading came with odometry"


@pytest.mark.parametrize(("first_rad", "beams"), [(-1.2, 300), (-1.8, 300), (-1.5, 301), (0.0, 620)])
@pytest.mark.parametrize("mount_rad", [math.pi, -math.pi, 2.0, 0.0])
def test_a_scanner_may_look_back(first_rad: float, beams: int, mount_rad: float) -> None:
    """Its middle beam beyond half a turn of the robot's heading, no beam of it was taken, without a word."""
    ranges_m = np.linspace(1.0, 2.0, beams)
    raw = [RawScan(float(k), ranges_m, first_rad, 0.01, 0.1, 9.0) for k in range(2)]
    nothing = np.zeros(0)
    laser = assemble("back", raw, Pose2(-0.2, 0.0, mount_rad), False, nothing, nothing.reshape(0, 3))
    sheet = _sheet(laser)
    assert _scans(laser, sheet) == pytest.approx(np.tile(ranges_m, (2, 1)))
    seen_rad = sheet.mount.theta_rad + sheet.beam_angles_rad()[0]
    assert math.remainder(seen_rad - mount_rad - first_rad, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_odometry_that_was_recorded_as_transforms(table: Path, tmp_path: Path) -> None:
    """Of the usual frames: for a calibration, and beside landmarks without any scan."""
    drive = noisy(np.random.default_rng(5))
    moved = []
    for one in drive.stamped:
        if one.topic == "/odom":
            pose = one.fields["pose"]["pose"]
            turn = 2.0 * math.atan2(pose["orientation"]["z"], pose["orientation"]["w"])
            at = Pose2(pose["position"]["x"], pose["position"]["y"], turn)
            tree = {"transforms": [ros.transform(one.time_ns * 1e-9, "odom", "base_link", at)]}
            moved.append(Stamped("/tf", one.time_ns, ros.TRANSFORMS, tree))
        else:
            moved.append(one)
    write_mcap(tmp_path / "tf.mcap", RunMessages(moved, drive.own_types))
    write_mcap(tmp_path / "plain.mcap", drive)
    places = [tmp_path / "tf.mcap", tmp_path / "plain.mcap"]
    scales = [pl.calibrate("odometry", place, out=tmp_path)["angle_scale"]["value"] for place in places]
    assert scales[0] == pytest.approx(scales[1], rel=1e-6)
    runs = [pl.localize(place, landmarks=table, out=tmp_path) for place in places]
    assert runs[0].metrics["position_rmse_m"] == pytest.approx(runs[1].metrics["position_rmse_m"], rel=1e-3)


def test_bags_are_judged_by_their_topics(museum: tuple[pl.Run, dict[str, Path]]) -> None:
    run, bags = museum
    found = pl.evaluate(bags["ros1"], bags["mcap"], topics=["/pose", "/truth"])
    assert found["ate_rmse_m"] == pytest.approx(run.metrics["position_rmse_m"], rel=0.2)
    again = pl.evaluate(bags["ros2"], bags["ros2"], topics=["/tf:map:base_link", "/tf:map:base_link_truth"])
    assert again["ate_rmse_m"] == pytest.approx(found["ate_rmse_m"], rel=1e-6)


def test_a_bags_camera_is_calibrated_by_its_fiducials(table: Path, tmp_path: Path) -> None:
    """A camera 0.2 m ahead that measures 5 % too short, along its axis or not; it needs truth and a table."""
    drive, rng = commanded(rate_hz=10), np.random.default_rng(4)
    msgtype, types = DETECTIONS["apriltag"]
    tree = {"transforms": [ros.transform(1000.0, "base_link", "camera", MOUNT)]}
    out = [Stamped("/tf_static", ros.nanoseconds(1000.0), ros.TRANSFORMS, tree, kept=True)]
    for one in drive.stamped:
        out.append(one)
        if one.topic != "/odom":
            continue
        out.append(Stamped("/ground_truth", one.time_ns, ros.ODOMETRY, one.fields))
        pose = one.fields["pose"]["pose"]
        turn = 2.0 * math.atan2(pose["orientation"]["z"], pose["orientation"]["w"])
        at = Pose2(pose["position"]["x"], pose["position"]["y"], turn)
        where = {}
        for i, (x, y) in PLACES.items():
            seen = at.inverse().compose(Pose2(x, y, 0.0))
            short = 0.95 * (1.0 + 0.01 * rng.standard_normal())
            camera = MOUNT.inverse().compose(Pose2(short * seen.x_m, short * seen.y_m, 0.0))
            if seen.x_m > 0.5 and abs(seen.y_m) < seen.x_m:
                where[i] = (camera.x_m, camera.y_m)
        if where:
            message = detected("apriltag", ros.header(one.time_ns * 1e-9, "camera"), where)
            out.append(Stamped("/tags", one.time_ns, msgtype, message))
    bag = tmp_path / "a.bag"
    write_ros1(bag, RunMessages(out, types))
    found = pl.calibrate("commands", bag, landmarks=table, topics=["/tags", "/cmd_vel"], out=tmp_path)
    assert found["range_scale"]["value"] == pytest.approx(0.95, abs=2e-3)
    assert found["turn_gain"]["value"] == pytest.approx(1.1, abs=0.02)
    assert "range_scale" not in pl.calibrate("commands", bag, out=tmp_path / "without").answer
    other = tmp_path / "other.csv"
    other.write_text("id,x_m,y_m\n77,0,0\n")
    with pytest.raises(InputError, match="expected landmarks of the table in /tags, found only 1"):
        pl.calibrate("commands", bag, landmarks=other, out=tmp_path)
    write_ros1(tmp_path / "b.bag", drive)
    with pytest.raises(InputError, match="expected true poses"):
        pl.calibrate("commands", tmp_path / "b.bag", landmarks=table, out=tmp_path)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("localize {bag}", "expected --map MAP (for scans) or --landmarks TABLE"),
        (
            "localize {bag} --map museum --topic /scen",
            "expected the topic /scen, found /cmd_vel (geometry_msgs",
        ),
        ("localize {bag} --map museum --topic /plan", "expected one of sensor_msgs/msg/LaserScan"),
        ("localize {bag} --map museum --truth /nowhere", "expected the topic /nowhere of"),
        ("localize {bag} --map museum --start 1,1", "--start: expected X,Y,TH"),
        ("localize {bag} --map museum --start unknwn", "or unknown, found 'unknwn'"),
        (
            "localize {bag} --map museum --start unknown --localizer dead-reckoning",
            "expected --start X,Y,TH or the truth at the begin, found neither; of a map with walls",
        ),
        ("localize {bag} --map museum --start 1,1,0 --from 900", "readings in common"),
        ("localize {bag} --map museum --robot 2", "--robot is for --format mrclam"),
        (
            "localize {bare} --map museum",
            "expected a topic of sensor_msgs/msg/LaserScan, found /ground_truth",
        ),
        (
            "localize {still} --map museum --start 1,1,0",
            "expected a topic of nav_msgs/msg/Odometry, found /scan",
        ),
        ("localize {bag} --map museum --truth /tf:map", "expected /tf:PARENT:CHILD"),
        ("localize {bag} --map museum --truth /tf:map:moon", "expected transforms from 'map' to 'moon'"),
        ("calibrate odometry {still}", "expected a topic of nav_msgs/msg/Odometry, found /scan"),
        ("calibrate odometry {bag} --truth /scan", "expected the topic /scan of"),
        ("calibrate heading {bag}", "expected a topic of sensor_msgs/msg/Imu, found /cmd_vel"),
        ("calibrate range {bag}", "expected a robot that stands still"),
        ("calibrate range {still} --truth /truth", "--truth is for"),
        ("calibrate odometry {bag} --topic /truth --truth /truth", "expected --truth TOPIC|FILE beside"),
        ("calibrate heading {still} --truth /truth", "expected a topic of sensor_msgs/msg/Imu, found /scan"),
        ("calibrate odometry {csv} --topic /odom", "expected a bag where topics are named"),
        ("evaluate {bag} {bag}", "expected two topics of the one bag"),
        ("evaluate {bag} {bag} --topic /scan --topic /truth", "expected the topic /scan of"),
    ],
)
def test_what_is_missing_is_told_in_a_line(
    museum: tuple[pl.Run, dict[str, Path]],
    recordings: Mapping[str, Path],
    line: str,
    said: str,
) -> None:
    words = line.format(bag=museum[1]["mcap"], **recordings).split()
    with pytest.raises(InputError) as told:
        dispatch(words)
    assert said in str(told.value)
    assert "\n" not in str(told.value)


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Path]:
    folder = tmp_path_factory.mktemp("bare")
    write_mcap(folder / "bare.mcap", circle(parts="odometry truth"))
    write_mcap(folder / "still.mcap", steady("scan"))
    (folder / "a.csv").write_text("t_s,odom_x_m\n")
    return {"bare": folder / "bare.mcap", "still": folder / "still.mcap", "csv": folder / "a.csv"}


def test_a_bag_cut_in_half_is_localized_as_far_as_it_goes(
    museum: tuple[pl.Run, dict[str, Path]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = museum[1]["ros1"].read_bytes()
    (tmp_path / "half.bag").write_bytes(whole[: 3 * len(whole) // 4])
    words = ["localize", str(tmp_path / "half.bag"), "--map", "museum", "--out", str(tmp_path), "--json"]
    assert dispatch([*words, "--no-report"]) == 0
    told = capsys.readouterr()
    assert 1.0 < json.loads(told.out)["duration_s"] < 14.0
    assert "cut short" in told.err


def test_numbers_that_are_none_are_left_out(tmp_path: Path) -> None:
    """A detection without a number for a name is passed over and told."""
    drive = circle("vision")
    for stamped in drive.stamped:
        if stamped.topic == "/tags":
            for one in stamped.fields["detections"][:1]:
                one["results"][0]["hypothesis"]["class_id"] = "chair"
    write_mcap(tmp_path / "a.mcap", drive)
    with pytest.raises(InputError, match="found none that can be read"):
        read_series(tmp_path / "a.mcap", LANDMARKS)


def test_where_no_robot_was_is_left_out_and_told(tmp_path: Path) -> None:
    """A number beyond all distances, whose square is beyond all numbers."""
    drive = circle(parts="odometry")
    odometry = [stamped for stamped in drive.stamped if stamped.topic == "/odom"]
    odometry[3].fields["pose"]["pose"]["position"]["x"] = 1e200
    write_mcap(tmp_path / "a.mcap", drive)
    found = read_series(tmp_path / "a.mcap", POSES, "/odom")
    assert len(found.t_s) == len(odometry) - 1
    assert np.abs(found.values).max() < 100.0
    assert any("1 messages of /odom" in text for text in found.warnings)


def test_a_landmark_beyond_all_sight_is_left_out(table: Path, tmp_path: Path) -> None:
    """One detection at 1e9 m ended in a traceback: no sensor reaches so far."""
    drive = circle("vision")
    tags = [stamped for stamped in drive.stamped if stamped.topic == "/tags"]
    for one in tags[3].fields["detections"]:
        one["results"][0]["pose"]["pose"]["position"]["x"] = 1e9
    write_mcap(tmp_path / "a.mcap", drive)
    run = pl.localize(tmp_path / "a.mcap", landmarks=table, out=tmp_path)
    assert run.metrics["position_rmse_m"] < 0.02


@pytest.mark.parametrize("name", WRITERS)
def test_what_a_base_makes_of_its_commands(tmp_path: Path, name: str) -> None:
    WRITERS[name](tmp_path / name, commanded())
    found = pl.calibrate("commands", [tmp_path / name], out=tmp_path)
    for key, true, off in (("speed_gain", 0.9, 0.01), ("turn_gain", 1.1, 0.01), ("delay_s", 0.2, 0.026)):
        assert found.answer[key]["value"] == pytest.approx(true, abs=off)
    assert "range_scale" not in found.answer
    assert (found.folder / "parameters.yaml").read_text().count("speed_gain") == 2


def test_a_bag_without_commands_says_what_it_holds(tmp_path: Path) -> None:
    write_ros1(tmp_path / "a.bag", commanded(told=False))
    with pytest.raises(InputError, match=r"found /odom \(nav_msgs/msg/Odometry, 3600\)"):
        dispatch(["calibrate", "commands", str(tmp_path / "a.bag"), "--out", str(tmp_path)])
    assert [place.name for place in tmp_path.iterdir()] == ["a.bag"]
