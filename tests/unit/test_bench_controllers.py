"""``pilotage bench controllers``: courses of many kinds, their bounds, what is counted and left."""

from __future__ import annotations

import csv
import json
import math
import re
import sqlite3
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from pilotage.cli.main import main
from pilotage.evaluation.courses import CourseRun, summarize_courses
from pilotage.experiments import barn_benchmark, controller_benchmark
from pilotage.experiments.controller_benchmark import CourseRequest, drive_course
from pilotage.experiments.course_driving import course_base
from pilotage.experiments.course_families import Course, Driver, make_course_of
from pilotage.maps.segment_map import SegmentMap
from pilotage.models.footprint import Footprint
from pilotage.models.motion.differential_drive import DifferentialDriveConfig
from pilotage.report.barn.controllers import ControllersPage, controllers_page
from support.fuzz_targets import BY_NAME

JACKAL = np.array([[0.254, 0.215], [-0.254, 0.215], [-0.254, -0.215], [0.254, -0.215]])
DRIVER = Driver(Footprint.polygon(JACKAL), JACKAL, DifferentialDriveConfig(max_speed_m_s=2.0))
STRAIGHT = "stack.navigator={name: open-loop, speed_m_s: 1.0, turn_rate_rad_s: 0.0, duration_s: 90.0}"
PLUGIN = """
from pilotage.core.config import Config
from pilotage.core.types import Twist
from pilotage.stack.control.local.role import LOCAL_CONTROLLERS

class CarefulConfig(Config):
    '''Nothing to say.'''

@LOCAL_CONTROLLERS.add("careful", CarefulConfig)
class Careful:
    '''Stays where it is.'''
    status = "waiting"
    def __init__(self, config, generator): pass
    def step(self, view): return Twist(0.0, 0.0)
"""


def drawn(family: str, number: int = 0, seed: int = 1) -> Course:
    course = make_course_of(family, number, seed, DRIVER)
    assert course is not None
    return course


def bench(out: Path, *more: str) -> int:
    common = ("--courses", "1", "--trials", "1", "--workers", "1", "--replays", "0", "--json")
    return main(["bench", "controllers", *common, "--out", str(out), *more])


@pytest.mark.parametrize("family", ["doors", "corridor", "crowd"])
def test_courses_have_room_where_they_begin_and_end_and_a_bound(family: str) -> None:
    for number in range(8):
        course = drawn(family, number)
        world = course.settings["world.map"]
        floor = SegmentMap(np.array(world["walls_m"]), np.zeros((0, 3)), tuple(world["bounds_m"]))
        for key in ("world.start", "world.goal"):
            place = course.settings[key]
            assert floor.distance_m(place["x_m"], place["y_m"]) > 0.3, key
        away = math.hypot(
            *(course.settings["world.goal"][k] - course.settings["world.start"][k] for k in ("x_m", "y_m"))
        )
        assert course.bound_s > (away - 1.0) / 2.0
    assert drawn(family, 3).settings == drawn(family, 3).settings
    assert drawn(family, 3).settings != drawn(family, 3, seed=2).settings


def test_openings_narrower_than_the_robot_have_no_way_and_all_others_have_one() -> None:
    """The body is 0.43 m wide: what can be driven straight is never called closed."""
    assert make_course_of("bottleneck-0.40", 0, 1, DRIVER) is None
    for number in range(4):
        assert drawn("bottleneck-0.44", number).bound_s > 3.0
    assert drawn("bottleneck-0.60").bound_s > 3.0


@pytest.mark.parametrize("number", [0, 1])
def test_openings_little_wider_than_the_robot_are_driven_through(number: int) -> None:
    """2.5 cm of room on either side, under a laser noise of 1 cm; with 1.5 cm a third are (decision 0248)."""
    request = CourseRequest(("bottleneck-0.48",), ("gap-horizon",))
    run = drive_course(request, course_base(), drawn("bottleneck-0.48", number), 0, "gap-horizon")
    assert run.success, run


