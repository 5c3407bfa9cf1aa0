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
from importlib.machinery import SourceFileLoader
from importlib.metadata import entry_points
from pathlib import Path

from pilotage.core.errors import InputError
from pilotage.core.neighbours import found_instead
from pilotage.core.shown import shown

GROUP = "pilotage.plugins"
"""Entry points of this group are imported when a component is first looked for."""
VARIABLE = "PILOTAGE_PLUGINS"
"""Files named here, one a line, are loaded too: so worker processes know what their parent was told."""


class PluginError(InputError):
    """A plugin that is not there, or does not load."""


_loaded: dict[str, str] = {}
_packages: dict[str, str] = {}
"""Installed packages' names, by the folder or file of their code."""
_seen_entry_points = False
_stand_ins: dict[str, str] = {}
"""Files that were named beside a mission, by their names: they stand in for listed ones that were moved."""
_in_use: dict[str, None] = {}
"""Modules from outside of which something was taken, in the order of that."""


def add_plugins(files: Iterable[str], *, listed: bool = False) -> None:
    """Load plugin files now, and in every process that this one starts; packages must be there.

    Parameters
    ----------
    listed
        Whether a mission lists them. One that is no longer there may be named beside the mission, where it
        lies now: a file of its name does for it.

    Raises
    ------
    PluginError
        Where a file is missing, does not import, or registers a name that is taken; where no such package is
        installed.
    """
    named = named_plugins()
    for file in files:
        if is_package(file):
            load_plugins()
            if file not in _packages.values():
                raise PluginError(
                    f"plugins: expected a Python file or an installed package with plugins, found '{file}'; "
                    f"install it, or take it off the list"
                )
            continue
        path = str(Path(file).absolute())
        if listed:
            path = _where_it_lies_now(path)
        else:
            _stand_ins[Path(path).name] = path
        load_file(path)
        if not _is_among(path, named):
            named.append(path)
    os.environ[VARIABLE] = "\n".join(named)


def _where_it_lies_now(path: str) -> str:
    """A listed file's path; that of the one named beside the mission where it is not there any more."""
    name = Path(path).name
    if Path(path).is_file() or Path(path).suffix != ".py":
        return path
    if name not in _stand_ins:
        raise PluginError(
            f"plugin '{path}': expected a Python file, found {found_instead(Path(path), {'.py'})}; "
            f"if it was moved, name it where it is now: --plugin FOLDER/{name}"
        )
    return _stand_ins[name]


def named_plugins() -> list[str]:
    """The plugin files of this process, absolute."""
    return [name for name in os.environ.get(VARIABLE, "").splitlines() if name]


def is_package(name: str) -> bool:
    """Whether a plugin is named as an installed package, not as a file."""
    return not name.endswith(".py") and "/" not in name and os.sep not in name


def load_plugins() -> None:
    """Load the plugins that the environment names and those of installed packages, each once.

    An installed one that fails is told and left out: who did not ask for it need not mend it first.
    """
    global _seen_entry_points
    for name in named_plugins():
        load_file(name)
    if _seen_entry_points:
        return
    _seen_entry_points = True
    for entry in entry_points(group=GROUP):
        package = entry.dist.name if entry.dist is not None else entry.name
        try:
            home = _home(entry.value)
            if home:
                _packages[home] = package
            with redirect_stdout(sys.stderr):
                entry.load()
        except (Exception, SystemExit) as error:
            told = str(error) if isinstance(error, InputError) else _where(error)
            from multiprocessing import parent_process

            if parent_process() is None:  # workers need not say it again
                line = f"plugin '{entry.name}' of package '{package}' ({entry.value}) is left out: {told}"
                sys.stderr.write(f"pilotage: {shown(line)}\n")


class _Unwritten(SourceFileLoader):
    """Leaves no compiled copy beside a file that was only to be read."""

    def set_data(self, *_: object, **__: object) -> None:
        """Where Python would write ``__pycache__``."""


def load_file(path: str) -> None:
    """Import one plugin file, once a process, in whatever words its path is told.

    Raises
    ------
    PluginError
        One line with the plugin's own file and line where it fails.
    """
    if path in _loaded:
        return
    if not Path(path).is_file() or Path(path).suffix != ".py":
        found = found_instead(Path(path), {".py"})
        raise PluginError(f"plugin '{path}': expected a Python file, found {found}")
    if _is_among(path, _loaded):
        return
    name = f"pilotage_plugin_{len(_loaded)}_{Path(path).stem}"
    spec = importlib.util.spec_from_file_location(name, path, loader=_Unwritten(name, path))
    if spec is None or spec.loader is None:
        raise PluginError(f"plugin '{path}': expected a Python file, found something else")
    module = importlib.util.module_from_spec(spec)
    _loaded[path] = name
    sys.modules[name] = module
    try:
        with redirect_stdout(sys.stderr):  # standard output may be for one JSON object alone
            spec.loader.exec_module(module)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        # Asked for once more it is refused once more.
        del _loaded[path], sys.modules[name]
        told = str(error) if isinstance(error, InputError) else _where(error, path)
        whose = f"plugin '{path}'"
        raise PluginError(told if f"of {whose}: " in told else f"{whose}: {told}") from None


