"""Runs handed on: what other programs read is what was recorded, bit for bit."""

from __future__ import annotations

import gc
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pilotage as pl
from pilotage.bridges.export import FORMS
from pilotage.bridges.ros.run_messages import field_names, run_messages
from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.logs.bags import read_bag
from pilotage.records.scans import read_sightings
from pilotage.records.trace import Trace, merged, write_trace
from support.fabricated_run import fabricate_columns, fabricate_run
from support.missions import reach

rosbags = pytest.importorskip("rosbags.highlevel", reason="needs the extra 'ros'")
BAGS = ("run.mcap", "rosbag", "other.bag")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> pl.Run:
    values = reach()
    values["robot"]["sensors"]["front-left"] = {"name": "ultrasonic", "mount": {"theta_rad": 0.3}}
    values["run"]["time_limit_s"] = 8.0
    return pl.run(values, out=tmp_path_factory.mktemp("runs"), progress=False)


@pytest.fixture(scope="module")
def bags(run: pl.Run) -> dict[str, Path]:
    pl.export(run, "mcap")
    pl.export(str(run.folder), "rosbag")
    pl.export(run, "rosbag", run.folder / "other.bag")
    return {name: run.folder / name for name in BAGS}


def messages(bag: Path, topic: str) -> list[Any]:
    with rosbags.AnyReader([bag]) as reader:
        wanted = [connection for connection in reader.connections if connection.topic == topic]
        return [reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages(wanted)]


def same_bits(found: Any, wanted: Any) -> bool:
    """NaNs are equal too."""
    return bool(np.array_equal(np.asarray(found, float).view("u8"), np.asarray(wanted, float).view("u8")))


@pytest.mark.parametrize("bag", BAGS)
def test_every_column_comes_back_bit_for_bit(run: pl.Run, bags: dict[str, Path], bag: str) -> None:
    rows = messages(bags[bag], "/trace")
    assert len(rows) == run.trace.rows
    for column in run.trace:
        field = column.replace("-", "_")
        assert same_bits([getattr(row, field) for row in rows], run.trace[column]), column
    assert "us_front-left_m" in run.trace


def test_another_library_reads_the_same(run: pl.Run, bags: dict[str, Path]) -> None:
    reader = pytest.importorskip("mcap_ros2.reader")
    found: dict[str, list[Any]] = {}
    for message in reader.read_ros2_messages(str(bags["run.mcap"])):
        found.setdefault(message.channel.topic, []).append(message.ros_msg)
    for column in run.trace:
        values = [getattr(row, column.replace("-", "_")) for row in found["/trace"]]
        assert same_bits(values, run.trace[column]), column
    kept = read_sightings(run.folder)
    ranges = np.array([scan.ranges for scan in found["/scan"]])
    assert np.array_equal(ranges, np.where(np.isnan(kept.ranges_m), np.inf, kept.ranges_m).astype(np.float32))
    assert found["/cmd_vel"][20].linear.x == run.trace["v_cmd_m_s"][20]
    assert found["/pose"][20].pose.covariance[35] == run.trace["cov_tt_rad2"][20]
    assert [log.msg for log in found["/events"]] == [event.text for event in run.events]
    assert len(found["/map"][0].data) == found["/map"][0].info.width * found["/map"][0].info.height


def test_frames_join_to_what_the_robot_believed(run: pl.Run, bags: dict[str, Path]) -> None:
    """map to odom to base_link is the estimate; odom is continuous, and ends where the increments lead."""
    last = messages(bags["run.mcap"], "/tf")[-1].transforms
    frames = {(one.header.frame_id, one.child_frame_id): one.transform for one in last}

    def pose(one: Any) -> pl.Pose2:
        angle = 2.0 * np.arctan2(one.rotation.z, one.rotation.w)
        return pl.Pose2(one.translation.x, one.translation.y, float(angle))

    joined = pose(frames["map", "odom"]).compose(pose(frames["odom", "base_link"]))
    estimate = [run.trace[f"est_{part}"][-1] for part in ("x_m", "y_m", "theta_rad")]
    assert joined.as_array() == pytest.approx(estimate, abs=1e-9)
    driven = messages(bags["run.mcap"], "/odom")
    turned = 2.0 * np.arctan2(driven[-1].pose.pose.orientation.z, driven[-1].pose.pose.orientation.w)
    wanted = np.nansum(run.trace["odom_angle_rad"])
    assert np.cos(turned - wanted) == pytest.approx(1.0, abs=1e-9)
    assert driven[-1].twist.twist.linear.x == pytest.approx(run.trace["odom_distance_m"][-1] / 0.1)