def rooms(path: Path, opening_m: float) -> str:
    """A ROS map of two rooms of 3 m by 3 m with an opening between, 5 cm a cell; its file's name."""
    cells = np.full((66, 130), 254, dtype=np.uint8)
    cells[[0, 1, -1, -2]] = cells[:, [0, 1, 64, 65, -1, -2]] = 0
    cells[33 - round(opening_m / 0.1) : 33 + round(opening_m / 0.1), 64:66] = 254
    (path / "rooms.pgm").write_bytes(b"P5 130 66 255\n" + cells.tobytes())
    text = "image: rooms.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n"
    (path / "rooms.yaml").write_text(text + "occupied_thresh: 0.65\nfree_thresh: 0.2\n")
    return str(path / "rooms.yaml")


@pytest.mark.parametrize(("opening_m", "crosses"), [(0.3, False), (0.6, True)])
def test_on_a_map_ways_lead_through_what_the_outline_fits(
    tmp_path: Path, opening_m: float, crosses: bool
) -> None:
    """The disc around the robot, 0.67 m wide, fits through neither."""
    file = rooms(tmp_path, opening_m)

    def leads_through(number: int) -> bool:
        places = drawn(file, number).settings
        return bool((places["world.start"]["x_m"] < 3.25) != (places["world.goal"]["x_m"] < 3.25))

    assert any(map(leads_through, range(12))) == crosses


def test_what_is_drawn_on_a_map_is_the_same_wherever_it_lies_and_is_called_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "there").mkdir()
    file, copy = rooms(tmp_path, 0.6), rooms(tmp_path / "there", 0.6)
    monkeypatch.chdir(tmp_path)
    courses = [drawn(one).settings for one in (file, copy, "rooms.yaml", "./there/rooms.yaml")]
    for key in ("world.start", "world.goal"):
        assert [course[key] for course in courses[1:]] == 3 * [courses[0][key]]


def test_places_are_found_on_a_map_where_few_lie_far_enough_apart(tmp_path: Path) -> None:
    """Whoever stands in the middle of such a room has no goal: of pairs drawn by lot few count."""
    file = rooms(tmp_path, 0.3)
    for number in range(40):
        places = drawn(file, number).settings
        start, goal = (
            np.array([places[key][axis] for axis in ("x_m", "y_m")]) for key in ("world.start", "world.goal")
        )
        assert 2.5 <= math.hypot(*(goal - start)) <= 12.0


def test_a_crossing_begins_where_nobody_stands(tmp_path: Path) -> None:
    path = tmp_path / "tracks.txt"
    path.write_text("".join(f"{10 * k}\t1\t{0.1 * k:.2f}\t0.0\n" for k in range(200)))
    course = drawn(str(path))
    assert course.people[0]["begins_s"] <= 60.0
    start, goal = course.settings["world.start"], course.settings["world.goal"]
    assert math.hypot(start["x_m"] - goal["x_m"], start["y_m"] - goal["y_m"]) == pytest.approx(12.0)


def test_numbers_of_runs() -> None:
    runs = [
        CourseRun("doors", 0, 0, True, False, False, 12.0, 10.0, 6.0, 0, 1, 0.2, 0.1),
        CourseRun("doors", 0, 1, False, True, False, 3.0, 10.0, 7.0, 1, 0, 0.0, 0.3),
        CourseRun("doors", 1, 0, True, False, False, 8.0, 5.0),
    ]
    found = summarize_courses(runs)
    assert (found.success, found.collision, found.trials, found.courses) == (2 / 3, 1 / 3, 3, 2)
    assert found.over_bound == pytest.approx(0.5 * (1.2 + 1.6))
    assert found.time_lost == pytest.approx(1.0)
    assert (found.people_collisions, found.people_touches, found.closest_m) == (1, 1, 0.0)
    assert found.near_share == pytest.approx(0.2)


