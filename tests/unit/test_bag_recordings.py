"""``localize``, ``calibrate`` and ``evaluate`` on ROS 1 bags, ROS 2 bags and MCAP files."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pilotage as pl
from pilotage.bridges.ros import messages as ros
from pilotage.bridges.ros.bag_files import write_mcap, write_ros1, write_ros2
from pilotage.bridges.ros.run_messages import RunMessages, Stamped
from pilotage.cli.app import dispatch
from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.experiments.recordings.run_scans import read_run_scans
from pilotage.logs.bag_series import LANDMARKS, POSES, read_series
from pilotage.logs.laser_recordings import read_laser_log
from pilotage.maps.ros_map import RosMap, write_ros_map
from support.command_bags import commanded

pytest.importorskip("rosbags")

PLACES = {1: (4.0, 0.0), 2: (0.0, 4.0), 3: (-4.0, -1.0), 4: (1.0, -4.0)}
MOUNT = Pose2(0.2, 0.0, 0.0)
WRITERS: dict[str, Callable[[Path, RunMessages], None]] = {
    "a.bag": write_ros1,
    "folder": write_ros2,
    "a.mcap": write_mcap,
}
POSE_IN = "geometry_msgs/PoseWithCovariance pose\n"
DETECTIONS: dict[str, tuple[str, dict[str, str]]] = {
    "vision": (
        "vision_msgs/msg/Detection3DArray",
        {
            "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score\n",
            "vision_msgs/msg/ObjectHypothesisWithPose": "vision_msgs/ObjectHypothesis hypothesis\n" + POSE_IN,
            "vision_msgs/msg/Detection3D": "std_msgs/Header header\n"
            "vision_msgs/ObjectHypothesisWithPose[] results\nstring id\n",
            "vision_msgs/msg/Detection3DArray": "std_msgs/Header header\n"
            "vision_msgs/Detection3D[] detections\n",
        },
    ),
    "apriltag": (
        "apriltag_ros/msg/AprilTagDetectionArray",
        {
            "apriltag_ros/msg/AprilTagDetection": "int32[] id\n"
            "geometry_msgs/PoseWithCovarianceStamped pose\n",
            "apriltag_ros/msg/AprilTagDetectionArray": "std_msgs/Header header\n"
            "apriltag_ros/AprilTagDetection[] detections\n",
        },
    ),
    "aruco": (
        "aruco_msgs/msg/MarkerArray",
        {
            "aruco_msgs/msg/Marker": "std_msgs/Header header\nuint32 id\n" + POSE_IN,
            "aruco_msgs/msg/MarkerArray": "std_msgs/Header header\naruco_msgs/Marker[] markers\n",
        },
    ),
    "ros2-aruco": (
        "ros2_aruco_interfaces/msg/ArucoMarkers",
        {
            "ros2_aruco_interfaces/msg/ArucoMarkers": "std_msgs/Header header\nint64[] marker_ids\n"
            "geometry_msgs/Pose[] poses\n"
        },
    ),
    "fiducial": (
        "fiducial_msgs/msg/FiducialTransformArray",
        {
            "fiducial_msgs/msg/FiducialTransform": "int32 fiducial_id\ngeometry_msgs/Transform transform\n",
            "fiducial_msgs/msg/FiducialTransformArray": "std_msgs/Header header\n"
            "fiducial_msgs/FiducialTransform[] transforms\n",
        },
    ),
}


def detected(form: str, header: Any, seen: Mapping[int, tuple[float, float]]) -> dict[str, Any]:
    """One message: identities and places in the camera's frame."""
    poses = {i: ros.pose(Pose2(x, y, 0.0)) for i, (x, y) in seen.items()}
    if form == "vision":
        many = [
            {"results": [{"hypothesis": {"class_id": str(i), "score": 1.0}, "pose": {"pose": p}}]}
            for i, p in poses.items()
        ]
        return {"header": header, "detections": many}
    if form == "apriltag":
        tags = [{"id": [i], "pose": {"header": header, "pose": {"pose": p}}} for i, p in poses.items()]
        return {"header": header, "detections": tags}
    if form == "aruco":
        return {"header": header, "markers": [{"id": i, "pose": {"pose": p}} for i, p in poses.items()]}
    if form == "ros2-aruco":
        return {"header": header, "marker_ids": list(poses), "poses": list(poses.values())}
    shifts = [
        {"fiducial_id": i, "transform": {"translation": p["position"], "rotation": p["orientation"]}}
        for i, p in poses.items()
    ]
    return {"header": header, "transforms": shifts}


def truth_at(t_s: float) -> Pose2:
    """A circle of 1 m at 0.3 m/s."""
    angle = 0.3 * t_s
    return Pose2(math.sin(angle), 1.0 - math.cos(angle), math.remainder(angle, math.tau))


