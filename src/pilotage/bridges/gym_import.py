"""``import pilotage`` and ``import gymnasium``, in either order: the environments are there.

Gymnasium has looked for no entry points since 1.0, and importing it here would cost everybody its time.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from types import ModuleType

NAME = "gymnasium"


def register_with_gymnasium() -> None:
    """Register at once where Gymnasium is imported already, else as soon as it is."""
    if NAME in sys.modules:
        _register()
    else:
        sys.meta_path.insert(0, _Watch)


class _Watch:
    """Finds nothing by itself: lets the others find Gymnasium, once, and registers behind its import."""

    @classmethod
    def find_spec(
        cls,
        name: str,
        path: Sequence[str] | None = None,  # noqa: ARG003 - as importlib calls it
        target: ModuleType | None = None,  # noqa: ARG003
    ) -> ModuleSpec | None:
        """The others' specification of Gymnasium, to which the registration is added."""
        if name != NAME:
            return None
        sys.meta_path.remove(cls)
        spec = importlib.util.find_spec(name)
        if spec is None or spec.loader is None:
            return spec
        execute = spec.loader.exec_module

        def and_register(module: ModuleType) -> None:
            execute(module)
            _register()

        setattr(spec.loader, "exec_module", and_register)  # noqa: B010 - on this loader alone
        return spec


def _register() -> None:
    from pilotage.bridges import gym  # noqa: F401 - its import registers