@pytest.mark.parametrize("name", ["runs.csv", "runs.sqlite", "summary.json", "report.html"])
@pytest.mark.parametrize("use", ["bench barn", "bench controllers map"])
def test_where_something_else_stands_nothing_is_driven(
    use: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """All courses were, and the other files were left in the folder."""
    monkeypatch.chdir(tmp_path)
    BY_NAME[use].write(tmp_path)
    (tmp_path / "out" / name).mkdir(parents=True)
    monkeypatch.setattr(barn_benchmark, "bench_barn", Mock())
    monkeypatch.setattr(controller_benchmark, "bench_controllers", Mock())
    assert main(list(BY_NAME[use].words)) == 2
    assert capsys.readouterr().err == f"pilotage: out/{name}: expected a place for a file, found a folder\n"
    assert [path.name for path in (tmp_path / "out").iterdir()] == [name]


def test_it_drives_judges_and_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A plugin's controller that stands, among walkers; and one that drives ahead into what comes."""
    plugin, out = tmp_path / "careful.py", tmp_path / "out"
    plugin.write_text(PLUGIN)
    limit = ("--set", "robot.motion.max_speed_m_s=1.0")
    assert (
        bench(out, "crowd", "bottleneck-0.36", "--plugin", str(plugin), "--controller", "careful", *limit)
        == 0
    )
    said = capsys.readouterr()
    assert "bottleneck-0.36: 1 of 1 courses without a way" in said.err
    answer = json.loads(said.out)
    assert answer["without_way"] == {"bottleneck-0.36": 1}
    found = answer["controllers"]["careful"]
    assert (found["timeout"], found["people_collisions"], found["trials"]) == (1.0, 0, 1)
    assert found["families"]["crowd"]["near_share"] >= 0.0
    with (out / "runs.csv").open() as file:
        row = next(csv.DictReader(file))
    base = sqlite3.connect(out / "runs.sqlite")
    assert base.execute("SELECT family, timeout, time_s FROM runs").fetchall() == [("crowd", 1, 100.0)]
    base.close()
    assert (row["family"], row["timeout"], row["empty_s"]) == ("crowd", "1", "")
    page = (out / "report.html").read_text()
    assert "time within 0.5 m" in page

    own = ("--set", "stack.local_controller.speeds=6")  # of dwa, not of the mission's own controller
    assert bench(out, "doors", "--controller", "dwa", "--replays", "1", *own, "--set", STRAIGHT) == 0
    assert json.loads(capsys.readouterr().out)["controllers"]["dwa"]["collision"] == 1.0
    assert len(list((out / "replays").glob("*/report.html"))) == 1
    assert 'href="replays/doors-0-0-dwa' in (out / "report.html").read_text()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("nowhere.yaml",), "expected a map or tracks of people, or one of doors"),
        (("doors", "doors"), "found one twice"),
        (("doors", "--controller", "dwaa"), "did you mean 'dwa'"),
        (("bottleneck-0.36",), "found the robot too wide"),
        (("doors", "corridor", "--set", "robot.footprint={radius_m: 0.9}"), "found the robot too wide"),
        (("doors", "--set", "stack.local_controller.name=vfh"), "say --controller NAME"),
    ],
)
def test_bad_input_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...], words: str
) -> None:
    assert bench(tmp_path / "out", *more) == 2
    said = capsys.readouterr()
    assert words in said.err
    assert len(said.err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_the_page_names_whose_numbers_it_begins_with() -> None:
    """Of controllers that all arrive the first one's numbers stood there, whoever was faster."""

    def runs(good: bool, time_s: float) -> list[CourseRun]:
        return [CourseRun("doors", k, 0, good, False, not good, time_s + 0.1 * k, 2.0) for k in range(7)]

    times_s = {"lost": 9.0, "slow": 3.0, "fast": 2.2, "off": 8.0}
    made = {name: runs(time_s < 5.0, time_s) for name, time_s in times_s.items()}
    page = controllers_page(ControllersPage(made, {}))
    headline = re.search(
        r"fast: 100\.0.% of 7 runs on 7 courses arrive at (\S+) times the bound; slow: ", page
    )
    assert headline is not None
    assert float(headline[1]) == pytest.approx(2.5 / 2.0)
    assert "lost: 0.0\u00a0% of 7 runs on 7 courses arrive; off: " in page
    assert re.search(r"best controller</\w+>\s*<\w+>fast<", page)
    assert "1 is out of reach, less is better" in page
    # Signs are those of the rest of the page.
    apart = controllers_page(ControllersPage({name: made[name] for name in ("slow", "fast")}, {}))
    assert "−0.80 to −0.80" in apart
