"""Bags of every form read alike; what is missing, damaged or odd is said and nothing lost."""

from __future__ import annotations

import contextlib
import math
import os
import sqlite3
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from pilotage.core.errors import InputError
from pilotage.logs.bags import read_bag
from pilotage.logs.laser_log import LaserLog
from pilotage.logs.message_types import shared, told_types
from pilotage.logs.rosbags_extra import rosbags
from pilotage.logs.salvage import unpacking
from pilotage.logs.salvage.found import BagFormat, Salvage
from pilotage.logs.salvage.walk import WALKS
from support.damage import endless_rows
from support.laser_bags import FORMS, Drive, Scan, drive, with_scan, write_ros1, write_ros2

pytest.importorskip("rosbags")
pytest.importorskip("mcap_ros2")

UPSIDE_DOWN = (1.0, 0.0, 0.0, 0.0)
"""Half a turn about the axis ahead."""
CUT_FORMS = ["ros1", "ros1-bz2", "ros1-lz4", "ros2-sqlite-file", "ros2-mcap-file", "foreign-mcap"]
CUT_FORMS += ["foreign-mcap-lz4", "foreign-mcap-plain", "ros1-mcap"]
LONG = drive(400, 90)


def read(folder: Path, whole: Drive, form: str = "ros1") -> LaserLog:
    return read_bag(FORMS[form](folder, whole))


@pytest.mark.parametrize("form", list(FORMS))
def test_every_form_reads_alike(tmp_path: Path, form: str) -> None:
    whole = drive()
    log = read(tmp_path, whole, form)
    assert log.warnings == ()
    np.testing.assert_allclose(log.t_s, [scan.t_s for scan in whole.scans], atol=1e-6)
    assert np.array_equal(log.ranges_m, [scan.ranges_m for scan in whole.scans])
    assert (log.beams == 21).all()
    np.testing.assert_allclose(log.angles_rad(3), -1.0 + 0.1 * np.arange(21), atol=1e-6)
    assert [log.range_min_m, log.range_max_m] == pytest.approx([0.1, 30.0])
    assert (log.mount.x_m, log.mount.y_m, log.mount.theta_rad) == pytest.approx((0.2, 0.1, 0.0))
    assert not log.upside_down
    assert log.odometry is not None
    assert log.odometry_t_s is not None
    rows = np.array(whole.odometry)
    np.testing.assert_allclose(log.odometry_t_s, rows[:, 0], atol=1e-6)
    np.testing.assert_allclose(log.odometry, rows[:, 1:], atol=1e-9)


def test_odometry_is_interpolated_over_the_turn_of_headings(tmp_path: Path) -> None:
    at = read(tmp_path, drive()).odometry_at_scans()
    assert at is not None
    k = 1.0 + 2.0 * np.arange(30)
    np.testing.assert_allclose(at[:, 0], 0.01 * k, atol=1e-6)
    assert np.abs(np.angle(np.exp(1j * (at[:, 2] - 3.0 - 0.01 * k)))).max() < 1e-6
    assert ((at[:, 2] >= -math.pi) & (at[:, 2] < math.pi)).all()


def test_an_upside_down_scanner_is_turned_round(tmp_path: Path) -> None:
    """Beam k of the scanner points to -angle on the robot; the log's beams go counter-clockwise again."""
    whole = replace(drive(), mount_turn=UPSIDE_DOWN)
    log = read(tmp_path, whole)
    assert log.upside_down
    assert log.mount.theta_rad == pytest.approx(0.0)
    assert np.array_equal(log.ranges_m[0], whole.scans[0].ranges_m[::-1])
    np.testing.assert_allclose(log.angles_rad(0), -1.0 + 0.1 * np.arange(21), atol=1e-6)
    lopsided = replace(whole, scans=(replace(whole.scans[0], first_rad=-0.5),))
    (tmp_path / "b").mkdir()
    again = read(tmp_path / "b", lopsided)
    np.testing.assert_allclose(again.angles_rad(0), -1.5 + 0.1 * np.arange(21), atol=1e-6)


