"""What can be named is listed by role, and a mission that lacks a part says where."""

from __future__ import annotations

from enum import Enum
from typing import Literal

import pytest

from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.experiments.catalogue import _parameters, components, roles
from pilotage.experiments.mission import mission_of
from pilotage.experiments.roles import ROLES

BARE = {"mission": "own", "world": {"map": "museum", "start": {"x_m": 1.0, "y_m": 1.0}}}


def test_every_role_lists_what_takes_it_and_nothing_else() -> None:
    of_roles = [row for role in roles() for row in components(role)]
    assert sorted(of_roles) == sorted(components())
    for role, registry in ROLES.items():
        assert [name for _, name, _ in components(role)] == [entry.name for entry in registry]


def test_no_component_has_a_roles_name() -> None:
    assert not {name for _, name, _ in components()} & set(roles())


def test_a_name_like_none_tells_the_roles() -> None:
    with pytest.raises(InputError, match=r"unknown component 'qqqq'; known roles: task, motion, .*, metric$"):
        components("qqqq")
    with pytest.raises(InputError, match="did you mean 'navigator'"):
        components("navigatr")


@pytest.mark.parametrize(
    ("stack", "robot", "told"),
    [
        ({}, {}, "stack.navigator: missing; it has to be given; 'pilotage components navigator' lists "),
        (
            {"navigator": "goal"},
            {"sensors": {"odometry": {"rate_hz": 10}}},
            "robot.sensors.odometry.name: missing; it has to be given; 'pilotage components' lists ",
        ),
    ],
)
def test_a_missing_part_says_what_lists_it(
    stack: dict[str, object], robot: dict[str, object], told: str
) -> None:
    with pytest.raises(InputError) as refused:
        mission_of(
            {**BARE, "stack": stack, "robot": {"footprint": {"radius_m": 0.3}, **robot}, "task": "plan"}
        )
    assert str(refused.value).startswith(told)


def test_a_parameters_default_is_told_as_a_mission_says_it() -> None:
    """An enumeration told its class twice, and ``none`` is a text where a number is asked for."""

    class Shape(Enum):
        ROUND = "round"
        SQUARE = "square"

    class Several(Config):
        shape: Shape = Shape.ROUND
        at_m: tuple[float, float] = (0.5, 1.0)
        often: bool = False
        many: int | Literal["auto"] = "auto"
        most_m: float | None = None

    assert _parameters(Several) == [
        ("shape", "round", "round | square"),
        ("at_m", "[0.5, 1.0]", "array"),
        ("often", "false", "boolean"),
        ("many", "auto", "integer or auto"),
        ("most_m", "null", "number or null"),
    ]
