"""Loading a mission: a shipped name or a file, with ``key=value`` overrides."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from pilotage.core.config import validate
from pilotage.core.errors import InputError, nearest, unknown_name
from pilotage.core.file_kinds import check_kind
from pilotage.core.neighbours import found_instead
from pilotage.core.plugins import add_plugins, is_package, named_plugins
from pilotage.experiments.named_files import anchored
from pilotage.experiments.resolve import check_components, component_places
from pilotage.experiments.values import (
    apply_override,
    apply_setting,
    merge,
    parse_shipped,
    parse_yaml,
    read_text,
)
from pilotage.missions.mission import TOP_KEYS, Mission
from pilotage.missions.old_keys import refuse_old_keys

SHIPPED = resources.files("pilotage.missions") / "files"


def shipped_missions() -> list[str]:
    """Names of the missions that come with pilotage."""
    return sorted(
        entry.name.removesuffix(".yaml") for entry in SHIPPED.iterdir() if entry.name.endswith(".yaml")
    )


def load_mission(name_or_path: str, overrides: Sequence[str] = (), seed: int | None = None) -> Mission:
    """Load, override and validate a mission.

    Parameters
    ----------
    name_or_path
        A shipped mission's name or the path of a YAML file.
    overrides
        ``dotted.key=value``; the value is read as YAML. Changing a component's ``name`` drops the
        parameters of the old one. ``@FILE`` lays a YAML file over the mission, such as the parameters
        that a calibration wrote.
    seed
        Replaces ``run.seed`` where given.

    Raises
    ------
    InputError
        One line: what was expected, what was found, the nearest right name.
    """
    return mission_of(read_mission(name_or_path), overrides, seed)


def mission_of(
    values: Mapping[str, Any],
    overrides: Sequence[str] = (),
    seed: int | None = None,
    settings: Mapping[str, Any] | None = None,
    *,
    recorded: bool = False,
) -> Mission:
    """Override and validate a mission that was read before; ``values`` stay as they are.

    Parameters
    ----------
    settings
        By dotted key, values that take the mission's place, after ``overrides``.
    recorded
        Whether it is only read, of what has run: neither its plugins nor its components are looked for.

    Raises
    ------
    InputError
        As ``load_mission``.
    """
    changed = copy.deepcopy(dict(values))
    for override in overrides:
        if override.startswith("@"):
            changed = merge(changed, read_parameters(override[1:]))
        else:
            apply_override(changed, override)
    for key, value in (settings or {}).items():
        apply_setting(changed, key, value)
    if seed is not None:
        apply_setting(changed, "run.seed", seed)
    refuse_old_keys(changed)
    if recorded:
        return validate(Mission, changed, "")
    plugins = changed.get("plugins", ())
    if isinstance(plugins, list | tuple):
        names = [str(name) for name in plugins]
        add_plugins(names, listed=True)
        changed["plugins"] = [*filter(is_package, names), *named_plugins()]
    mission = validate(Mission, changed, "", more=lambda: component_places(changed))
    check_components(mission)
    return mission


def read_parameters(file: str) -> dict[str, Any]:
    """Read a file of parameters that is laid over a mission; only what a mission knows may be in it."""
    path = Path(file)
    if not path.is_file():
        found = found_instead(path, {".yaml", ".yml"})
        raise InputError(f"--set '@{file}': expected a YAML file of parameters, found {found}")
    values = _at_their_places(parse_yaml(read_text(path), file), path.parent)
    unknown = [str(key) for key in values if key not in TOP_KEYS]
    if unknown:
        known = list(TOP_KEYS)
        close = nearest(unknown[0], known)
        hint = f"did you mean '{close}'?" if close else "known: " + ", ".join(known)
        raise InputError(f"{file}: unknown key '{unknown[0]}'; {hint}")
    return values


def read_mission(name_or_path: str, extended_by: tuple[str, ...] = ()) -> dict[str, Any]:
    """Read a mission's YAML with its ``extends`` resolved, without validating it.

    ``extended_by``: those on the way to it, which it must not extend in turn.
    """
    path = Path(name_or_path)
    if _is_path(name_or_path):
        if not path.is_file():
            found = found_instead(path, {".yaml", ".yml"})
            if path.stem in shipped_missions():
                found = f"none there; did you mean the shipped mission '{path.stem}'?"
            raise InputError(f"mission file '{name_or_path}': expected a YAML file, found {found}")
        values = parse_yaml(read_text(path), str(path))
        check_kind(values, "mission", str(path))
        values = _at_their_places(values, path.parent)
    elif name_or_path in shipped_missions():
        values = parse_shipped((SHIPPED / f"{name_or_path}.yaml").read_text(), name_or_path)
    else:
        raise unknown_name("mission", name_or_path, shipped_missions())
    return extended(values, name_or_path, extended_by)


def extended(values: dict[str, Any], where: str, extended_by: tuple[str, ...] = ()) -> dict[str, Any]:
    """A mission's values with its ``extends`` resolved; ``extended_by`` must not come up again.

    Raises
    ------
    InputError
        Where it extends itself or something that is no mission.
    """
    values = dict(values)
    base = values.pop("extends", None)
    if base is None:
        return values
    if not isinstance(base, str):
        raise InputError(f"{where}: extends: expected a shipped mission's name or a file, found {base}")
    before = {_place(name) for name in (values.get("mission"), where, *extended_by) if isinstance(name, str)}
    if _place(base) in before:
        raise InputError(f"{where}: extends: a mission cannot extend itself")
    found = read_mission(base, (*extended_by, where))
    if "mission" in values and "description" in found:
        # What one says of itself is not true of another that has its own name, and its own goal perhaps.
        found = {**found, "description": f"extends {found.get('mission', base)}"}
    return merge(found, values)


def _is_path(name: str) -> bool:
    """Whether a mission is named by its file."""
    return Path(name).suffix in {".yaml", ".yml"} or "/" in name


def _place(name: str) -> str:
    """What is the same of all names of one mission: by links and ``..`` a file has many."""
    return os.path.realpath(name) if _is_path(name) else name


def _at_their_places(values: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A file's values, the files that they name found from its folder, else from where one is.

    Those that are in neither are named as if beside it, where they were meant to be.
    """
    placed: dict[str, Any] = anchored(values, (folder,))
    world, plugins, base = values.get("world"), values.get("plugins"), placed.get("extends")
    if isinstance(plugins, list):
        placed["plugins"] = [name if is_package(str(name)) else str(folder / str(name)) for name in plugins]
    if isinstance(base, str) and _is_path(base):
        placed["extends"] = _beside(base, folder)
    if isinstance(world, dict) and isinstance(world.get("map"), str) and Path(world["map"]).suffix:
        placed["world"]["map"] = _beside(placed["world"]["map"], folder)
    return placed


def _beside(name: str, folder: Path) -> str:
    return name if Path(name).is_file() else str(folder / name)