def test_our_own_reader_takes_it_as_a_recording(bags: dict[str, Path]) -> None:
    logs = [read_bag(path) for path in bags.values()]
    assert len({len(log) for log in logs}) == 1
    assert logs[0].odometry is not None
    for log in logs[1:]:
        assert np.array_equal(log.ranges_m, logs[0].ranges_m, equal_nan=True)


def test_tables(run: pl.Run) -> None:
    import pyarrow.csv

    table = pyarrow.csv.read_csv(pl.export(run, "csv"))
    for column in run.trace:
        values = table[column].to_numpy(zero_copy_only=False).astype(float)
        assert np.array_equal(values, run.trace[column], equal_nan=True), column
    folder = pl.export(run, "tum")
    errors = pl.evaluate(folder / "estimate.tum", folder / "truth.tum")
    # The metric leaves out the first second.
    gap = np.hypot(*(run.trace[f"est_{k}_m"] - run.trace[f"true_{k}_m"] for k in "xy"))
    assert errors["ate_rmse_m"] == pytest.approx(float(np.sqrt(np.mean(gap**2))), rel=1e-3)


def test_a_team_has_topics_for_each(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    values = reach(robots=[{"name": "One", "start": {"x_m": 2.0, "y_m": 2.0}}])
    robot = values.pop("robot")
    values["robots"] = [
        {"name": name, **robot, "start": {"x_m": x, "y_m": 2.0}, "goal": {"x_m": x, "y_m": 5.0}}
        for name, x in (("Guard one", 2.0), ("two", 3.5))
    ]
    values["world"] = {"map": values["world"]["map"]}
    values["stack"]["planner"] = {"name": "rrt-star-dubins"}
    values["run"]["time_limit_s"] = 2.0
    run = pl.run(values, out=tmp_path, progress=False)
    bag = pl.export(run, "mcap")
    for name, robot_name in (("guard_one", "Guard one"), ("two", "two")):
        rows = messages(bag, f"/{name}/trace")
        assert same_bits([row.est_x_m for row in rows], run.trace.of(robot_name)["est_x_m"])
    folder = pl.export(run, "tum")
    assert len(list(folder.iterdir())) == 4
    pytest.importorskip("rerun", reason="needs the extra 'rerun'")
    capfd.readouterr()
    pl.export(run, "rerun")
    (run.folder / "robot-1" / "plans.npz").write_bytes(b"damaged")
    with pytest.raises(InputError, match=r"robot-1/plans\.npz: expected arrays"):
        pl.export(run, "rerun")
    gc.collect()
    assert not capfd.readouterr().err  # a name of two words and what was not written in the end drew warnings


def test_names_that_are_no_words_of_files_and_topics_stay_apart(tmp_path: Path) -> None:
    """Two robots were mixed on one topic; "../x" was written beside the folder, "/" into the root."""
    names = ["一", "二", "../../up", "/", "A", "a", "robot", ".", "<b>", "一" * 300]
    folder = fabricate_run(tmp_path / "deep" / "er" / "run")
    write_trace(folder, merged(dict.fromkeys(names, fabricate_columns(3, np.random.default_rng(1)))))
    made = pl.export(folder, "tum")
    files = {path.name for path in made.iterdir()}
    assert len(files) == len({name.casefold() for name in files}) == 2 * len(names)
    assert {"一-truth.tum", "up-truth.tum", "A-truth.tum", "a_2-truth.tum", "robot_2-truth.tum"} < files
    assert {path.parent for path in tmp_path.rglob("*.tum")} == {made}
    told = run_messages(folder).stamped
    topics = {message.topic for message in told if message.topic.endswith("/trace")}
    assert len(topics) == len(names)
    assert {"/n/trace", "/n_2/trace", "/a/trace", "/a_2/trace"} < topics


def test_a_rerun_file_holds_every_entity(run: pl.Run) -> None:
    pytest.importorskip("rerun", reason="needs the extra 'rerun'")
    path = pl.export(run, "rerun")
    assert path.read_bytes().startswith(b"RRF")
    assert path.stat().st_size > 50_000


def test_names_that_messages_cannot_have() -> None:
    names = field_names(Trace(dict.fromkeys(("a_b", "a-b", "A..b", "2nd", "from"), np.zeros(1)), 1))
    assert list(names.values()) == ["a_b", "a_b_2", "a_b_3", "n_2nd", "n_from"]


def test_a_column_of_a_plugin_may_be_called_as_a_word_of_python(tmp_path: Path) -> None:
    folder = fabricate_run(tmp_path / "run", steps=3, columns={"class": np.ones(3)})
    assert [row.n_class for row in messages(pl.export(folder, "mcap"), "/trace")] == [1.0] * 3


@pytest.mark.parametrize("to", ["mcap", "rosbag", "rerun"])
def test_a_row_whose_time_no_recording_holds_is_one_line(tmp_path: Path, to: str) -> None:
    if to == "rerun":
        pytest.importorskip("rerun", reason="needs the extra 'rerun'")
    folder = fabricate_run(tmp_path / "run", steps=3, columns={"t_s": 3e9 + 10.0 * np.arange(3.0)})
    with pytest.raises(InputError, match=r"trace\.parquet: t_s: expected seconds within 2147483647"):
        pl.export(folder, to)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["{run}", "--to", "mcab"], "unknown format 'mcab'; did you mean 'mcap'?"),
        (["{run}/nowhere", "--to", "csv"], "expected a run's folder, found nothing"),
        (["{run}", "--to", "csv", "--out", "{run}"], "expected a file to write, found the folder"),
        (["{run}", "--to", "tum", "--out", "{run}"], "expected a folder that is not there yet"),
        (["{run}", "--to", "csv", "--out", "{run}/no/x.csv"], "expected a folder that is there, found none"),
    ],
)
def test_what_cannot_be_handed_on_is_one_line(
    words: list[str], told: str, run: pl.Run, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", *(word.format(run=run.folder) for word in words)]) == 2
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert told in said.err


@pytest.mark.parametrize(
    ("to", "library", "extra"), [("mcap", "rosbags", "ros"), ("rosbag", "rosbags", "ros"), ("rerun",) * 3]
)
def test_a_missing_extra_is_one_line_and_leaves_nothing(
    to: str,
    library: str,
    extra: str,
    run: pl.Run,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for name in list(sys.modules):
        if name.split(".")[0] == library:
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, library, None)
    assert main(["export", str(run.folder), "--to", to, "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert said.err.count("\n") == 1
    assert f"pip install -e '.[{extra}]'" in said.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a folder that takes no files")
@pytest.mark.parametrize("to", ["mcap", "rosbag", "rerun", "tum", "csv"])
def test_a_place_that_takes_no_files_is_one_line(
    to: str, run: pl.Run, capsys: pytest.CaptureFixture[str]
) -> None:
    if to == "rerun":
        pytest.importorskip("rerun", reason="needs the extra 'rerun'")
    assert main(["export", str(run.folder), "--to", to, "--out", "/proc/out"]) == 2
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert said.err.startswith("pilotage: /proc/out: "), "not of a draft that nobody asked for"
    assert "local file" not in said.err, "in the words of the system, not of a library"


def test_the_command_says_where(run: pl.Run, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(run.folder), "--to", "csv"]) == 0
    assert capsys.readouterr().out.strip() == str(run.folder / "trace.csv")
    assert set(FORMS) == {"mcap", "rosbag", "rerun", "tum", "csv"}


@pytest.mark.parametrize(
    ("topics", "told"),
    [
        (["/laser"], "expected the topic /laser, found /cmd_vel (geometry_msgs/msg/Twist, "),
        (
            ["/scan", "/trace"],
            "topic /trace: expected sensor_msgs/msg/LaserScan or nav_msgs/msg/Odometry, found ",
        ),
    ],
)
def test_a_wrong_topic_is_told_with_what_there_is(
    topics: list[str], told: str, bags: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [word for topic in topics for word in ("--topic", topic)]
    assert main(["slam", str(bags["run.mcap"]), *words, "--out", str(tmp_path / "runs")]) == 2
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert told in said.err
    assert list(tmp_path.iterdir()) == []


def test_topics_are_what_their_types_say(run: pl.Run, bags: dict[str, Path]) -> None:
    by_default, by_truth = read_bag(bags["run.mcap"]), read_bag(bags["run.mcap"], topics=["truth", "/scan"])
    assert by_default.odometry is not None
    assert by_truth.odometry is not None
    assert by_truth.odometry[-1, 0] == pytest.approx(run.trace["true_x_m"][-1])
    assert by_default.odometry[-1, 0] != pytest.approx(by_truth.odometry[-1, 0])


@pytest.mark.parametrize("to", ["mcap", "rosbag", "rerun"])
@pytest.mark.parametrize("t_s", [None, 2.0**64])
def test_an_event_without_a_time_has_no_place_in_a_recording(
    tmp_path: Path, to: str, t_s: float | None
) -> None:
    if to == "rerun":
        pytest.importorskip("rerun", reason="needs the extra 'rerun'")
    events: list[dict[str, Any]] = [{"t_s": t_s, "kind": "moon-rise", "text": "it rose"}]
    folder = fabricate_run(
        tmp_path / "run", steps=5, metrics={"mission": "x", "success": True}, events=events
    )
    with pytest.raises(InputError, match="expected the time of every event"):
        pl.export(str(folder), to, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("file", "array"), [("plans.npz", "t_0"), ("scans.npz", "scan_t_s")])
def test_a_time_that_no_recording_holds_is_one_line(
    run: pl.Run, tmp_path: Path, file: str, array: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """32 bits of seconds; bags and Rerun overflowed."""
    shutil.copytree(run.folder, tmp_path / "run")
    with np.load(run.folder / file) as kept:
        arrays = dict(kept)
    arrays[array] = np.full_like(arrays[array], 1e15)
    np.savez(tmp_path / "run" / file, **arrays)
    for to in ("mcap", "rosbag", "rerun"):
        assert main(["export", str(tmp_path / "run"), "--to", to, "--out", str(tmp_path / to)]) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1
        assert f"{file}: " in said
        assert f"{array}: expected" in said


@pytest.mark.filterwarnings("ignore:unclosed database:ResourceWarning")  # rosbags'
@pytest.mark.parametrize("form", sorted(FORMS))
def test_a_full_disk_is_told_with_the_file(
    run: pl.Run, form: str, small_disk: Callable[[str], Path], capfd: pytest.CaptureFixture[str]
) -> None:
    """Nobody was told of which disk it was; SQLite's and Rerun's words for it were bugs of ours."""
    if form == "rerun":
        pytest.importorskip("rerun", reason="needs the extra 'rerun'")
    place = small_disk("8k") / "it"
    assert main(["export", str(run.folder), "--to", form, "--out", str(place)]) == 2
    told = next(line for line in capfd.readouterr().err.splitlines() if line.startswith("pilotage: "))
    assert told.startswith(f"pilotage: {place}: ")
    assert "space left" in told
    assert list(place.parent.iterdir()) == []
    gc.collect()  # here, not in whatever test comes next
