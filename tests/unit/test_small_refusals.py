"""What was refused in words that help nobody, or not at all: now the sentence says what is wrong."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from pilotage.cli.main import main
from pilotage.cli.options import parse_seed
from pilotage.core.errors import InputError
from pilotage.core.whole_number import whole_number
from pilotage.experiments.build import team
from pilotage.experiments.build.build import build, build_source
from pilotage.experiments.build.charts import load_chart
from pilotage.experiments.build.places import check_place
from pilotage.experiments.mission import load_mission
from pilotage.experiments.studies.engine import run_study
from pilotage.experiments.studies.replay import parse_row
from pilotage.experiments.studies.sweep import sweep_study
from pilotage.maps.occupancy_grid import OccupancyGrid
from pilotage.maps.world_map import WorldMap
from pilotage.models.footprint import Footprint
from pilotage.stack.control.local.sampling import NoiseBank
from pilotage.tracking.robot_colour import parse_hsv

BOX = "{kind: bx, from_m: [1, 2], to_m: [3, 4]}"
LINE = "{points_m: [[-1, 0], [1, 0], [2, 0]]}"
FAR = "{name: crater, columns: 16, rows: 16, resolution_m: 1e8, craters_per_km2: 0, landmarks_per_km2: 0}"
WALL = "{kind: box, from_m: [4, 4], to_m: [5, 4]}"


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ([f"world.obstacles=[{BOX}]"], "world.obstacles.0.kind: unknown value 'bx'; did you mean 'box'?"),
        ([f"robot.footprint={LINE}"], "found all of them on one line"),
        (
            [f"world.obstacles=[{WALL}]", "world.kidnaps=[{at_s: 5, to: {x_m: 4.5, y_m: 4}}]"],
            "world.kidnaps.0.to: expected room for the robot's footprint",
        ),
        (["robot.faults=[{name: drop, sensor: lidar, share: 3}]"], "robot.faults.0.share"),
        (["robot.footprint={points_m: [[0, 0], [1, 0], [1, 1, 2]]}"], "expected at most 2 items, found 3"),
    ],
)
def test_missions(settings: list[str], words: str) -> None:
    with pytest.raises(InputError) as caught:
        build_source(load_mission("museum-1", ["world.obstacles=[]", *settings], 0))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("mission", "setting", "words"),
    [
        # Arrays larger than any, in a traceback.
        ("museum-1", "stack.mapper.cell_m=1e-9", "greater than or equal to 0.001"),
        ("museum-unknown", "stack.navigator.map_resolution_m=1e-9", "greater than or equal to 0.005"),
        ("museum-unknown", "stack.navigator.resolution_m=1e-9", "greater than or equal to 0.005"),
        # An arc that was followed without an end.
        ("museum-1-fast", "stack.local_controller={name: dwa, horizon_s: 1e9}", "less than or equal to 100"),
        # Trees of twigs that go nowhere, for minutes.
        ("museum-1", "stack.planner.max_connection_distance_m=1e-5", "greater than or equal to 0.1"),
        # 13 GB before it was refused, where there were so many.
        ("gale-pose", "world.map={name: crater, rows: 100000}", "expected at most 1,024 MB, found 12,600 MB"),
        # A run whose page could not be made of its own folder.
        ("museum-walls", "robot.sensors.lidar.max_range_m=1e15", "less than or equal to 1000000"),
        ("gale-pose", f"world.map={FAR}", r"found up to 1\.6e\+09; is the resolution right\?"),
    ],
)
def test_what_no_memory_holds_and_no_run_ends_with(mission: str, setting: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        build_source(load_mission(mission, [setting], 0))


def test_who_explores_nothing_is_refused_before_it_drives() -> None:
    """It drove to the end, and then its judge missed the map."""
    with pytest.raises(InputError, match=r"makes cells and left and visited, .* found 'open-loop'"):
        build(load_mission("romi-explore", ["stack.navigator=open-loop", "run.oracles=[localizer]"], 0))
    # On a floor its localizer makes a grid, for its own use: who drives by the clock explored nothing.
    with pytest.raises(InputError, match=r"makes grid, .* found 'open-loop'"):
        build(load_mission("museum-unknown", ["stack.navigator=open-loop"], 0))


@pytest.mark.parametrize(
    ("mission", "changes", "named"),
    [
        ("museum-unknown", ["task=reach", "world.goal={x_m: 20, y_m: 12}"], "task 'reach'.*'floor-frontier'"),
        ("museum-unknown", ["task={name: follow, points_m: [[3, 1]]}"], "task 'follow'.*'floor-frontier'"),
        ("museum-unknown", ["task=sweep-floor"], "task 'sweep-floor'.*'floor-frontier'"),
        ("museum-patrol", ["stack.navigator=floor-frontier"], "task 'patrol'.*'floor-frontier'"),
        ("romi-explore", ["task=reach", "world.goal={x_m: 0.9, y_m: 0.9}"], "task 'reach'.*'frontier'"),
    ],
)
def test_who_chooses_its_places_is_refused_for_others(mission: str, changes: list[str], named: str) -> None:
    """It explored, and was told that it ended 160 m from its goal."""
    with pytest.raises(InputError, match=named):
        build(load_mission(mission, changes, 0))


@pytest.mark.parametrize("localizer", ["slam", "dead-reckoning"])
def test_who_never_looks_at_the_map_patrols_from_a_start_that_is_known(localizer: str) -> None:
    """A heading told to 0.1 rad is metres at the far end, for good: robots stood before walls that were not
    where they believed, "deadlocked from 38 s on"."""
    start = ["x_var_m2", "y_var_m2", "theta_var_rad2"]
    known = [f"stack.initial.{name}=0.00001" for name in start]
    changes = [f"stack.localizer.name={localizer}", "team.size=1"]
    build(load_mission("museum-patrol", [*changes, *known], 0))
    with pytest.raises(InputError, match=r"up to \d+\.\d m at .*; take stack\.localizer: laser, or"):
        build(load_mission("museum-patrol", changes, 0))


@pytest.mark.parametrize(
    ("cells", "told"),
    [
        ([[0, 100], [-1, 0]], r"found an unknown cell at \(1, 1\); move it$"),
        ([[0, 0], [100, 0]], r"found an occupied cell at \(1, 1\); move it$"),
        ([[-1, 100], [100, -1]], r"found an occupied cell .* no cell of the map is free: check negate, mode"),
    ],
)
def test_a_place_in_no_free_cell_is_told_so(cells: list[list[int]], told: str) -> None:
    """It was told "0.000 m to the nearest wall; make the body smaller", where all of a map was unknown."""
    grid = OccupancyGrid(np.array(cells, np.int8), 2.0)
    chart = WorldMap("cells", (0.0, 0.0, 4.0, 4.0), grid=grid)
    with pytest.raises(InputError, match=f"world.start: expected a free cell, {told}"):
        check_place("world.start", 1.0, 1.0, Footprint.disc(0.2), chart)
    if cells[0][0] == 0:
        check_place("world.start", 1.0, 3.0, Footprint.disc(0.2), chart)


def test_a_speed_beyond_the_motions_is_told_by_whose_it_is() -> None:
    """It named ``robot.motion.max_speed_m_s``, a key that a motion by its wheels does not have."""
    wheels = ["robot.motion=wheel-drive"]
    with pytest.raises(
        InputError, match=r"at most the top speed of 'robot' by its motion, 0\.105 m/s, found"
    ):
        build(load_mission("museum-1", wheels, 0))


def test_hits_are_counted_only_where_there_is_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pilotage.maps.memory.available_bytes", lambda: 10**9)
    with pytest.raises(InputError, match=r"stack\.mapper: counting hits in cells: needs about .* GB"):
        build(load_mission("museum-1", ["stack.mapper.cell_m=0.001"], 0))


def test_the_parts_that_a_navigator_misses_are_named() -> None:
    settings = ["stack.local_planner=null", "stack.controller=null"]
    with pytest.raises(InputError, match=r"found no stack\.local_planner and no stack\.controller"):
        build(load_mission("museum-1", settings, 0))


def test_a_ros_map_without_its_image_says_so(tmp_path: Path) -> None:
    path = tmp_path / "hall.yaml"
    path.write_text("resolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n")
    with pytest.raises(InputError, match="image: missing; a ROS map names its image"):
        build_source(load_mission("museum-1", [f"world.map={path}"], 0))


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.map", "type octile\nheight 2\nwidth 2\nmap\n..\n..\n..\n", "expected 2 rows, as its header says"),
        (
            "a.yaml",
            "map: a\nwalls_m: [[0, 0, 4, 3], [1, 1, 1, 1]]\n",
            "walls_m.1: expected a wall from one place to",
        ),
        (
            "a.yaml",
            "image: a.pgm\nresolution: 1\norigin: [0, 0, 0]\nfree_thresh: 0.7\noccupied_thresh: 0.6\n",
            "expected free_thresh at most occupied_thresh 0.6, found 0.7",
        ),
    ],
)
def test_maps_that_were_taken_silently_or_refused_with_all_they_hold(
    name: str, text: str, words: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=re.escape(words)) as caught:
        load_chart(str(tmp_path / name))
    assert "{" not in str(caught.value)


def test_more_samples_than_memory_holds_are_refused_before_they_are_drawn() -> None:
    with pytest.raises(InputError, match="expected at most 1,000,000 commands to sample"):
        NoiseBank(np.random.default_rng(0), 192, 1_600_000_000, 0.5, 1.0)


def test_values_of_a_sweep_that_cannot_be_built_are_told_before_the_first_trial(tmp_path: Path) -> None:
    study = sweep_study("museum-plan", ["robot.sensors.lidar.rate_hz=10,7"], [], 2, [])
    with pytest.raises(
        InputError, match=r"cell 'rate_hz=7': robot\.sensors\.lidar\.rate_hz: expected a whole"
    ):
        run_study(study, tmp_path / "sweep")
    assert not (tmp_path / "sweep").exists()


@pytest.mark.parametrize("digits", ["²", "١٢", "9" * 5000, "1_0", "-1", ""])
def test_what_looks_like_a_whole_number_and_is_none(digits: str, tmp_path: Path) -> None:
    assert whole_number(digits) is None
    for refused, words in (
        (lambda: parse_row(f"{tmp_path}:{digits}"), "expected STUDY:ROW"),
        (lambda: parse_seed(digits), "expected a whole number"),
        (lambda: parse_hsv(f"1,2,3,4,5,{digits}"), "six whole numbers"),
    ):
        with pytest.raises(InputError, match=words):
            refused()


def test_a_landmark_beyond_all_integers_is_refused(tmp_path: Path) -> None:
    table = tmp_path / "landmarks.csv"
    table.write_text(f"id,x_m,y_m\n1{'0' * 400},1,2\n")
    with pytest.raises(InputError, match="line 2: expected an id within"):
        build_source(load_mission("museum-1", [f"world.landmarks={table}"], 0))


@pytest.mark.parametrize("mission", ["museum-1", "museum-2"])
@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (
            ["robot.sensors.lidar.rate_hz=7"],
            "robot.sensors.lidar.rate_hz: expected a whole fraction of 10 Hz",
        ),
        (["robot.sensors.it=bumper", "run.dt_s=0.25"], "found 10; take 4, or run.dt_s: 0.1"),
        (["robot.motion.delay_s=0.05"], "robot.motion.delay_s: expected a multiple of run.dt_s"),
        (["robot.faults=[{name: drop, sensor: laser}]"], "robot.faults.0.sensor"),
        (
            ["robot.sensors.wheels={name: wheel-encoders}"],
            "wheel-encoders need a motion whose wheels are known",
        ),
    ],
)
def test_what_no_simulator_serves_is_refused_before_anything_is_planned(
    monkeypatch: pytest.MonkeyPatch, mission: str, settings: list[str], words: str
) -> None:
    """Plans took 6 to 12 s on terrain before a rate was found not to fit the clock."""
    monkeypatch.setattr(team, "build_stack", lambda *_: pytest.fail("it planned first"))
    with pytest.raises(InputError) as caught:
        build(load_mission(mission, settings, 0))
    assert words in str(caught.value)


def test_a_strategy_without_a_patrol_is_refused() -> None:
    """It was taken, and nothing ever asked it."""
    with pytest.raises(InputError, match=r"team\.strategy: expected task 'patrol', found 'reach'"):
        build(load_mission("museum-1", ["team.strategy=cyclic"], 0))


def test_starts_of_a_team_are_told_by_the_name_they_were_given_under() -> None:
    with pytest.raises(
        InputError,
        match=r"^team\.starts\.0: expected a mapping with keys of theta_rad, x_m, y_m, found \[1, 1\]",
    ):
        load_mission("museum-patrol", ["team.size=2", "team.starts=[[1, 1], [3, 3]]"], 0)


def test_a_laser_too_coarse_for_the_smallest_mate_is_refused() -> None:
    """As if all were as wide as the robot itself a wide one met a small one by one beam."""
    small = "{footprint: {radius_m: 0.2}, sensors: {lidar: {name: lidar, rate_hz: 5, beams: 360}}}"
    wide = "{footprint: {radius_m: 0.4}}"
    beams = "robot.sensors.lidar.beams=40"
    build(load_mission("museum-patrol", [f"robots=[{wide}, {wide}]", "team.size=2", beams], 0))
    with pytest.raises(InputError, match=r"beams: expected \d+ or more, .* found 40$"):
        build(load_mission("museum-patrol", [f"robots=[{wide}, {small}]", "team.size=2", beams], 0))


@pytest.mark.parametrize(
    ("settings", "least"),
    [(["robot.sensors.lidar.beams=24"], 36), (["robot.motion.max_speed_m_s=0.3"], None)],
)
def test_a_laser_too_coarse_for_a_team_is_refused(settings: list[str], least: int | None) -> None:
    """A mate was met by one beam alone, which may be dust, and robots ran into each other."""
    settings = ["robot.sensors.lidar.beams=24", *settings]
    if least is None:
        build(load_mission("museum-patrol", settings, 0))
        return
    words = rf"^robot\.sensors\.lidar\.beams: expected {least} or more, .* found 24$"
    with pytest.raises(InputError, match=words):
        build(load_mission("museum-patrol", settings, 0))
    build(load_mission("museum-patrol", [*settings, "team.size=1"], 0))


@pytest.mark.parametrize(
    ("command", "file", "told"),
    [
        (
            ["run"],
            "study: a\nmission: museum-1\n",
            "expected a mission, found a study; 'pilotage study' takes it",
        ),
        (
            ["run"],
            "walls_m: []\n",
            "expected a mission, found a map; 'pilotage draw' takes it, and world.map",
        ),
        (["run"], "image: a.png\nresolution: 0.05\n", "expected a mission, found a map;"),
        (["sweep"], "study: a\n", "expected a mission, found a study;"),
        (["study"], "extends: museum-1\n", "expected a study, found a mission; 'pilotage run' takes it"),
        (["study"], "extends: museum-1\nimage: a.png\n", "expected a study, found a mission;"),
        (["draw"], "extends: museum-1\n", "expected a map, found a mission;"),
        (["plan", "--start", "1,1", "--goal", "2,2"], "study: a\n", "expected a map, found a study;"),
    ],
)
def test_a_file_of_another_kind_is_told_as_what_it_is(
    command: list[str], file: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A mission that was drawn was refused for "extends: unknown key", a study that was run for "study"."""
    path = tmp_path / "mine.yaml"
    path.write_text(file)
    assert main([*command, str(path)]) == 2
    assert f"mine.yaml: {told}" in capsys.readouterr().err
