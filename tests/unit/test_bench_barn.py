"""``pilotage bench barn`` on small courses written here: how it judges, what it counts apart and leaves."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from pilotage.cli.main import main
from pilotage.experiments.barn_bounds import has_way
from pilotage.experiments.course_driving import led_by
from pilotage.experiments.values import parse_override
from pilotage.logs.barn import START, BarnWorld, path_clearance_m

KEYS = {
    "metric",
    "success",
    "collision",
    "timeout",
    "time_s",
    "over_bound",
    "trials",
    "worlds",
    "worlds_without_way",
}
JACKAL = np.array([[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]])
SIDES = [(x, y) for x in (-4.2, -0.3) for y in np.arange(1.0, 9.6, 0.14)]
BOTTOM = [(x, 1.0) for x in np.arange(-4.2, -0.2, 0.14)]
SHUT = [(x, 4.0) for x in np.arange(-4.2, -0.2, 0.14)]
"""A metre ahead of the start: that nothing leads through is known once all poses before it were tried."""
AHEAD = [(START[0], 6.0)]
STRAIGHT = (
    "--set",
    "stack.navigator={name: open-loop, speed_m_s: 1.0, turn_rate_rad_s: 0.0, duration_s: 90.0}",
)
"""Drives ahead and looks at nothing."""


def courses(folder: Path, *posts: Sequence[tuple[float, float]]) -> Path:
    """A folder of courses 0, 1, ... whose lane holds these posts."""
    folder.mkdir(exist_ok=True)
    cylinders, paths, worlds = (
        ["world,x_m,y_m"],
        ["world,k,x_m,y_m"],
        ["world,cylinders,path_length_m,optimal_time_s"],
    )
    for number, inside in enumerate(posts):
        standing = SIDES + BOTTOM + list(inside)
        cylinders += [f"{number},{x:.3f},{y:.3f}" for x, y in standing]
        paths += [f"{number},0,-2.25,3.0", f"{number},1,-2.25,13.0"]
        worlds.append(f"{number},{len(standing)},10.0,5.0")
    for name, rows in (("cylinders", cylinders), ("paths", paths), ("worlds", worlds)):
        (folder / f"{name}.csv").write_text("\n".join(rows) + "\n")
    return folder


def bench(folder: Path, out: Path, *more: str) -> int:
    """The command with one trial and one process."""
    return main(
        ["bench", "barn", str(folder), "--trials", "1", "--workers", "1", "--out", str(out), "--json", *more]
    )


def rows_of(out: Path) -> list[dict[str, str]]:
    with (out / "runs.csv").open() as file:
        return list(csv.DictReader(file))


def test_it_judges_contact_and_arrival(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Straight ahead at 1 m/s from rest with 3 m/s^2: into a post, or until a metre before the goal."""
    folder = courses(tmp_path / "worlds", AHEAD, [])
    assert bench(folder, tmp_path / "out", "--replays", "0", *STRAIGHT) == 0
    answer = json.loads(capsys.readouterr().out)
    assert set(answer) == KEYS
    assert (answer["success"], answer["collision"], answer["timeout"]) == (0.5, 0.5, 0.0)
    assert (answer["trials"], answer["worlds"]) == (2, 2)
    hit, arrived = rows_of(tmp_path / "out")
    assert (hit["collision"], hit["metric"]) == ("1", "0")
    # To the post's surface less the robot's front; 1/6 s is lost by speeding up; a step is
    # 50 ms, and the first one passes before anything is commanded.
    assert float(hit["time_s"]) == pytest.approx(3.0 - 0.075 - 0.254 + 1.0 / 6.0 + 0.05, abs=0.06)
    assert arrived["success"] == "1"
    assert float(arrived["time_s"]) == pytest.approx(9.0 + 1.0 / 6.0 + 0.05, abs=0.06)
    assert float(arrived["metric"]) == 0.5
    assert answer["time_s"] == pytest.approx(float(arrived["time_s"]))
    page = (tmp_path / "out/report.html").read_text()
    assert "No published_*.csv" in page


def test_time_is_up_after_100_s(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    slow = STRAIGHT[1].replace("1.0", "0.01", 1)
    assert bench(courses(tmp_path / "worlds", []), tmp_path / "out", "--replays", "0", "--set", slow) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["timeout"], answer["metric"], answer["time_s"]) == (1.0, 0.0, None)
    assert rows_of(tmp_path / "out")[0]["time_s"] == "100"
    assert not re.search(r"\bnan\b", (tmp_path / "out/report.html").read_text())  # no time, no interval


