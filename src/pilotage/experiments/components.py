"""From a mission's choice of a component to the component."""

from __future__ import annotations

from typing import Any, TypeVar

from pilotage.core.registry import Registry
from pilotage.missions.choice import ComponentChoice

T = TypeVar("T")


def build_component(registry: Registry[T], choice: ComponentChoice, role: str, *context: Any) -> T:
    """Build a component from its registered name and parameters.

    Raises
    ------
    InputError
        Where nothing of that name is registered or a parameter is not what it should be.
    """
    config = registry.configure(choice.name, choice.parameters, f"stack.{role}")
    return registry.entry(choice.name).factory(config, *context)


def optional_component(
    registry: Registry[T], choice: ComponentChoice | None, role: str, *context: Any
) -> T | None:
    """The same, or None where the mission does without."""
    return None if choice is None else build_component(registry, choice, role, *context)
