"""Every key that mission files once had is refused with what it is called now."""

from __future__ import annotations

from typing import Any

import pytest

from pilotage.cli.main import main
from pilotage.core.errors import InputError
from pilotage.core.registry import RENAMED
from pilotage.experiments.mission import load_mission, mission_of, read_mission
from pilotage.missions.mission import Mission
from pilotage.missions.old_keys import OLD_KEYS, refuse_old_keys
from pilotage.stack.localization.localizer import LOCALIZERS
from support.missions import reach

LISTED = {
    "world.kind", "world.sheet", "world.ground", "world.tape_width_m", "world.floor_is_dark",
    "robot.body", "robot.errors", "robot.speed_m_s", "robot.wheelbase_m",
    "stack.explorer", "stack.estimator", "stack.pose_controller", "stack.spline", "stack.cost_map",
    "stack.fusion", "stack.avoidance", "stack.magnetometer", "stack.firmware", "stack.ellipse_probability",
}  # fmt: skip


def test_none_is_forgotten() -> None:
    assert set(OLD_KEYS) == LISTED


@pytest.mark.parametrize("old", sorted(OLD_KEYS))
def test_an_old_key_is_refused_with_the_new_one(old: str) -> None:
    top, key = old.split(".")
    values = reach()
    values[top][key] = "anything"
    with pytest.raises(InputError) as caught:
        mission_of(values)
    assert str(caught.value) == f"{old}: is {OLD_KEYS[old]}"


@pytest.mark.parametrize("old", sorted(OLD_KEYS))
def test_so_it_is_by_set(old: str) -> None:
    with pytest.raises(InputError, match=f"^{old}: is "):
        load_mission("museum-1", [f"{old}=1"])


@pytest.mark.parametrize("old", sorted(old for old in OLD_KEYS if not old.startswith("world.")))
def test_so_it_is_for_one_of_several_robots(old: str) -> None:
    """In an entry of ``robots``, and in a stack of its own."""
    top, key = old.split(".")
    values: dict[str, Any] = reach()
    values["robots"] = [{"name": "one"}, {"name": "two"}]
    place = values["robots"][1] if top == "robot" else values["robots"][1].setdefault("stack", {})
    place[key] = "anything"
    with pytest.raises(InputError) as caught:
        mission_of(values)
    where = f"robots.1.{key}" if top == "robot" else f"robots.1.stack.{key}"
    assert str(caught.value) == f"{where}: is {OLD_KEYS[old]}"


def test_no_old_key_is_one_of_today() -> None:
    for old in OLD_KEYS:
        top, key = old.split(".")
        field = Mission.model_fields[top].annotation
        assert key not in field.model_fields  # type: ignore[union-attr]


def test_the_new_keys_exist() -> None:
    """What a message sends people to can be set."""
    for override in (
        "world.markings.tape_width_m=0.02",
        "world.markings.edge_is_dark=false",
        "robot.motion.errors.slip=[0.01, 0.02]",
        "stack.navigator.fusion=false",
        "stack.navigator.avoidance=false",
        "stack.navigator.magnetometer=false",
        "stack.navigator.firmware.lines_at_centre=true",
        "run.ellipse_probability=0.9",
        "robot.footprint={radius_m: 0.08}",
    ):
        load_mission("romi-explore", [override])
    load_mission("gale-pose", ["robot.motion.max_speed_m_s=0.05", "robot.motion.wheelbase_m=2"])
    load_mission(
        "gale-astar", ["stack.navigator.cost_map.inflation_m=5", "stack.navigator.spline={clear: true}"]
    )


def test_values_are_left_alone() -> None:
    values = read_mission("museum-1")
    before = repr(values)
    refuse_old_keys(values)
    assert repr(values) == before


def test_on_the_command_line_it_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "museum-1", "--set", "robot.body={radius_m: 0.2}", "--json"]) == 2
    answer = capsys.readouterr()
    assert answer.out == ""
    assert answer.err == "pilotage: robot.body: is now robot.footprint\n"


@pytest.mark.parametrize("old", sorted(RENAMED))
def test_an_old_name_is_refused_with_the_new_one(old: str) -> None:
    with pytest.raises(InputError, match=f"localizer '{old}': is now '{RENAMED[old]}'"):
        load_mission("museum-1", [f"stack.localizer.name={old}"])
    LOCALIZERS.entry(RENAMED[old])
