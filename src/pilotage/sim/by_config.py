"""What simulates what: a data sheet's type to the class that plays its part in the true world."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from pilotage.core.checked import Gives, checked
from pilotage.core.config import Config
from pilotage.core.errors import InputError
from pilotage.core.registry import load_modules

T = TypeVar("T")
C = TypeVar("C", bound=type)


class ByConfig(Generic[T]):
    """Config types to simulated counterparts; a config that derives from a known one is played by its class.

    Parameters
    ----------
    role
        What the entries are called in messages ("sensor").
    package
        The package whose modules register themselves here; imported at the first look-up.
    gives
        What their methods give: of one from outside the package it is looked at.
    """

    def __init__(self, role: str, package: str, *gives: Gives) -> None:
        self.role, self.gives = role, gives
        self._package = package
        self._entries: dict[type[Config], Callable[..., T]] = {}
        self._loaded = False

    def add(self, config: type[Config]) -> Callable[[C], C]:
        """Register the decorated class for a config type."""

        def register(cls: C) -> C:
            if config in self._entries:
                raise ValueError(f"{self.role} {config.__name__} is simulated twice")
            # Those that are read together have no method of their own.
            gives = () if hasattr(cls, "together") else self.gives
            self._entries[config] = checked(cls, f"{self.role} {config.__name__}", *gives)
            return cls

        return register

    def of(self, config: Config, where: str) -> Callable[..., T]:
        """The class for a config.

        Raises
        ------
        InputError
            If nobody simulates it.
        """
        if not self._loaded:
            load_modules(self._package)
            self._loaded = True
        for kind in type(config).__mro__:
            if kind in self._entries:
                return self._entries[kind]
        known = ", ".join(sorted(kind.__name__ for kind in self._entries))
        raise InputError(
            f"{where}: nothing simulates a {self.role} of type {type(config).__name__}; known: {known}"
        )