def circle(form: str = "vision", parts: str = "odometry landmarks truth") -> RunMessages:
    """A minute on the circle; odometry and velocities turn 2 % too much, the rest is exact."""
    out: list[Stamped] = []
    msgtype, types = DETECTIONS[form]
    claimed = Pose2(0.0, 0.0, 0.0)
    start = 1000.0
    tree = {"transforms": [ros.transform(start, "base_link", "camera", MOUNT)]}
    out.append(Stamped("/tf_static", ros.nanoseconds(start), ros.TRANSFORMS, tree, kept=True))
    for k in range(601):
        t_s = start + 0.1 * k
        at, now = truth_at(0.1 * k), ros.nanoseconds(t_s)
        if k:
            step = truth_at(0.1 * (k - 1)).inverse().compose(at)
            claimed = claimed.compose(Pose2(step.x_m, step.y_m, 1.02 * step.theta_rad))
        if "odometry" in parts:
            fields = ros.odometry(t_s, "odom", "base_link", claimed, ros.twist(0.3, 0.3))
            out.append(Stamped("/odom", now, ros.ODOMETRY, fields))
        if "truth" in parts:
            fields = ros.odometry(t_s, "map", "base_link", at, ros.twist(0.3, 0.3))
            out.append(Stamped("/ground_truth", now, ros.ODOMETRY, fields))
        if "twist" in parts:
            out.append(Stamped("/cmd_vel", now, ros.TWIST, ros.twist(0.3, 0.306)))
        if "imu" in parts:
            rate = {"x": 0.0, "y": 0.0, "z": 0.3}
            imu = {"header": ros.header(t_s, "imu"), "angular_velocity": rate}
            out.append(Stamped("/imu", now, "sensor_msgs/msg/Imu", imu))
        if "landmarks" in parts and k % 5 == 0:
            camera = at.compose(MOUNT).inverse()
            seen = {i: camera.compose(Pose2(x, y, 0.0)) for i, (x, y) in PLACES.items()}
            where = {i: (p.x_m, p.y_m) for i, p in seen.items()}
            out.append(Stamped("/tags", now, msgtype, detected(form, ros.header(t_s, "camera"), where)))
    return RunMessages(out, types)


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("table") / "landmarks.csv"
    path.write_text("id,x_m,y_m\n" + "".join(f"{i},{x},{y}\n" for i, (x, y) in PLACES.items()))
    return path


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


def test_velocities_and_a_gyroscope_serve_as_odometry(table: Path, tmp_path: Path) -> None:
    """Without odometry the velocities are integrated; a gyroscope corrects the heading, less its bias."""
    write_mcap(tmp_path / "a.mcap", circle(parts="twist imu landmarks truth"))
    bag, off = tmp_path / "a.mcap", {"stack.localizer.odometry.gyroscope": False}
    plain = pl.localize(bag, landmarks=table, localizer="ekf-landmarks", set=off, out=tmp_path)
    turned = pl.localize(
        bag, landmarks=table, localizer="ekf-landmarks", topics=["/imu", "/cmd_vel"], out=tmp_path
    )
    assert turned.metrics["heading_rmse_rad"] < 0.7 * plain.metrics["heading_rmse_rad"]
    assert turned.metrics["gyro_bias_rad_s"] == pytest.approx(0.0, abs=2e-3)
    assert "gyro_bias_rad_s" not in plain.metrics
    assert "gyro_bias_rad_s" not in plain.trace


def noisy(rng: np.random.Generator, axis: str = "z", scale: float = 1.0) -> RunMessages:
    """A winding drive of 80 s: odometry of a poor base, a gyroscope with a bias, landmarks half the time."""
    _, types = DETECTIONS["vision"]
    start, at, claimed = 1000.0, Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.0, 0.0)
    out: list[Stamped] = []
    tree = {"transforms": [ros.transform(start, "base_link", "camera", MOUNT)]}
    out.append(Stamped("/tf_static", ros.nanoseconds(start), ros.TRANSFORMS, tree, kept=True))
    for k in range(801):
        t_s, now, turn = start + 0.1 * k, ros.nanoseconds(start + 0.1 * k), 0.0
        if k > 30:  # it stands at first
            turn = 0.03 + 0.04 * math.sin(0.02 * k)
            at = at.compose(Pose2(0.03, 0.0, turn))
            wrong = math.sqrt(5e-3 * 0.03 + 0.01 * abs(turn)) * rng.standard_normal()
            claimed = claimed.compose(Pose2(0.03, 0.0, turn + wrong))
        for topic, frame, pose in (("/odom", "odom", claimed), ("/ground_truth", "map", at)):
            fields = ros.odometry(t_s, frame, "base_link", pose, ros.twist(0.3, 0.3))
            out.append(Stamped(topic, now, ros.ODOMETRY, fields))
        rate = dict.fromkeys("xyz", 0.0)
        rate[axis[-1]] = scale * (turn / 0.1 + 0.015 + 0.005 * rng.standard_normal())
        imu = {"header": ros.header(t_s - 0.05, "imu"), "angular_velocity": rate}
        out.append(Stamped("/imu", ros.nanoseconds(t_s - 0.05), "sensor_msgs/msg/Imu", imu))
        if k % 5 == 0 and k % 400 < 100:
            camera = at.compose(MOUNT).inverse()
            seen = {i: camera.compose(Pose2(x, y, 0.0)) for i, (x, y) in PLACES.items()}
            where = {i: (p.x_m + 0.05 * rng.standard_normal(), p.y_m) for i, p in seen.items()}
            message = detected("vision", ros.header(t_s, "camera"), where)
            out.append(Stamped("/tags", now, DETECTIONS["vision"][0], message))
    return RunMessages(out, types)