def test_a_turned_scanner(tmp_path: Path) -> None:
    whole = replace(drive(), mount_turn=(0.0, 0.0, math.sin(0.4), math.cos(0.4)))
    assert read(tmp_path, whole).mount.theta_rad == pytest.approx(0.8)


def test_a_tilted_scanner_is_told(tmp_path: Path) -> None:
    whole = replace(drive(), mount_turn=(0.0, math.sin(0.1), 0.0, math.cos(0.1)))
    assert any("tilted by 11 deg" in said for said in read(tmp_path, whole).warnings)


def test_a_scanner_that_counts_clockwise(tmp_path: Path) -> None:
    whole = drive(1)
    whole = with_scan(whole, 0, first_rad=1.0, step_rad=-0.1)
    log = read(tmp_path, whole)
    assert np.array_equal(log.ranges_m[0], whole.scans[0].ranges_m[::-1])
    np.testing.assert_allclose(log.angles_rad(0), -1.0 + 0.1 * np.arange(21), atol=1e-6)


def test_ranges_of_three_kinds(tmp_path: Path) -> None:
    odd = np.array([1.0, np.nan, np.inf, -np.inf, 0.0, -2.0, 0.05, 0.1, 30.0, 31.0])
    log = read(tmp_path, with_scan(drive(), 4, ranges_m=odd))
    expected = [1.0, np.nan, np.inf, np.nan, np.nan, np.nan, np.nan, 0.1, 30.0, np.inf]
    np.testing.assert_allclose(log.ranges_m[4, :10], expected, rtol=1e-6)
    assert np.isnan(log.ranges_m[4, 10:]).all()
    assert log.beams[4] == 10
    assert np.isnan(log.angles_rad(4)[10:]).all()
    assert log.warnings == (
        "the number of beams changes from scan to scan (10, 21)",
        "1 ranges are not numbers (0.2%): no measurement",
    )


def test_a_range_that_signals_is_no_number(tmp_path: Path) -> None:
    """A NaN of other bits, such as a damaged message may hold: NumPy warns where it is worked with."""
    mark = np.float32(12345.5)
    path = write_ros1(tmp_path / "a.bag", with_scan(drive(), 4, ranges_m=np.full(21, mark)))
    path.write_bytes(path.read_bytes().replace(mark.tobytes(), np.uint32(0x7FA00000).tobytes()))
    log = read_bag(path)
    assert np.isnan(log.ranges_m[4]).all()
    assert log.warnings == ("21 ranges are not numbers (3.3%): no measurement",)


def test_times_that_go_back_are_sorted_and_told(tmp_path: Path) -> None:
    """The stamp, not the receipt, is a scan's time."""
    whole = drive()
    whole = replace(whole, received_s={5: whole.scans[8].t_s + 0.01})
    log = read(tmp_path, whole)
    np.testing.assert_allclose(log.t_s, [scan.t_s for scan in whole.scans], atol=1e-6)
    assert np.array_equal(log.ranges_m[5], whole.scans[5].ranges_m)
    assert log.warnings == ("1 times of the scans go back (by 0.300 s at most): sorted by time",)


def test_two_scans_of_one_time_are_kept_and_told(tmp_path: Path) -> None:
    whole = drive()
    log = read(tmp_path, with_scan(whole, 3, t_s=whole.scans[2].t_s))
    assert len(log) == 30
    assert log.warnings == ("1 of the scans carry the time of the one before",)


def test_scans_of_two_scanners_on_one_topic_are_told_apart(tmp_path: Path) -> None:
    """The second scanner's beams were placed as the first one's."""
    whole = drive()
    log = read(tmp_path, with_scan(with_scan(whole, 4, frame="rear"), 7, frame="rear"))
    assert len(log) == 28
    said = "2 scans of /scan are another scanner's, in the frame 'rear': those in 'laser' are taken"
    assert log.warnings == (said,)


