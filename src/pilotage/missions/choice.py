"""A component by its registered name, with its parameters beside it."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from pydantic import BeforeValidator, ConfigDict, model_validator

from pilotage.core.config import Config


class ComponentChoice(Config):
    """A registered name and, beside it, the parameters of that component.

    A bare name stands for the component with its defaults. The room that registers the name validates the
    parameters.
    """

    model_config = ConfigDict(extra="allow", frozen=True)

    name: str

    @model_validator(mode="before")
    @classmethod
    def _bare_name(cls, data: Any) -> Any:
        """A bare name stands for the component with its defaults."""
        return {"name": data} if isinstance(data, str) else data

    @staticmethod
    def where_listed(key: str) -> str:
        """What tells all that can stand at a mission's ``key``."""
        role = "" if key == "name" else f" {key}"
        return f"'pilotage components{role}' lists what it can be"

    @property
    def parameters(self) -> dict[str, Any]:
        """All keys but the name."""
        return dict(self.model_extra or {})


def by_default(name: str) -> BeforeValidator:
    """Parameters without a name are those of the component that is taken where nothing is said."""
    return BeforeValidator(
        lambda value: {"name": name, **value} if isinstance(value, Mapping) and "name" not in value else value
    )


EXCLUSIVE = (("points_m", "radius_m"), ("radius_m", "points_m"))
"""Keys of alternatives that need no name: an outline has corners or a radius."""


def laid_over(base: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """``changes`` over ``base``, key by key; a component whose ``name`` changes starts from nothing.

    So does what is told apart without a name, by its keys: a polygon is not laid over a disc.
    """
    merged = copy.deepcopy(dict(base))
    for key, value in changes.items():
        old = merged.get(key)
        if (
            isinstance(value, Mapping)
            and isinstance(old, Mapping)
            and value.get("name", old.get("name")) == old.get("name")
            and not any(a in value and b in old for a, b in EXCLUSIVE)
        ):
            merged[key] = laid_over(old, value)
        else:
            merged[key] = copy.deepcopy(value)
    return merged
