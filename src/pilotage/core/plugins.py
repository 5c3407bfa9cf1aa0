"""Components from outside the package: Python files that are named, and installed packages' entry points.

A plugin is a module that registers what it brings when it is imported, as the package's own modules do. It is
code and runs as such.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import traceback
from collections.abc import Iterable, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path

from pilotage.core.errors import InputError

GROUP = "pilotage.plugins"
"""Entry points of this group are imported when a component is first looked for."""
VARIABLE = "PILOTAGE_PLUGINS"
"""Files named here are loaded too, so that worker processes know what their parent was told."""

_loaded: dict[str, str] = {}
_packages: dict[str, str] = {}
"""Folder or file of each installed plugin's code, by the entry point's name."""
_seen_entry_points = False
_in_use: dict[str, None] = {}
"""Modules from outside of which something was taken, in the order of that."""


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
            with redirect_stdout(sys.stderr):
                entry.load()
            _packages[entry.name] = _home(entry.value)
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
        with redirect_stdout(sys.stderr):  # standard output may be for one JSON object alone
            spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        # Asked for once more it is refused once more.
        del _loaded[path], sys.modules[name]
        told = str(error) if isinstance(error, InputError) else _where(error, path)
        raise InputError(f"plugin '{path}': {told}") from None


@dataclass(frozen=True, slots=True)
class Fault:
    """A plugin's own mistake: the line to say, and the plugin's part of the traceback."""

    line: str
    traceback: str


def fault_of(error: BaseException) -> Fault | None:
    """Tell whether an error came out of a plugin's code, or of ours as a plugin called it; None: neither."""
    frames = traceback.extract_tb(error.__traceback__)
    homes = {path: f"'{path}'" for path in _loaded}
    homes |= {home: f"'{name}'" for name, home in _packages.items() if home}
    own = [frame for frame in frames if _home_of(frame.filename, homes) is not None]
    if not own:
        return None
    last = own[-1]
    home = _home_of(last.filename, homes)
    assert home is not None, "only such frames are kept"
    place = f"line {last.lineno}" if last.filename == home else f"{last.filename} line {last.lineno}"
    told = "".join(traceback.format_exception_only(error)).strip()
    text = "Traceback of the plugin (most recent call last):\n" + "".join(traceback.format_list(own)) + told
    return Fault(f"plugin {homes[home]} {place}: {type(error).__name__}: {error}", text)


def take(module: str) -> None:
    """Note that something of a module is used; of the package's own nothing is noted."""
    if is_from_outside(module):
        _in_use[module] = None


def take_nothing() -> None:
    """A command begins: what one before it in this process used is not to blame."""
    _in_use.clear()


def is_from_outside(module: str) -> bool:
    """Whether a module is not one of the package's own."""
    return module.partition(".")[0] != "pilotage"


def consequence_of(error: BaseException) -> Fault | None:
    """Blame what plugins gave for an error in our own code; None where nothing of theirs is in use.

    One that gives a text for a number, or an array of another shape, is gone again when that is found out.
    """
    homes = {path: f"'{path}'" for path in _loaded}
    homes |= {home: f"'{name}'" for name, home in _packages.items() if home}
    files = [str(getattr(sys.modules.get(name), "__file__", "")) for name in _in_use]
    used = dict.fromkeys(homes[home] for file in files if (home := _home_of(file, homes)) is not None)
    if not used:
        return None
    text = "".join(traceback.format_exception(error)).rstrip()
    whose = f"plugin {', '.join(used)}" if len(used) == 1 else f"plugins {', '.join(used)}"
    told = traceback.format_exception_only(error)[-1].strip()
    return Fault(
        f"{whose}: something that it gave, by the lines above, is not what its role gives: {told}", text
    )


def _home_of(file: str, homes: Mapping[str, str]) -> str | None:
    return next((home for home in homes if file == home or file.startswith(home + os.sep)), None)


def _home(value: str) -> str:
    """Where the code of an entry point lies; nowhere where it is built in."""
    module = sys.modules[value.partition(":")[0].partition(".")[0]]
    file = getattr(module, "__file__", None)
    if file is None:
        return ""
    return str(Path(file).parent) if Path(file).stem == "__init__" else file


def _where(error: BaseException, path: str = "") -> str:
    """What went wrong and in which line of the plugin."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == path]
    number = error.lineno if isinstance(error, SyntaxError) else (lines[-1] if lines else None)
    place = "" if number is None else f"line {number}: "
    return f"{place}{type(error).__name__}: {error}"
