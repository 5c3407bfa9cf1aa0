"""Components from outside the package: Python files that are named, and installed packages' entry points.

A plugin is a module that registers what it brings when it is imported, as the package's own modules do. It is
code and runs as such.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import traceback
from collections.abc import Iterable
from importlib.metadata import entry_points
from pathlib import Path

from pilotage.core.errors import InputError

GROUP = "pilotage.plugins"
"""Entry points of this group are imported when a component is first looked for."""
VARIABLE = "PILOTAGE_PLUGINS"
"""Files named here are loaded too, so that worker processes know what their parent was told."""

_loaded: dict[str, str] = {}
_seen_entry_points = False


def add_plugins(files: Iterable[str]) -> None:
    """Load plugin files now, and in every process that this one starts.

    Raises
    ------
    InputError
        Where a file is missing, does not import, or registers a name that is taken.
    """
    named = named_plugins()
    for file in files:
        path = str(Path(file).absolute())
        load_file(path)
        if path not in named:
            named.append(path)
    os.environ[VARIABLE] = os.pathsep.join(named)


def named_plugins() -> list[str]:
    """The plugin files of this process, absolute."""
    return [name for name in os.environ.get(VARIABLE, "").split(os.pathsep) if name]


def load_plugins() -> None:
    """Load the plugins that the environment names and those of installed packages, each once."""
    global _seen_entry_points
    for name in named_plugins():
        load_file(name)
    if _seen_entry_points:
        return
    _seen_entry_points = True
    for entry in entry_points(group=GROUP):
        try:
            entry.load()
        except InputError as error:
            raise InputError(f"plugin '{entry.name}': {error}") from None
        except Exception as error:
            raise InputError(f"plugin '{entry.name}' ({entry.value}): {_where(error)}") from None


def load_file(path: str) -> None:
    """Import one plugin file, once a process.

    Raises
    ------
    InputError
        One line with the plugin's own file and line where it fails.
    """
    if path in _loaded:
        return
    if not Path(path).is_file() or Path(path).suffix != ".py":
        raise InputError(f"plugin '{path}': expected a Python file, found none there")
    name = f"pilotage_plugin_{len(_loaded)}_{Path(path).stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError(f"plugin '{path}': expected a Python file, found something else")
    module = importlib.util.module_from_spec(spec)
    _loaded[path] = name
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        # Asked for once more it is refused once more.
        del _loaded[path], sys.modules[name]
        told = str(error) if isinstance(error, InputError) else _where(error, path)
        raise InputError(f"plugin '{path}': {told}") from None


def _where(error: BaseException, path: str = "") -> str:
    """What went wrong and in which line of the plugin."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == path]
    number = error.lineno if isinstance(error, SyntaxError) else (lines[-1] if lines else None)
    place = "" if number is None else f"line {number}: "
    return f"{place}{type(error).__name__}: {error}"