def test_messages_without_stamps_go_by_their_receipt(tmp_path: Path) -> None:
    log = read(tmp_path, replace(drive(), stamped=False))
    np.testing.assert_allclose(log.t_s, 1000.0 + 0.1 * np.arange(30), atol=1e-6)
    assert log.warnings == ("30 messages carry no time: the time of receipt is used",)


def test_no_odometry_is_allowed_and_told(tmp_path: Path) -> None:
    log = read(tmp_path, replace(drive(), odometry=()))
    assert log.odometry is None
    assert log.odometry_at_scans() is None
    assert log.warnings == ("no odometry",)
    assert log.mount.x_m == pytest.approx(0.2)


def test_odometry_from_transforms(tmp_path: Path) -> None:
    whole = replace(drive(), odometry_as_transforms=True)
    log = read(tmp_path, whole)
    assert log.odometry is not None
    np.testing.assert_allclose(log.odometry, np.array(whole.odometry)[:, 1:], atol=1e-9)
    assert log.mount.x_m == pytest.approx(0.2)
    assert any("taken from the transforms of 'base_link'" in said for said in log.warnings)


def test_odometry_that_is_not_finite_or_short(tmp_path: Path) -> None:
    rows = list(drive().odometry[:30])
    rows[7] = (rows[7][0], math.nan, 0.0, 0.0)
    rows[9] = (rows[9][0], 4e86, 0.0, 0.0)
    log = read(tmp_path, replace(drive(), odometry=tuple(rows)))
    assert log.odometry is not None
    assert log.odometry.shape == (28, 3)
    assert "2 odometry readings that are no places were left out" in log.warnings
    assert any("odometry covers" in said for said in log.warnings)


def test_no_mount_is_told(tmp_path: Path) -> None:
    log = read(tmp_path, replace(drive(), without_mount=True))
    assert log.mount.x_m == 0.0
    assert any("no transforms from 'base_link' to the scanner's frame 'laser'" in s for s in log.warnings)


def test_topics_by_name_and_by_default(tmp_path: Path) -> None:
    whole = drive()
    rear = tuple(replace(scan, topic="/rear/scan", ranges_m=scan.ranges_m + 1.0) for scan in whole.scans)
    path = write_ros1(tmp_path / "two.bag", replace(whole, scans=whole.scans + rear[:-1]))
    log = read_bag(path)
    assert np.array_equal(log.ranges_m[0], whole.scans[0].ranges_m)
    assert "laser scans are taken from /scan (also there: /rear/scan)" in log.warnings
    other = read_bag(path, scan_topic="rear/scan")
    assert len(other) == 29
    np.testing.assert_allclose(other.ranges_m[0], whole.scans[0].ranges_m + 1.0, rtol=1e-6)
    with pytest.raises(
        InputError, match=r"topic /front of sensor_msgs/msg/LaserScan, found /odom \(nav_msgs"
    ):
        read_bag(path, scan_topic="/front")
    with pytest.raises(InputError, match="topic /wheels of nav_msgs/msg/Odometry"):
        read_bag(path, odometry_topic="/wheels")


def test_a_bag_without_scans_tells_what_it_holds(tmp_path: Path) -> None:
    with pytest.raises(InputError) as told:
        read(tmp_path, replace(drive(), scans=()), "ros2-mcap")
    assert "expected a topic of sensor_msgs/msg/LaserScan, found /odom (nav_msgs/msg/Odometry, 62)" in str(
        told.value
    )
    assert "\n" not in str(told.value)


def test_scans_without_beams(tmp_path: Path) -> None:
    none = np.empty(0)
    log = read(tmp_path, with_scan(drive(), 0, ranges_m=none))
    assert len(log) == 29
    assert log.warnings == ("1 scans without beams, times, angles or limits were left out",)
    (tmp_path / "b").mkdir()
    with pytest.raises(InputError, match="30 scans without a usable beam"):
        read(tmp_path / "b", Drive(tuple(Scan(scan.t_s, none) for scan in drive().scans)))


