"""Every registered component goes through the same checks; one without an example fails."""

from __future__ import annotations

import math
from typing import Any

import pytest

from contract.examples import EXAMPLES
from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.registry import Entry, Registry
from pilotage.experiments.roles import ROLES

CASES = [
    pytest.param(role, registry, entry, id=f"{role}:{entry.name}")
    for role, registry in ROLES.items()
    for entry in registry
]
UNITS = {"m", "s", "rad", "hz", "m2", "rad2", "per", "ratio", "share", "deg", "ut"}


@pytest.mark.parametrize(("role", "registry", "entry"), CASES)
class TestComponent:
    """What every component promises."""

    def test_has_an_example(self, role: str, registry: Registry[Any], entry: Entry[Any]) -> None:
        del registry
        assert (role, entry.name) in EXAMPLES, (
            f"add an example for {role} '{entry.name}' to tests/contract/examples.py"
        )

    def test_says_what_it_is(self, role: str, registry: Registry[Any], entry: Entry[Any]) -> None:
        del role, registry
        assert (entry.factory.__doc__ or "").strip()
        assert (entry.config.__doc__ or "").strip()

    def test_config_is_frozen_and_refuses_what_it_does_not_know(
        self, role: str, registry: Registry[Any], entry: Entry[Any]
    ) -> None:
        assert issubclass(entry.config, Config)
        parameters = EXAMPLES[role, entry.name].parameters
        config = registry.configure(entry.name, parameters, role)
        for field in entry.config.model_fields:
            with pytest.raises(Exception, match="frozen"):
                setattr(config, field, getattr(config, field))
        with pytest.raises(InputError, match="unknown key"):
            registry.configure(entry.name, {**parameters, "no_such_parameter": 1}, role)

    def test_a_misspelt_parameter_is_answered_with_the_right_one(
        self, role: str, registry: Registry[Any], entry: Entry[Any]
    ) -> None:
        parameters = EXAMPLES[role, entry.name].parameters
        for field in entry.config.model_fields:
            with pytest.raises(InputError) as caught:
                registry.configure(entry.name, {**parameters, f"{field}x": 1}, role)
            assert "did you mean" in str(caught.value)

    def test_numbers_must_be_finite(self, role: str, registry: Registry[Any], entry: Entry[Any]) -> None:
        parameters = EXAMPLES[role, entry.name].parameters
        for name, field in entry.config.model_fields.items():
            if field.annotation is float:
                with pytest.raises(InputError):
                    registry.configure(entry.name, {**parameters, name: math.nan}, role)

    def test_numbers_carry_their_unit(self, role: str, registry: Registry[Any], entry: Entry[Any]) -> None:
        """A float is named with its unit, or it is one of the known pure numbers."""
        del registry
        pure = EXAMPLES[role, entry.name].pure_numbers
        for name, field in entry.config.model_fields.items():
            if field.annotation is float and name not in pure:
                assert UNITS & set(name.split("_")), f"{role} {entry.name}: '{name}' carries no unit"

    def test_survives_a_round_trip_through_its_file_form(
        self, role: str, registry: Registry[Any], entry: Entry[Any]
    ) -> None:
        config = registry.configure(entry.name, EXAMPLES[role, entry.name].parameters, role)
        again = registry.configure(entry.name, config.model_dump(mode="json"), role)
        assert again == config

    def test_works(self, role: str, registry: Registry[Any], entry: Entry[Any]) -> None:
        """Build it from its example and let it do its work in a small world."""
        example = EXAMPLES[role, entry.name]
        config = registry.configure(entry.name, example.parameters, role)
        example.works(entry.factory, config)


def test_every_example_is_of_something_registered() -> None:
    registered = {(role, entry.name) for role, registry in ROLES.items() for entry in registry}
    assert set(EXAMPLES) <= registered
