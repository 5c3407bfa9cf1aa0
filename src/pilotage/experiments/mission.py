"""Loading a mission: a shipped name or a file, with ``key=value`` overrides."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import yaml

from pilotage.core.config import validate
from pilotage.core.errors import InputError, nearest, unknown_name
from pilotage.experiments.kinds import KINDS, kind_name
from pilotage.missions.mission import TOP_KEYS, Mission

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


def mission_of(values: dict[str, Any], overrides: Sequence[str] = (), seed: int | None = None) -> Mission:
    """Override and validate a mission that was read before; ``values`` stay as they are.

    Raises
    ------
    InputError
        As ``load_mission``.
    """
    values = copy.deepcopy(values)
    for override in overrides:
        if override.startswith("@"):
            values = merge(values, read_parameters(override[1:]))
        else:
            apply_override(values, override)
    if seed is not None:
        values.setdefault("run", {})["seed"] = seed
    return validate(KINDS[kind_name(values)]().schema, values, "")


def read_parameters(file: str) -> dict[str, Any]:
    """Read a file of parameters that is laid over a mission; only what a mission knows may be in it."""
    path = Path(file)
    if not path.is_file():
        raise InputError(f"--set '@{file}': expected a YAML file of parameters, found none there")
    values = parse_yaml(read_text(path), file)
    unknown = [str(key) for key in values if key not in TOP_KEYS]
    if unknown:
        known = list(TOP_KEYS)
        close = nearest(unknown[0], known)
        hint = f"did you mean '{close}'?" if close else "known: " + ", ".join(known)
        raise InputError(f"{file}: unknown key '{unknown[0]}'; {hint}")
    return values


def read_mission(name_or_path: str) -> dict[str, Any]:
    """Read a mission's YAML with its ``extends`` resolved, without validating it."""
    path = Path(name_or_path)
    looks_like_file = path.suffix in {".yaml", ".yml"} or "/" in name_or_path
    if looks_like_file:
        if not path.is_file():
            raise InputError(f"mission file '{name_or_path}': expected a YAML file, found none there")
        values = parse_yaml(read_text(path), str(path))
        _anchor_map(values, path.parent)
    elif name_or_path in shipped_missions():
        values = parse_yaml((SHIPPED / f"{name_or_path}.yaml").read_text(), name_or_path)
    else:
        raise unknown_name("mission", name_or_path, shipped_missions())
    base = values.pop("extends", None)
    if base is None:
        return values
    if not isinstance(base, str):
        raise InputError(f"{name_or_path}: extends: expected the name of a shipped mission, found {base}")
    if base == values.get("mission") or base == name_or_path:
        raise InputError(f"{name_or_path}: extends: a mission cannot extend itself")
    return merge(read_mission(base), values)


def _anchor_map(values: dict[str, Any], folder: Path) -> None:
    """Let the relative paths of the world's files start from the mission file's folder."""
    world = values.get("world")
    if not isinstance(world, dict):
        return
    ground = world.get("ground")
    places = [(world, key) for key in ("map", "sheet", "landmarks")]
    if isinstance(ground, dict):
        places += [(ground, key) for key in ("file", "obstacles", "environment", "landmarks")]
    for holder, key in places:
        source = holder.get(key)
        if isinstance(source, str) and (folder / source).is_file():
            holder[key] = str(folder / source)


def read_text(path: Path) -> str:
    """Read a text file; InputError where it cannot be read."""
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"'{path}': expected a readable text file, found: {error}") from None


def parse_yaml(text: str, where: str) -> dict[str, Any]:
    """Parse a YAML mapping; InputError with the line where it breaks."""
    try:
        values = yaml.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f" line {mark.line + 1}" if mark is not None else ""
        problem = getattr(error, "problem", None) or "not YAML"
        raise InputError(f"{where}{line}: expected YAML, found: {problem}") from None
    if not isinstance(values, dict):
        found = "an empty file" if values is None else f"a {type(values).__name__}"
        raise InputError(f"{where}: expected a mapping of keys, found {found}")
    return values


def merge(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Lay ``changes`` over ``base``: mappings key by key, all else replaced.

    A component whose ``name`` changes starts from nothing: its parameters are not the old one's.
    """
    merged = copy.deepcopy(base)
    for key, value in changes.items():
        old = merged.get(key)
        if isinstance(value, dict) and isinstance(old, dict) and not _renames(old, value):
            merged[key] = merge(old, value)
        else:
            merged[key] = copy.deepcopy(value)
    return merged


def _renames(old: dict[str, Any], new: dict[str, Any]) -> bool:
    return "name" in new and new["name"] != old.get("name")


def parse_override(override: str) -> tuple[list[str], Any]:
    """Split ``dotted.key=value`` into the key's parts and the value, which is read as YAML.

    Raises
    ------
    InputError
        If the text is not of that form.
    """
    key, equals, text = override.partition("=")
    parts = key.strip().split(".")
    if not equals or not all(parts):
        raise InputError(f"--set '{override}': expected KEY=VALUE such as stack.localizer.gate=0.99")
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError:
        raise InputError(f"--set '{override}': the value is not YAML") from None
    if isinstance(value, str):
        value = _number(value)
    return parts, value


def apply_override(values: dict[str, Any], override: str) -> None:
    """Apply one ``dotted.key=value`` in place.

    Raises
    ------
    InputError
        If the text is not of that form or the key leads through something that has no keys.
    """
    parts, value = parse_override(override)
    top = list(TOP_KEYS)
    if parts[0] not in top:
        close = nearest(parts[0], top)
        hint = f"did you mean '{close}'?" if close else "known: " + ", ".join(top)
        raise InputError(f"--set '{override}': unknown key '{parts[0]}'; {hint}")
    place: Any = values
    for depth, part in enumerate(parts[:-1]):
        inner = _child(place, part, override)
        if inner is None:
            inner = {}
            _put(place, part, inner, override)
        if not isinstance(inner, dict | list):
            raise InputError(
                f"--set '{override}': '{'.'.join(parts[: depth + 1])}' is a value, it has no keys"
            )
        place = inner
    last = parts[-1]
    if last == "name" and isinstance(place, dict) and place.get("name") != value:
        place.clear()
    _put(place, last, value, override)


def _number(text: str) -> Any:
    """YAML 1.1 reads 1e-3 as text; take such a text for the number it is."""
    try:
        return float(text)
    except ValueError:
        return text


def _child(place: Any, part: str, override: str) -> Any:
    if isinstance(place, list):
        return place[_index(place, part, override)]
    return place.get(part)


def _put(place: Any, part: str, value: Any, override: str) -> None:
    if isinstance(place, list):
        place[_index(place, part, override)] = value
    else:
        place[part] = value


def _index(place: list[Any], part: str, override: str) -> int:
    if not part.isdigit() or int(part) >= len(place):
        raise InputError(f"--set '{override}': expected an index from 0 to {len(place) - 1}, found '{part}'")
    return int(part)