@pytest.mark.parametrize(
    "changes",
    [
        {"first_rad": -90.0, "step_rad": 1.0},
        {"step_rad": 1e30},
        {"step_rad": 1e-30},
        {"first_rad": -1e38},
        {"range_max_m": 0.0},
        {"range_max_m": -1.0},
        {"range_min_m": 20.0, "range_max_m": 10.0},
        {"range_min_m": math.nan},
    ],
    ids=str,
)
def test_scans_that_no_scanner_makes(tmp_path: Path, changes: dict[str, Any]) -> None:
    """They were mapped with success, or ended the localizer in a traceback."""
    impossible = tuple(replace(scan, **changes) for scan in drive().scans)
    with pytest.raises(InputError, match=r"30 scans without a usable beam \(angles in radians"):
        read(tmp_path, replace(drive(), scans=impossible))


@pytest.fixture(scope="module")
def long_bag(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """A bag of many scans in a form, written once."""
    return cache(lambda form: FORMS[form](tmp_path_factory.mktemp(form), LONG))


@pytest.mark.parametrize("form", CUT_FORMS)
@pytest.mark.parametrize("share", [0.5, 0.75, 0.95])
def test_a_bag_cut_short_is_read_as_far_as_it_goes(
    tmp_path: Path, long_bag: Callable[[str], Path], form: str, share: float
) -> None:
    whole, data = LONG, long_bag(form).read_bytes()
    path = tmp_path / long_bag(form).name
    path.write_bytes(data[: int(share * len(data))])
    log = read_bag(path)
    assert len(log) > 0.4 * share * 400
    assert len(log) == 400 or any("cut short" in said for said in log.warnings)
    number = np.round((log.t_s - 1000.0) / 0.1).astype(int)
    assert np.array_equal(log.ranges_m, np.array([scan.ranges_m for scan in whole.scans])[number])
    assert log.mount.x_m == pytest.approx(0.2)


@pytest.mark.parametrize("form", ["ros1", "ros2-mcap-file", "foreign-mcap"])
def test_types_that_an_earlier_bag_told_are_not_compiled_again(
    tmp_path: Path, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The library takes them apart and compiles them for each bag: most of what a short one took."""
    path, cut = FORMS[form](tmp_path, drive()), tmp_path / "cut.bag"
    cut.write_bytes(path.read_bytes()[:-40])
    first = [read_bag(bag) for bag in (path, cut)]
    for compiles in ("typesys.store.generate_deserialize_cdr", "typesys.store.generate_python_code"):
        monkeypatch.setattr(f"rosbags.{compiles}", None)
    monkeypatch.setattr("rosbags.typesys.msg.MSGParser", None)
    for before, again in zip(first, [read_bag(bag) for bag in (path, cut)], strict=True):
        assert np.array_equal(before.ranges_m, again.ranges_m)
        assert before.warnings == again.warnings


def test_types_that_have_one_name_and_other_fields_are_not_taken_for_each_other() -> None:
    one, other = told_types("float64 a", "own/msg/One"), told_types("float64 a\nfloat64 b", "own/msg/One")
    assert len(other.types["own/msg/One"].__dataclass_fields__) > len(
        one.types["own/msg/One"].__dataclass_fields__
    )
    assert shared(one) is told_types("float64  a", "own/msg/One")


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_how_a_topic_was_sent_is_read_once_for_each_wording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, storage: str
) -> None:
    """YAML for each topic at each opening was most of what it takes to open a bag."""
    assert len(read_bag(write_ros2(tmp_path / storage, drive(), storage.upper()))) == 30
    read_quality = rosbags(f"rosbag2.storage_{storage}").parse_qos
    told: dict[str, object] = dict.fromkeys(
        ("history", "depth", "reliability", "durability", "liveliness"), 1
    )
    told |= {name: {"sec": 0, "nsec": 0} for name in ("deadline", "lifespan", "liveliness_lease_duration")}
    told["avoid_ros_namespace_conventions"] = False
    wording = f"[{told}]"
    once = read_quality(wording)
    assert len(once) == 1
    monkeypatch.setattr(rosbags("rosbag2.metadata"), "YAML", Mock(side_effect=AssertionError))
    assert read_quality(wording) == once
    with pytest.raises(AssertionError):
        read_quality(f"{wording} ")


def test_a_folder_without_metadata(tmp_path: Path) -> None:
    for storage in ("SQLITE3", "MCAP"):
        path = write_ros2(tmp_path / storage.lower(), drive(), storage)
        (path / "metadata.yaml").unlink()
        assert len(read_bag(path)) == 30


BOMB = "a0: &a0 [x, x]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}]\n" for i in range(1, 60))
LISTED = "rosbag2_bagfile_information: {relative_file_paths: [a.db3, more.db3]}"


@pytest.mark.parametrize("described", [None, BOMB, "- 1", LISTED])
def test_a_description_that_would_hang_is_not_handed_to_the_library(
    tmp_path: Path, described: str | None
) -> None:
    """A pipe that nobody writes into: in its place, or in the place of a file that it lists."""
    path = write_ros2(tmp_path / "a", drive())
    (path / "metadata.yaml").unlink()
    os.mkfifo(path / ("metadata.yaml" if described is None else "more.db3"))
    if described is not None:
        (path / "metadata.yaml").write_text(described)
    assert len(read_bag(path)) == 30


def test_a_description_of_far_too_much_is_not_handed_to_the_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It read a list of 50,000 numbers for half a minute."""
    path = write_ros2(tmp_path / "a", drive())
    described = path / "metadata.yaml"
    described.write_text(described.read_text() + "more: [" + "1.5, " * 50_000 + "1.5]\n")
    handed = "rosbags.highlevel.AnyReader.__init__"
    monkeypatch.setattr(handed, lambda *_, **__: pytest.fail("it was handed over"))
    assert len(read_bag(path)) == 30


@pytest.mark.parametrize("form", ["ros1", "foreign-mcap-lz4"])
def test_a_bag_that_shrinks_while_it_is_walked_is_read_as_a_cut_one(form: str, tmp_path: Path) -> None:
    """Whoever had mapped it into memory would be ended by the system."""
    path = FORMS[form](tmp_path, drive(400))
    found = Salvage(path, BagFormat.ROS1 if form == "ros1" else BagFormat.MCAP)
    walk = WALKS[found.form](found)
    first = [next(walk) for _ in range(3)]
    os.truncate(path, 100)
    rest = list(walk)
    assert len(first) + len(rest) < 1200
    assert "cut short" in found.damage


def test_a_database_whose_rows_never_end_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By its view at once, however large it is; else after more steps than its size can need."""
    (tmp_path / "a.db3").write_bytes(endless_rows())
    with pytest.raises(InputError, match="not all of it is tables"):
        read_bag(tmp_path / "a.db3")
    found = Salvage(next(write_ros2(tmp_path / "b", drive(100)).glob("*.db3")), BagFormat.SQLITE)
    monkeypatch.setattr("pilotage.logs.salvage.sqlite.STEPS", 10)
    monkeypatch.setattr("pilotage.logs.salvage.sqlite.MOST_A_BYTE", 0)
    assert len(list(WALKS[found.form](found))) < 300
    assert "rows without end" in found.damage


PACKED = ["ros1-bz2", "ros1-lz4", "foreign-mcap", "foreign-mcap-lz4", "ros2-sqlite-zstd-messages"]


@pytest.mark.parametrize(
    ("form", "limit", "most"),
    [
        *((form, "PART_BYTES", 10) for form in PACKED),
        *((form, "BAG_BYTES", -(10**7)) for form in (*PACKED, "ros2-sqlite-zstd-file")),
    ],
)
def test_a_part_that_unpacks_to_too_much_is_refused(
    form: str, limit: str, most: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A chunk of 180 kB stood for 6 GB, in the library as in the walk through a damaged bag."""
    path = FORMS[form](tmp_path, drive(3))
    monkeypatch.setattr(unpacking, limit, most)
    with pytest.raises(InputError, match=r"expected at most .* MB, found more"):
        read_bag(path)


def test_values_that_a_database_makes_up_are_not_read(tmp_path: Path) -> None:
    """40 rows of 900 MB each came out of 40 kB."""
    path = write_ros2(tmp_path / "a", drive())
    with contextlib.closing(sqlite3.connect(path / "a.db3")) as base, base:
        base.executescript(
            """alter table messages rename to written;
            create table messages (id, topic_id, timestamp, data as (zeroblob(900000000)));
            insert into messages select id, topic_id, timestamp from written;"""
        )
    with pytest.raises(InputError, match="too big"):
        read_bag(path)
    with contextlib.closing(sqlite3.connect(path / "a.db3")) as base, base:
        base.executescript(
            """drop table messages;
            create view messages as select a.* from written a, written b, written c, written d;"""
        )
    with pytest.raises(InputError, match="not all of it is tables"):
        read_bag(path)


def test_a_cut_bag_of_packed_messages(tmp_path: Path) -> None:
    path = write_ros2(tmp_path / "a", drive(400, 90), packing="MESSAGE")
    data = (path / "a.db3").read_bytes()
    (path / "a.db3").write_bytes(data[: 3 * len(data) // 4])
    log = read_bag(path)
    assert 200 < len(log) < 400
    assert any("cut short" in said for said in log.warnings)


def test_what_is_no_bag(tmp_path: Path) -> None:
    text = tmp_path / "a.bag"
    text.write_text("no bag")
    for path in (text, tmp_path):
        with pytest.raises(InputError, match="expected a ROS 1 bag, a ROS 2 bag"):
            read_bag(path)
    with pytest.raises(InputError, match="no such file"):
        read_bag(tmp_path / "missing.bag")
    text.write_bytes(b"#ROSBAG V2.0\n")
    with pytest.raises(InputError, match=r"none that can be read: a\.bag: the bag is cut short"):
        read_bag(text)


def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_ros1(tmp_path / "a.bag", drive())
    for name in [name for name in sys.modules if name.split(".")[0] == "rosbags"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "rosbags", None)
    with pytest.raises(InputError, match=r"pip install -e '\.\[ros\]'"):
        read_bag(path)


@pytest.fixture(scope="module")
def small_bags(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    out = {}
    for form in CUT_FORMS:
        folder = tmp_path_factory.mktemp(form)
        out[form] = FORMS[form](folder, drive(10, 5)).read_bytes()
    return out


@pytest.mark.parametrize("form", CUT_FORMS)
def test_damaged_bytes_are_one_line_or_a_log(tmp_path: Path, small_bags: dict[str, bytes], form: str) -> None:
    """No other error than ours, whatever bytes are changed and wherever the file ends."""
    suffix = ".bag" if form in {"ros1", "ros1-bz2", "ros1-lz4"} else ".db3" if "sqlite" in form else ".mcap"
    for seed in range(20):
        path = tmp_path / f"{seed}{suffix}"  # to write over the last one waits for the disk
        rng = np.random.default_rng(seed)
        whole = bytearray(small_bags[form])
        for _ in range(rng.integers(1, 9)):
            whole[rng.integers(0, len(whole))] = rng.integers(0, 256)
        cut = len(whole) if seed % 3 else int(rng.integers(len(whole) // 4, len(whole)))
        path.write_bytes(bytes(whole[:cut]))
        with contextlib.suppress(InputError):
            log = read_bag(path)
            assert len(log) > 0
            assert (np.diff(log.t_s) >= 0.0).all()