def test_a_course_without_a_way_is_said_and_counted_apart(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = courses(tmp_path / "worlds", SHUT, AHEAD)
    (folder / "published_peer.csv").write_text(
        "world,succeeded,collided,timed_out,time_s\n1,1,0,0,20.0\n1,0,1,0,3.0\n7,1,0,0,9.0\n"
    )
    out = tmp_path / "out"
    assert bench(folder, out, "--replays", "1", "--controller", "gap-horizon", "--controller", "dwa") == 0
    said = capsys.readouterr()
    answer = json.loads(said.out)
    assert "world 0: no way through" in said.err
    for name in ("gap-horizon", "dwa"):
        assert set(answer[name]) == KEYS
        assert answer[name]["success"] == answer[name]["worlds"] == answer[name]["worlds_without_way"] == 1
    assert json.loads((out / "summary.json").read_text())["without_way"] == [0]
    page = (out / "report.html").read_text()
    for word in (
        "peer (Gazebo)",
        "metric: dwa minus gap-horizon",
        "time (s): dwa minus gap-horizon",
        "on 1 course, 1 run. 1 course with no way for this robot, not driven: 0",
    ):
        assert word in page
    assert not re.search(r"\bnan\b", page)
    # What is replayed is the run of the row.
    replays = {path.parent: json.loads(path.read_text()) for path in (out / "replays").glob("*/metrics.json")}
    assert len(replays) == 2
    times = {row["controller"]: float(row["time_s"]) for row in rows_of(out)}
    for path, metrics in replays.items():
        name = next(name for name in times if metrics["mission"].endswith(name))
        assert metrics["duration_s"] == pytest.approx(times[name])
        assert f"replays/{path.name}/report.html" in page
        assert (path / "report.html").is_file()


def test_rows_do_not_depend_on_the_number_of_workers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = courses(tmp_path / "worlds", AHEAD, [])
    for workers in ("1", "2"):
        out = tmp_path / workers
        assert bench(folder, out, "--replays", "0", "--seed", "4", "--workers", workers) == 0
    assert rows_of(tmp_path / "1") == rows_of(tmp_path / "2")
    assert len(capsys.readouterr().out.splitlines()) == 2


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--controller", "dwaa"), "did you mean 'dwa'"),
        (("--controller", "dwa", "--controller", "dwa"), "found one twice"),
        (("--set", "robot.footprint.points_m=[[2, 2], [-2, 2], [-2, -2], [2, -2]]"), "wider than the gaps"),
        (("--set", "robot.motion.name=bicycle"), "turns on the spot"),
        (("--set", "stack.navigatr=local"), "did you mean 'navigator'"),
    ],
)
def test_bad_input_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...], words: str
) -> None:
    assert bench(courses(tmp_path / "worlds", AHEAD), tmp_path / "out", *more) == 2
    said = capsys.readouterr()
    assert words in said.err
    assert len(said.err.splitlines()) == 1
    assert said.out == ""


def test_a_folder_without_the_files_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert bench(tmp_path, tmp_path / "out") == 2
    assert "missing: cylinders.csv, paths.csv, worlds.csv" in capsys.readouterr().err
    folder = courses(tmp_path / "worlds", SHUT)
    assert bench(folder, tmp_path / "out") == 2
    assert "wider than the gaps of all 1" in capsys.readouterr().err


@pytest.mark.parametrize(("gap_m", "fits"), [(0.34, False), (0.5, True), (0.9, True)])
def test_whether_there_is_a_way_is_said_for_the_true_outline(gap_m: float, fits: bool) -> None:
    """Narrower than the robot's 0.43 m, between that and the disc around it, and wider than both."""
    half = 0.5 * gap_m + 0.075
    left = [(START[0] - half - 0.14 * i, 6.0) for i in range(14)]
    right = [(START[0] + half + 0.14 * i, 6.0) for i in range(14)]
    posts = np.array(SIDES + BOTTOM + left + right)
    circles = np.column_stack([posts, np.full(len(posts), 0.075)])
    world = BarnWorld(0, circles, np.array([[-2.25, 3.0], [-2.25, 13.0]]), 10.0, 5.0)
    assert has_way(world, JACKAL) is fits
    assert path_clearance_m(world) == pytest.approx(0.5 * gap_m)


@pytest.mark.parametrize("name", ["dwa", """it's "new": <1>""", "null", "\u202ex"])
def test_a_controller_of_any_name_is_the_one_that_drives(name: str) -> None:
    """A plugin may call its controller as it likes; quotes in it were no YAML."""
    first, second = led_by(name, ("a.b=1",))
    assert parse_override(first) == (["stack", "local_controller", "name"], name)
    assert second == "a.b=1"
