"""A registry per role: a name, the class that fills the role, and the config it takes.

A room that holds implementations imports all its modules once (``load_modules``), so adding one
touches its own module only.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from pilotage.core.checked import Gives, checked
from pilotage.core.config import Config, validate
from pilotage.core.errors import InputError, unknown_name
from pilotage.core.misfit import told
from pilotage.core.plugins import giver, is_from_outside, load_plugins, take

RENAMED = {"ekf-slow-errors": "ekf-gauss-markov", "mcl-likelihood-field": "particle-filter"}
"""Components' old names, each with today's."""

T = TypeVar("T")
C = TypeVar("C", bound=type)


@dataclass(frozen=True, slots=True)
class Entry(Generic[T]):
    """One registered implementation."""

    name: str
    factory: Callable[..., T]
    config: type[Config]


class Registry(Generic[T]):
    """Names to implementations of one role.

    Parameters
    ----------
    role
        What the entries are, as it is called in messages and mission files ("planner").
    packages
        Those whose modules register themselves here; imported at the first look-up.
    gives
        What its methods give: of a component from outside the package it is looked at.
    """

    def __init__(self, role: str, *packages: str, gives: tuple[Gives, ...] = ()) -> None:
        self.role, self.gives = role, gives
        self._packages = packages
        self._entries: dict[str, Entry[T]] = {}
        self._loaded = False

    def add(self, name: str, config: type[Config]) -> Callable[[C], C]:
        """Register the decorated class under ``name`` with its config model."""

        def register(cls: C) -> C:
            self._require_kinds(name, cls, config)
            if not cls.__module__.startswith("pilotage."):
                self._load()  # so that who comes from outside and takes a name of ours is the one refused
                self._require_parameters(name, config, complete=False)
            if name in self._entries:
                whose = giver(self._entries[name].factory.__module__)
                raise InputError(
                    f"{self.role} '{name}': expected a new name, found it registered already by {whose}"
                )
            self._entries[name] = Entry(name, checked(cls, f"{self.role} '{name}'", *self.gives), config)
            return cls

        return register

    def _require_kinds(self, name: object, cls: object, config: object) -> None:
        """What a plugin hands in may be anything."""
        if not isinstance(name, str) or not name.strip():
            raise InputError(f"{self.role}: expected a name, a text that is not empty, found {told(name)}")
        if name != name.strip() or not name.isprintable():
            raise InputError(
                f"{self.role} {name!r}: expected a name without spaces around it and control characters"
            )
        if not isinstance(cls, type):
            raise InputError(f"{self.role} '{name}': expected a class, found {told(cls)}")
        if not isinstance(config, type) or not issubclass(config, Config):
            found = config.__name__ if isinstance(config, type) else told(config)
            raise InputError(
                f"{self.role} '{name}': expected a config, a class that derives from Config, found {found}"
            )
        if "name" in config.model_fields:
            raise InputError(
                f"{self.role} '{name}': expected parameters of any other name, found 'name', which tells the "
                "component itself"
            )

    def _require_parameters(
        self, name: str, config: type[Config], whose: str = "", *, complete: bool
    ) -> None:
        from pilotage.core.parameters import unfit_parameters

        wrong = unfit_parameters(config, complete=complete)
        if wrong:
            raise InputError(f"{self.role} '{name}'{whose}: expected {wrong}")

    def add_config(self, name: str) -> Callable[[C], C]:
        """Register a class that is its own config: one whose description is all there is to it."""

        def register(cls: C) -> C:
            return self.add(name, cls)(cls)

        return register

    def entry(self, name: str) -> Entry[T]:
        """Look a name up; InputError with the nearest right name where it is unknown."""
        self._load()
        if name in RENAMED and name not in self._entries:
            raise InputError(f"{self.role} '{name}': is now '{RENAMED[name]}'")
        if name not in self._entries:
            raise unknown_name(self.role, name, self._entries)
        found = self._whole(self._entries[name])
        take(found.factory.__module__)
        return found

    def configure(self, name: str, parameters: dict[str, Any], where: str) -> Config:
        """Validate ``parameters`` against the config of ``name``."""
        return validate(self.entry(name).config, parameters, where)

    def names(self) -> list[str]:
        """Return all registered names, sorted."""
        self._load()
        return sorted(self._entries)

    def __iter__(self) -> Iterator[Entry[T]]:
        self._load()
        return iter([self._whole(self._entries[name]) for name in sorted(self._entries)])

    def _whole(self, entry: Entry[T]) -> Entry[T]:
        """An entry whose config is complete: a plugin's may name a type that stood below it."""
        if not entry.config.__pydantic_complete__ and is_from_outside(entry.config.__module__):
            whose = f" of {giver(entry.config.__module__)}"
            self._require_parameters(entry.name, entry.config, whose, complete=True)
        return entry

    def _load(self) -> None:
        if not self._loaded:
            self._loaded = True  # first: a module that is loaded may look another name up
            for package in self._packages:
                load_modules(package)
            load_plugins()


def load_modules(package: str) -> None:
    """Import every module directly inside ``package``, so that registrations run."""
    module = importlib.import_module(package)
    for info in pkgutil.iter_modules(module.__path__):
        importlib.import_module(f"{package}.{info.name}")
