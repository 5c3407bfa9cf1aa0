"""Angles, random streams, the registry, configs and their one-line errors."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, model_validator

from pilotage.core.angles import is_in_view, wrap_array_to_pi, wrap_to_pi
from pilotage.core.config import Config, validate
from pilotage.core.errors import InputError, nearest, unknown_name
from pilotage.core.parameters import unfit_parameters
from pilotage.core.random import RandomStreams
from pilotage.core.registry import Registry
from pilotage.core.types import Pose2
from pilotage.sensors.lidar import LidarConfig

angles_rad = st.floats(min_value=-1e4, max_value=1e4)


# Angles


@given(angles_rad)
def test_a_wrapped_angle_is_in_range_and_points_the_same_way(angle_rad: float) -> None:
    wrapped = wrap_to_pi(angle_rad)
    assert -math.pi <= wrapped < math.pi
    assert math.isclose(math.cos(wrapped), math.cos(angle_rad), abs_tol=1e-9)
    assert math.isclose(math.sin(wrapped), math.sin(angle_rad), abs_tol=1e-9)


@given(st.lists(angles_rad, max_size=20))
def test_wrapping_an_array_is_wrapping_each_element(angles: list[float]) -> None:
    array = np.array(angles)
    before = array.copy()
    np.testing.assert_array_equal(wrap_array_to_pi(array), [wrap_to_pi(angle) for angle in angles])
    np.testing.assert_array_equal(array, before)


@pytest.mark.parametrize(
    ("angle_rad", "expected"),
    [
        (math.pi, -math.pi),
        (-math.pi, -math.pi),
        (0.0, 0.0),
        (3 * math.pi, -math.pi),
        # A naive modulo gives +pi, out of the range, one step below -pi.
        (np.nextafter(-math.pi, -4.0), -math.pi),
    ],
)
def test_the_borders_of_the_range(angle_rad: float, expected: float) -> None:
    assert wrap_to_pi(angle_rad) == expected
    assert wrap_array_to_pi(np.array([[angle_rad]])) == np.array([[expected]])


@pytest.mark.parametrize("around_rad", [2.0 * math.pi, 6.283185307, 6.28])
def test_a_scanner_that_looks_all_around_looks_behind(around_rad: float) -> None:
    """However exactly the full turn was written down."""
    fan = LidarConfig(beams=360, field_of_view_rad=around_rad).beam_angles_rad()
    ends = float(fan[0]), float(fan[-1]), float(fan[1] - fan[0])
    assert all(is_in_view(bearing, *ends) for bearing in np.linspace(-math.pi, math.pi, 1000))


@given(st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi))
def test_a_fan_sees_what_lies_between_its_ends(mount_rad: float, bearing_rad: float) -> None:
    fan = LidarConfig(beams=271, field_of_view_rad=math.radians(270.0)).beam_angles_rad() + mount_rad
    step = float(fan[1] - fan[0])
    off_rad = abs(wrap_to_pi(bearing_rad - mount_rad))
    if abs(off_rad - math.radians(135.0) - step) > 1e-9:
        seen = is_in_view(bearing_rad, float(fan[0]), float(fan[-1]), step)
        assert seen is (off_rad < math.radians(135.0) + step)


# Value types


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(-math.pi, math.pi))
def test_a_pose_survives_its_array(x_m: float, y_m: float, theta_rad: float) -> None:
    pose = Pose2(x_m, y_m, theta_rad)
    assert Pose2.from_array(pose.as_array()) == pose


def test_values_are_frozen() -> None:
    with pytest.raises(AttributeError):
        Pose2(0.0, 0.0, 0.0).x_m = 1.0  # type: ignore[misc]


# Random streams


def test_the_same_name_and_seed_give_the_same_draws() -> None:
    first = RandomStreams(7).stream("lidar").normal(size=100)
    again = RandomStreams(7).stream("lidar").normal(size=100)
    np.testing.assert_array_equal(first, again)


def test_streams_do_not_depend_on_who_else_draws() -> None:
    alone = RandomStreams(7).stream("lidar").normal(size=100)
    streams = RandomStreams(7)
    streams.stream("beacons").normal(size=33)
    streams.stream("planner").normal(size=5)
    np.testing.assert_array_equal(streams.stream("lidar").normal(size=100), alone)


@pytest.mark.parametrize(
    ("one", "other"),
    [((7, "lidar"), (7, "beacons")), ((7, "lidar"), (8, "lidar")), ((1, "a"), (0, "a"))],
)
def test_other_names_and_seeds_give_unrelated_draws(one: tuple[int, str], other: tuple[int, str]) -> None:
    count = 20_000
    a = RandomStreams(one[0]).stream(one[1]).normal(size=count)
    b = RandomStreams(other[0]).stream(other[1]).normal(size=count)
    # The correlation of independent draws has standard deviation 1/sqrt(count); beyond 5 of them a
    # false alarm has probability 6e-7 (and the seeds are fixed).
    assert abs(np.corrcoef(a, b)[0, 1]) < 5.0 / math.sqrt(count)


def test_a_negative_seed_is_refused() -> None:
    with pytest.raises(ValueError, match="seed must be >= 0, found -1"):
        RandomStreams(-1)


# Errors


def test_an_input_error_is_one_line() -> None:
    assert str(InputError("first\n  second\tthird")) == "first second third"


def test_the_nearest_name_is_offered_only_where_one_is_near() -> None:
    assert nearest("museum1", ["museum-1", "gale-ekf"]) == "museum-1"
    assert nearest("xyz", ["museum-1", "gale-ekf"]) is None


def test_an_unknown_name_lists_the_known_ones_where_none_is_near() -> None:
    assert str(unknown_name("planner", "xyz", ["b", "a"])) == "unknown planner 'xyz'; known: a, b"
    assert "did you mean 'rrt-star'?" in str(unknown_name("planner", "rrt-str", ["rrt-star", "a-star"]))


# Registry


class ShoutConfig(Config):
    """Config of the test component."""

    volume_db: float = Field(default=60.0, ge=0.0)


def empty_registry() -> Registry[object]:
    return Registry("announcer", "pilotage.core")


def test_a_registered_class_is_found_with_its_config() -> None:
    registry = empty_registry()

    @registry.add("shout", ShoutConfig)
    class Shout:
        pass

    assert registry.entry("shout").factory is Shout
    assert registry.configure("shout", {"volume_db": 80}, "stack.announcer") == ShoutConfig(volume_db=80.0)
    assert registry.names() == ["shout"]
    assert [entry.name for entry in registry] == ["shout"]


def test_a_config_can_be_its_own_component() -> None:
    registry = empty_registry()
    registry.add_config("shout")(ShoutConfig)
    assert registry.entry("shout").factory is registry.entry("shout").config is ShoutConfig


def test_names_come_sorted() -> None:
    registry = empty_registry()
    for name in ("c", "a", "b"):
        registry.add_config(name)(ShoutConfig)
    assert registry.names() == [entry.name for entry in registry] == ["a", "b", "c"]


def test_registering_a_name_twice_is_refused() -> None:
    registry = empty_registry()
    registry.add_config("shout")(ShoutConfig)
    with pytest.raises(InputError, match="announcer 'shout': expected a new name, found it"):
        registry.add_config("shout")(ShoutConfig)


def test_an_unknown_component_names_the_nearest() -> None:
    registry = empty_registry()
    registry.add_config("shout")(ShoutConfig)
    with pytest.raises(InputError, match=r"^unknown announcer 'shuot'; did you mean 'shout'\?$"):
        registry.entry("shuot")


# Configs


class Inner(Config):
    gate: float = Field(default=0.99, gt=0.0, lt=1.0)
    name: str = "ekf"


class Outer(Config):
    inner: Inner = Inner()
    maybe: Inner | None = None
    steps: int = 3
    often: bool = False
    limit: float | None = None
    start: float = Field(default=0.0, ge=-10.0)
    size_m: float

    @model_validator(mode="after")
    def _small(self) -> Outer:
        if self.size_m > 100.0:
            raise ValueError("Size_m must be at most 100")
        if self.steps > 10 and not self.often:
            raise ValueError("steps: expected at most 10 unless often, found more")
        return self


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"size_m": 1, "sttart": 2}, "world.sttart: unknown key; did you mean 'start'?"),
        ({"size_m": 1, "inner": {"gat": 0.9}}, "world.inner.gat: unknown key; did you mean 'gate'?"),
        ({"size_m": 1, "maybe": {"gat": 0.9}}, "world.maybe.gat: unknown key; did you mean 'gate'?"),
        ({"size_m": 1, "inner": {"zzz": 0}}, "world.inner.zzz: unknown key; known keys: gate, name"),
        # A misspelt key explains a missing one, so it is told first.
        ({"sise_m": 1}, "world.sise_m: unknown key; did you mean 'size_m'?"),
        ({}, "world.size_m: missing; it has to be given"),
        ({"size_m": math.nan}, "world.size_m: input should be a finite number, found nan"),
        ({"size_m": math.inf}, "world.size_m: input should be a finite number, found inf"),
        ({"size_m": 1, "inner": {"gate": 1.5}}, "world.inner.gate: input should be less than 1, found 1.5"),
        ({"size_m": 200}, "world: size_m must be at most 100, found {'size_m': 200}"),
        ({"size_m": 1, "steps": 11}, "world.steps: expected at most 10 unless often, found more"),
        ([1, 2], "world: expected a mapping of keys, found [1, 2]"),
        (None, "world: expected a mapping of keys, found nothing"),
    ],
)
def test_a_wrong_config_is_one_line(values: object, message: str) -> None:
    with pytest.raises(InputError) as raised:
        validate(Outer, values, "world")
    assert str(raised.value) == message


@pytest.mark.parametrize(
    ("values", "begins", "ends"),
    [
        ({"size_m": "wide"}, "world.size_m: input should be a valid number", "found 'wide'"),
        ({"size_m": None}, "world.size_m: input should be a valid number", "found nothing"),
        ({"size_m": 1, "steps": 1.5}, "world.steps: input should be a valid integer", "found 1.5"),
        ({"size_m": True}, "world.size_m: input should be a valid number", "found 'true'"),
        ({"size_m": 1, "steps": False}, "world.steps: input should be a valid integer", "found 'false'"),
        ({"size_m": 1, "limit": True}, "world.limit: input should be a valid number", "found 'true'"),
        ({"size_m": 1, "inner": 3}, "world.inner: expected a mapping with keys of gate, name", "found 3"),
        ({"size_m": 1, "steps": "x" * 500}, "world.steps: input should be a valid integer", "..."),
    ],
)
def test_a_wrong_type_says_what_was_expected_and_found(values: object, begins: str, ends: str) -> None:
    with pytest.raises(InputError) as raised:
        validate(Outer, values, "world")
    assert str(raised.value).startswith(begins)
    assert str(raised.value).endswith(ends)
    assert len(str(raised.value)) < 250


class Several(Config):
    """Values that may be of several kinds."""

    many: int | Literal["auto"] = "auto"
    limit: float | tuple[float, float] | None = None


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"many": "aut"}, "it.many: input should be a valid integer or 'auto', found 'aut'"),
        ({"many": 1.5}, "it.many: input should be a valid integer or 'auto', found 1.5"),
        ({"many": None}, "it.many: input should be a valid integer or 'auto', found nothing"),
        ({"limit": "x"}, "it.limit: input should be a valid number or a list, found 'x'"),
    ],
)
def test_a_value_of_several_kinds_is_refused_at_its_key(values: object, message: str) -> None:
    """It was told at a key ``many.int``, of the first kind alone."""
    with pytest.raises(InputError) as raised:
        validate(Several, values, "it")
    assert str(raised.value) == message


def test_a_parameters_type_may_stand_below_it_and_has_to_stand_somewhere() -> None:
    """Whoever asked what there is read a traceback and that it was a bug in pilotage."""

    class Early(Config):
        inner: Nowhere | None = None  # type: ignore[name-defined]  # noqa: F821

    assert unfit_parameters(Early, complete=False) == ""
    assert unfit_parameters(Early, complete=True) == (
        "types that are defined in its file, found 'Nowhere', which is not"
    )


def test_without_a_place_the_key_stands_alone() -> None:
    with pytest.raises(InputError, match=r"^size_m: missing"):
        validate(Outer, {}, "")
    with pytest.raises(InputError, match=r"^file: expected a mapping"):
        validate(Outer, "text", "")


def test_a_truth_value_stays_one_where_it_is_asked_for() -> None:
    assert validate(Outer, {"size_m": 1, "often": True}, "world").often


def test_configs_are_frozen() -> None:
    with pytest.raises(ValueError, match="frozen"):
        Inner().gate = 0.5  # type: ignore[misc]


def test_a_config_that_nobody_validates_has_no_validator() -> None:
    """A run imports a hundred and more."""

    class Unused(Config):
        length_m: float = 1.0

    assert not Unused.__pydantic_complete__
    assert Unused.model_fields.keys() == {"length_m"}
    assert validate(Unused, {"length_m": 2}, "").length_m == 2.0
    assert Unused.__pydantic_complete__
