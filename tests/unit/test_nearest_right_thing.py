"""Bad input of a stranger's: one line that names the nearest right thing."""

from __future__ import annotations

from pathlib import Path

import pytest

from pilotage.core.errors import InputError
from pilotage.core.neighbours import hint_beside
from pilotage.core.plugins import add_plugins
from pilotage.experiments.mission import load_mission
from pilotage.experiments.studies.definition import StudyDefinition
from pilotage.experiments.studies.engine import Listener, run_study
from pilotage.experiments.studies.options import StudyOptions
from pilotage.experiments.studies.study import Study, make_study

ONE = StudyOptions(workers=1)


def refused(*overrides: str) -> str:
    """What a mission with these settings says."""
    with pytest.raises(InputError) as refusal:
        load_mission("museum-1", overrides=list(overrides))
    return str(refusal.value)


@pytest.mark.parametrize(
    ("override", "place"),
    [
        ("robot.radius_m=0.2", "robot.footprint.radius_m"),
        ("robot.max_speed_m_s=0.2", "robot.motion.max_speed_m_s"),
        ("world.time_limit_s=3", "run.time_limit_s"),
        ("stack.gate=0.9", "stack.localizer.gate"),
        ("robot.beams=30", "robot.sensors.lidar.beams"),
        ("goal.x_m=3", "world.goal"),
        ("localizer=ekf-walls", "stack.localizer"),
        ("world.landmark=[]", "landmarks"),
    ],
)
def test_a_key_at_the_wrong_place_is_told_the_right_one(override: str, place: str) -> None:
    assert refused(override).endswith(f"did you mean '{place}'?")


def test_a_key_of_nothing_is_told_what_there_is() -> None:
    assert "known keys: goal, kidnaps" in refused("world.wombat=3")


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("{walls_m: [[0, 0, 10, 0]]}", "the map's own name, such as 'map: room', beside its walls"),
        ("{file: a.png}", "world.map.name: missing; expected grid or elevation beside file"),
        ("{image: a.pgm, resolution: 0.05}", "expected a ROS map by its own file"),
    ],
)
def test_a_map_in_the_mission_is_told_what_it_lacks(value: str, said: str) -> None:
    assert said in refused(f"world.map={value}")


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        (
            ["robot.footprint={radius_m: 0.3, points_m: []}"],
            "robot.footprint.radius_m: unknown key; known keys: name, points_m",
        ),
        (
            ["robot.footprint={name: disc, points_m: []}"],
            "robot.footprint.points_m: unknown key; known keys: name, radius_m",
        ),
        (
            ["robot.footprint={name: square, radius_m: 0.3}"],
            "robot.footprint: unknown value 'square'; known: disc, polygon",
        ),
        (
            ["robots=[{footprint: {name: polygn}}]"],
            "robots.0.footprint: unknown value 'polygn'; did you mean 'polygon'?",
        ),
        (
            ["world.obstacles=[{kind: box, radius_m: 0.3}]"],
            "world.obstacles.0.radius_m: unknown key; known keys: from_m, kind, thickness_m, to_m",
        ),
        (
            ["run.time_limit_s=0.01"],
            "run.time_limit_s: expected at least one step of run.dt_s = 0.1 s, found 0.01",
        ),
    ],
)
def test_what_belongs_to_another_alternative_is_told_what_this_one_takes(
    overrides: list[str], said: str
) -> None:
    """The place is told as the file has it, and nobody is sent to where he is."""
    assert refused(*overrides) == said


def test_a_folder_is_called_so_and_a_shipped_mission_needs_no_suffix(tmp_path: Path) -> None:
    for name in ("mine.yaml", "mine.py"):
        (tmp_path / name).mkdir()
    with pytest.raises(InputError, match=r"expected a YAML file, found a folder$"):
        load_mission(str(tmp_path / "mine.yaml"))
    with pytest.raises(InputError, match=r"expected a YAML file of parameters, found a folder$"):
        load_mission("museum-1", overrides=[f"@{tmp_path / 'mine.yaml'}"])
    with pytest.raises(InputError, match=r"expected a Python file, found a folder$"):
        add_plugins([str(tmp_path / "mine.py")])
    with pytest.raises(InputError, match="did you mean the shipped mission 'museum-1'"):
        load_mission("museum-1.yaml")


def test_a_missing_file_is_told_its_neighbour(tmp_path: Path) -> None:
    (tmp_path / "beeline.py").touch()
    (tmp_path / "beeline.txt").touch()
    with pytest.raises(InputError, match=r"did you mean '.*/beeline\.py'\?$"):
        add_plugins([str(tmp_path / "beelin.py")])
    with pytest.raises(InputError, match=r"beside it there is beeline\.py$"):
        add_plugins([str(tmp_path / "zzz.py")])
    with pytest.raises(InputError, match=r"there is no folder '.*/nowhere'$"):
        add_plugins([str(tmp_path / "nowhere" / "beeline.py")])
    assert hint_beside(tmp_path / "hall.png", {".png"}) == ""


def study(**definition: object) -> Study:
    """A study of one planning query."""
    values = {"study": "small", "mission": "museum-plan", "trials": 2, **definition}
    return make_study(StudyDefinition.model_validate(values), Path())


def test_a_study_of_which_nothing_can_be_built_is_refused_and_leaves_nothing(tmp_path: Path) -> None:
    nothing = study(set={"stack.planner": None}, factors=[{"key": "world.start.x_m", "values": [1.0, 2.0]}])
    told: list[str] = []
    folder = tmp_path / "out" / "small"
    with pytest.raises(InputError, match=r"no other can be built.*expected world\.goal and stack\.planner"):
        run_study(nothing, folder, ONE, Listener(trouble=told.append))
    assert told == []
    assert not (tmp_path / "out").exists()


def test_a_level_that_cannot_be_built_is_a_row_that_is_told(tmp_path: Path) -> None:
    levels = {"without": {"stack.planner": None}, "with": {"stack.planner": "theta-star"}}
    some = study(factors=[{"name": "planner", "levels": levels}])
    told: list[str] = []
    counts = run_study(some, tmp_path / "small", ONE, Listener(trouble=told.append))
    assert (counts.done, counts.failed) == (2, 2)
    assert len(told) == 2
    assert all("expected world.goal and stack.planner" in line for line in told)


def test_a_study_may_take_a_sensor_off() -> None:
    assert study(set={"robot.sensors.beacons": None})
    with pytest.raises(InputError, match=r"unknown key 'beacon'; did you mean 'robot\.sensors\.beacons'"):
        study(set={"robot.sensors.beacon": None})