def test_a_gyroscope_bridges_the_time_without_landmarks(table: Path, tmp_path: Path) -> None:
    """Paired: the same recordings with and without it; the mean error is at most 0.6 times as large."""
    errors: dict[bool, list[float]] = {True: [], False: []}
    for seed in range(3):
        bag = tmp_path / f"{seed}.mcap"
        write_mcap(bag, noisy(np.random.default_rng(seed)))
        for used, found in errors.items():
            chosen = {"stack.localizer.odometry.gyroscope": used}
            run = pl.localize(bag, landmarks=table, set=chosen, out=tmp_path / f"{seed}-{used}")
            found.append(run.metrics["heading_rmse_rad"])
            if used:
                assert run.metrics["gyro_bias_rad_s"] == pytest.approx(0.015, abs=2e-3)
    assert all(with_it < without for with_it, without in zip(errors[True], errors[False], strict=True))
    assert np.mean(errors[True]) < 0.6 * np.mean(errors[False])


@pytest.mark.parametrize(("axis", "scale"), [("x", 1.0), ("z", -1.0), ("z", 57.3)])
def test_a_gyroscope_that_measures_other_turns_is_left_out(
    axis: str, scale: float, table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On its side, upside down, or in degrees: told, and refused where it was asked for by name."""
    bag = tmp_path / "a.mcap"
    write_mcap(bag, noisy(np.random.default_rng(0), axis, scale))
    line = ["localize", str(bag), "--landmarks", str(table), "--out", str(tmp_path), "--json", "--no-report"]
    assert dispatch(line) in (0, 1)
    told = capsys.readouterr()
    assert "gyroscope" not in json.loads(told.out)
    assert "/imu does not turn as the odometry does (they are" in told.err
    with pytest.raises(InputError, match="expected the robot's turn rates, found that /imu"):
        dispatch([*line, "--topic", "/imu"])


def test_a_localizer_without_use_for_a_gyroscope_says_so(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = tmp_path / "a.mcap"
    write_mcap(bag, circle(parts="odometry imu landmarks truth"))
    line = ["localize", str(bag), "--landmarks", str(table), "--out", str(tmp_path), "--no-report"]
    dispatch([*line, "--localizer", "ekf-gauss-markov"])
    assert "'ekf-gauss-markov' makes no use of the gyroscope /imu" in capsys.readouterr().err


def test_a_gyroscope_is_turned_into_the_robots_frame(table: Path, tmp_path: Path) -> None:
    """On its side, as the transforms tell: x looks down."""
    messages = noisy(np.random.default_rng(0), "x", -1.0)
    tree = {
        "transforms": [
            {
                "header": ros.header(1000.0, "base_link"),
                "child_frame_id": "imu",
                "transform": {
                    "translation": {"x": 0.0, "y": 0.0, "z": 0.0},
                    "rotation": {"x": 0.0, "y": math.sqrt(0.5), "z": 0.0, "w": math.sqrt(0.5)},
                },
            }
        ]
    }
    kept = Stamped("/tf_static", ros.nanoseconds(1000.0), ros.TRANSFORMS, tree, kept=True)
    bag = tmp_path / "a.mcap"
    write_mcap(bag, RunMessages([kept, *messages.stamped], messages.own_types))
    run = pl.localize(bag, landmarks=table, out=tmp_path)
    assert run.metrics["gyro_bias_rad_s"] == pytest.approx(0.015, abs=2e-3)


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


def steady(parts: str) -> RunMessages:
    """Two minutes at rest."""
    rng = np.random.default_rng(3)
    out = []
    for k in range(1200):
        t_s = 10.0 + 0.1 * k
        now, header = ros.nanoseconds(t_s), ros.header(t_s, "sensor")
        if "imu" in parts:
            rate = {"x": 0.0, "y": 0.0, "z": 0.02 + rng.normal(0.0, 0.01)}
            out.append(
                Stamped("/imu", now, "sensor_msgs/msg/Imu", {"header": header, "angular_velocity": rate})
            )
        if "range" in parts:
            fields = {"header": header, "range": 2.0 + rng.normal(0.0, 0.03)}
            out.append(Stamped("/sonar", now, "sensor_msgs/msg/Range", fields))
        if "scan" in parts:
            angles, ranges = np.linspace(-1.0, 1.0, 21), 3.0 + rng.normal(0.0, 0.03, 21)
            ranges[0] = np.inf if k % 2 else 3.0
            scan = ros.laser_scan(t_s, "laser", angles, ranges, 30.0)
            out.append(Stamped("/scan", now, ros.SCAN, scan))
    return RunMessages(out, {})


def test_sensors_at_rest(tmp_path: Path) -> None:
    write_ros2(tmp_path / "rest", steady("imu range"))
    gyroscope = pl.calibrate("heading", tmp_path / "rest", out=tmp_path)
    assert gyroscope["gyro_bias_rad_s"]["value"] == pytest.approx(0.02, abs=2e-3)
    sonar = pl.calibrate("range", tmp_path / "rest", out=tmp_path)
    assert sonar["rest_range_var_m2"]["value"] == pytest.approx(9e-4, rel=0.2)
    write_ros1(tmp_path / "laser.bag", steady("scan"))
    laser = pl.calibrate("range", tmp_path / "laser.bag", topics=["/scan"], out=tmp_path)
    beams = [key for key in laser.answer if key.endswith("_var_m2")]
    assert len(beams) == 8
    assert "laser_beam_0_var_m2" not in beams, "it hits nothing now and then"


def test_fiducials_at_rest_tell_range_and_bearing_noise(tmp_path: Path) -> None:
    """Beside each other, one straight behind: its bearing does not jump by a turn."""
    rng = np.random.default_rng(0)
    msgtype, types = DETECTIONS["aruco"]
    out = []
    for k in range(300):
        t_s = 10.0 + 0.1 * k
        seen = {3: (2.0, 0.0), 4: (-1.0, 0.001)}
        where = {i: (x + rng.normal(0.0, 0.02), y + rng.normal(0.0, 0.02)) for i, (x, y) in seen.items()}
        message = detected("aruco", ros.header(t_s, "camera"), where)
        out.append(Stamped("/tags", ros.nanoseconds(t_s), msgtype, message))
    write_ros1(tmp_path / "tags.bag", RunMessages(out, types))
    found = pl.calibrate("range", tmp_path / "tags.bag", out=tmp_path)
    assert found["tags_landmark_3_range_var_m2"]["value"] == pytest.approx(4e-4, rel=0.3)
    assert found["tags_landmark_3_bearing_var_rad2"]["value"] == pytest.approx(1e-4, rel=0.3)
    assert found["tags_landmark_4_bearing_var_rad2"]["value"] == pytest.approx(4e-4, rel=0.3)
    again = pl.calibrate("range", tmp_path / "tags.bag", topics=["/tags"], out=tmp_path / "named")
    assert again["tags_landmark_3_range_var_m2"] == found["tags_landmark_3_range_var_m2"]


def test_a_gyroscope_is_calibrated_against_the_truth_of_its_bag(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """While driving, too; without a truth a drive is no log at rest, however evenly it turned."""
    drive = noisy(np.random.default_rng(0))
    write_mcap(tmp_path / "a.mcap", drive)
    found = pl.calibrate("heading", tmp_path / "a.mcap", out=tmp_path)
    (entry,) = found["gyroscope_while_driving"]
    assert entry["bias_with_scale_rad_s"]["low"] < 0.015 < entry["bias_with_scale_rad_s"]["high"]
    assert entry["scale"]["low"] < 1.0 < entry["scale"]["high"]
    even = [s for s in circle(parts="odometry imu").stamped if s.topic != "/ground_truth"]
    write_mcap(tmp_path / "b.mcap", RunMessages(even, {}))
    assert dispatch(["calibrate", "heading", str(tmp_path / "b.mcap"), "--out", str(tmp_path)]) == 0
    told = capsys.readouterr().out
    assert "b_turn_rad" in told
    assert "(--truth TOPIC) would tell" in told
    assert "gyro_bias_rad_s" not in told


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
        ("calibrate odometry {bag} --topic /truth --truth /truth", "expected --truth TOPIC beside"),
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