def _is_among(path: str, paths: Iterable[str]) -> bool:
    """Whether a file is one of those: by ``..`` and links one file has many paths."""
    return os.path.realpath(path) in map(os.path.realpath, paths)


@dataclass(frozen=True, slots=True)
class Fault:
    """A plugin's own mistake: the line to say, and the plugin's part of the traceback."""

    line: str
    traceback: str


def fault_of(error: BaseException) -> Fault | None:
    """Tell whether an error came out of a plugin's code, or of ours as a plugin called it; None: neither."""
    own = _own_frames(error)
    if not own:
        return None
    told = "".join(traceback.format_exception_only(error)).strip()
    text = "Traceback of the plugin (most recent call last):\n" + "".join(traceback.format_list(own)) + told
    return Fault(f"{_place(own[-1])}: {_named(error)}", text)


def refusal_of(error: InputError) -> str:
    """What an error says, and where in a plugin what it refuses was asked for."""
    own = _own_frames(error)
    return f"{error} ({_place(own[-1])})" if own else str(error)


def _own_frames(error: BaseException) -> list[traceback.FrameSummary]:
    """Those of an error's traceback that are a plugin's code."""
    homes = _homes()
    frames = traceback.extract_tb(error.__traceback__)
    return [frame for frame in frames if _home_of(frame.filename, homes) is not None]


def _place(frame: traceback.FrameSummary) -> str:
    """Plugin and line of a frame of its code."""
    homes = _homes()
    home = _home_of(frame.filename, homes)
    assert home is not None, "only such frames are asked about"
    line = f"line {frame.lineno}"
    return f"plugin {homes[home]} {line if frame.filename == home else f'{frame.filename} {line}'}"


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
    used = dict.fromkeys(told for name in _in_use if (told := _told(name)))
    if not used:
        return None
    text = "".join(traceback.format_exception(error)).rstrip()
    whose = f"plugin {', '.join(used)}" if len(used) == 1 else f"plugins {', '.join(used)}"
    told = traceback.format_exception_only(error)[-1].strip()
    return Fault(
        f"{whose}: something that it gave, by the lines above, is not what its role gives: {told}", text
    )


def giver(module: str) -> str:
    """Who brought a module, for messages: a plugin's file or package, or the module itself."""
    return f"plugin {_told(module)}" if _told(module) else f"'{module}'"


def package_of(module: str) -> str | None:
    """The installed package that a module is part of; None where it came otherwise."""
    return _packages.get(_home_of(_file_of(module), _packages) or "")


def _told(module: str) -> str | None:
    homes = _homes()
    return homes.get(_home_of(_file_of(module), homes) or "")


def _homes() -> dict[str, str]:
    """How messages name plugins, by the folder or file of their code."""
    named = {path: f"'{path}'" for path in _loaded}
    return named | {home: f"'{name}'" for home, name in _packages.items()}


def _file_of(module: str) -> str:
    return str(getattr(sys.modules.get(module), "__file__", ""))


def _home_of(file: str, homes: Mapping[str, str]) -> str | None:
    return next((home for home in homes if file == home or file.startswith(home + os.sep)), None)


def _home(value: str) -> str:
    """Where the code of an entry point lies; nowhere where nobody can tell."""
    spec = importlib.util.find_spec(value.partition(":")[0].partition(".")[0].strip())
    if spec is None or spec.origin is None:
        return ""
    return str(Path(spec.origin).parent) if spec.submodule_search_locations else spec.origin


def _where(error: BaseException, path: str = "") -> str:
    """What went wrong and in which line of the plugin."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == path]
    number = error.lineno if isinstance(error, SyntaxError) else (lines[-1] if lines else None)
    place = "" if number is None else f"line {number}: "
    return f"{place}{_named(error)}{_hint_of_neighbour(error, path)}"


def _hint_of_neighbour(error: BaseException, path: str) -> str:
    """Who looks for a module that lies beside the plugin is told how two files come together."""
    name = error.name if path and isinstance(error, ModuleNotFoundError) and error.name else ""
    beside = Path(path).parent / name.partition(".")[0]
    if not name or not (beside.is_dir() or beside.with_suffix(".py").is_file()):
        return ""
    return (
        f"; '{beside.name}' lies beside it, but a plugin's folder is not looked in: make a package of both "
        "(entry points), or put the folder on PYTHONPATH"
    )


def _named(error: BaseException) -> str:
    """An error's kind and text; one of a plugin's own may be unable to tell."""
    try:
        text = str(error)
    except Exception:
        text = "without a text that can be shown"
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
