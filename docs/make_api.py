"""Writes ``docs/api``: a page a public name, one of all roles, from signatures and docstrings."""

from __future__ import annotations

import dataclasses
import inspect
import re
import sys
from collections.abc import Callable
from enum import Enum
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pilotage
from pilotage.evaluation.tasks.task import TaskSetting
from pilotage.experiments.roles import ROLES
from pilotage.maps.world_map import WorldMap
from pilotage.sim.bodies.motion import SIMULATED_MOTIONS
from pilotage.sim.faults.fault import FaultSetting
from pilotage.sim.people.people import PeopleSetting
from pilotage.sim.sensing.sensor import SIMULATED_SENSORS, Carrier
from pilotage.stack.journal import Journal
from pilotage.stack.knowledge import RobotKnowledge, TaskKnowledge
from pilotage.stack.navigator.navigator import Parts
from pilotage.stack.patrol.strategy import PatrolSetting
from pilotage.stack.planning.grid_planner import GRID_PLANNERS

FOLDER = Path(__file__).parent / "api"
SECTIONS = ("Parameters", "Attributes", "Returns", "Raises", "Notes", "Examples")
MODULES = ("filters", "lines", "planners")
SIMULATED = {
    "simulated motion": SIMULATED_MOTIONS,
    "simulated sensor": SIMULATED_SENSORS,
    "planner over cells": GRID_PLANNERS,
}
TOLD = (
    *(RobotKnowledge, TaskKnowledge, WorldMap, Parts, Journal, Carrier),
    *(TaskSetting, FaultSetting, PeopleSetting, PatrolSetting),
)
"""What components are built with."""


def pages() -> dict[str, str]:
    """Text by file name."""
    out = {}
    for name in pilotage.__all__:
        found = getattr(pilotage, name)
        out[page_of(name)] = _module(name, found) if inspect.ismodule(found) else _entry(f"pl.{name}", found)
    return {"README.md": _index(), "roles.md": _roles(), **out}


def page_of(name: str) -> str:
    """A page's file name; some file systems do not tell ``Run`` from ``run``."""
    return f"class-{name}.md" if name[0].isupper() else f"{name}.md"


def _index() -> str:
    lines = [
        "# The public face",
        "",
        "`import pilotage as pl`: everything below, loaded when it is first asked for. Written by `make api`",
        "from the docstrings, whose examples run as tests.",
        "",
        "| | |",
        "| --- | --- |",
    ]
    for name in pilotage.__all__:
        summary = _summary(getattr(pilotage, name))
        lines.append(f"| [`pl.{name}`]({page_of(name)}) | {summary} |")
    return "\n".join(lines) + "\n"


def _summary(found: object) -> str:
    text = inspect.getdoc(found) or ""
    return " ".join(text.split("\n\n", 1)[0].split()).replace("``", "`").replace("|", "\\|")


def _roles() -> str:
    """Every role's protocol, and the values that its methods take and give."""
    parts = [
        "# The roles",
        "",
        "What a class that is registered for a role has to have: attributes and methods, what these take and",
        "give, and the values that are handed over. Names carry the unit. Written by `make api` from the",
        "protocols; [CONTRIBUTING](../../CONTRIBUTING.md) shows how a component is added. Of a motion and a",
        "sensor the data sheet is registered, and a class that simulates it for that.",
    ]
    values: dict[type, None] = dict.fromkeys(TOLD)
    registries: dict[str, Any] = ROLES | SIMULATED
    for role, registry in registries.items():
        name, protocol = _protocol_of(registry)
        kind = protocol.__name__
        parts += ["", f"## {role}", "", f"`{name}` of `{_place(protocol)}`, a `{kind}`.", ""]
        parts.append(_entry(kind, protocol, level=2, typed=True).partition("\n\n")[2])
        looked = [f"`{gives.method}`: {gives.expected}" for gives in registry.gives]
        if looked:
            parts += ["", "What is looked at: " + "; ".join(looked).replace("`__init__`", "once built") + "."]
        values |= dict.fromkeys(found for _, member in _members(protocol) for found in _own_types(member))
    parts += ["", "## What is handed over", ""]
    for value in sorted(values, key=lambda value: value.__name__):
        parts += [_entry(value.__name__, value, level=3, typed=True), f"In `{_place(value)}`.", ""]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(parts))


def _protocol_of(registry: Any) -> tuple[str, type]:
    """A registry's name, and what its entries are."""
    for module in [module for key, module in sys.modules.items() if key.startswith("pilotage.")]:
        for name in vars(module).get("__annotations__", ()):
            if getattr(module, name, None) is registry:
                (protocol,) = get_args(get_type_hints(module)[name])
                return name, (get_args(protocol) or (protocol,))[0]
    raise LookupError(registry.role)


def _place(found: type) -> str:
    return found.__module__.removeprefix("pilotage.").replace(".", "/") + ".py"


def _own_types(member: Any) -> set[type]:
    """The dataclasses and enumerations of ours that a method or a property takes and gives."""
    found: set[type] = set()
    hints = list(get_type_hints(getattr(member, "fget", member)).values())
    while hints:
        hint = hints.pop()
        hints += get_args(hint)
        if inspect.isclass(hint) and hint.__module__.startswith("pilotage"):
            found.add(hint)
    return found


def _module(name: str, module: Any) -> str:
    parts = [f"# `pl.{name}`", "", _prose(inspect.getdoc(module) or "")]
    for inner in module.__all__:
        parts += ["", _entry(f"pl.{name}.{inner}", getattr(module, inner), level=2)]
    return "\n".join(parts).rstrip() + "\n"


def _entry(name: str, found: Any, level: int = 1, *, typed: bool = False) -> str:
    parts = [f"{'#' * level} `{name}`", ""]
    config = inspect.isclass(found) and hasattr(found, "model_fields")
    if not (config or getattr(found, "_is_protocol", False) or _is_enum(found)):
        parts += ["```python", f"{name}{_signature(found, typed=typed)}", "```", ""]
    parts.append(_prose(_doc(found)))
    if _is_enum(found):
        parts += ["", *(f"- `{member.name}`" for member in found)]
    elif typed and not dataclasses.is_dataclass(found):
        attributes = getattr(found, "__annotations__", {}).items()
        parts += ["", *(f"- `{key}: {kind}`" for key, kind in attributes if not key.startswith("_"))]
    elif config:
        parts += ["", *(f"- `{key}`" for key in found.model_fields)]
    if inspect.isclass(found) and not config and not issubclass(found, BaseException):
        for key, member in _members(found):
            shown = f"{key}{_signature(member, bound=True, typed=typed)}" if callable(member) else key
            if typed and isinstance(member, property):
                shown += f": {member.fget.__annotations__['return']}"
            parts += ["", f"{'#' * (level + 1)} `{shown}`", "", _prose(_doc(member))]
    return "\n".join(parts).rstrip() + "\n"


def _is_enum(found: object) -> bool:
    return inspect.isclass(found) and issubclass(found, Enum)


def _doc(found: Any) -> str:
    """Its own docstring; of a class without parameters there, those of the one that it is made from too."""
    own = inspect.getdoc(found) or ""
    if not inspect.isclass(found) or "Parameters\n---" in own:
        return own
    for base in found.__mro__[1:-1]:
        text = inspect.cleandoc(base.__doc__ or "")
        if base.__module__.startswith("pilotage") and "Parameters\n---" in text:
            head, mark, examples = own.partition("\n\nExamples\n--------\n")
            return f"{head}\n\n{text}{mark}{examples}"
    return own


def _members(found: type) -> list[tuple[str, Any]]:
    """Public methods and properties with docstrings, its own and those of our own bases."""
    out: dict[str, Any] = {}
    for base in reversed(found.__mro__):
        if not base.__module__.startswith("pilotage"):
            continue
        for key, member in list(vars(base).items()):
            raw = member.fget if isinstance(member, property) else getattr(member, "func", member)
            raw = getattr(raw, "__func__", raw)
            if not key.startswith("_") and inspect.isfunction(raw) and raw.__doc__:
                out[key] = raw if inspect.isfunction(member) or isinstance(member, staticmethod) else member
    return list(out.items())


def _signature(found: Callable[..., Any], *, bound: bool = False, typed: bool = False) -> str:
    """Parameters as they are called; without types these are told in words."""
    try:
        signature = inspect.signature(found)
    except ValueError:
        return "(...)"
    kinds = {
        name: _Word(each.annotation) if typed else each.empty for name, each in signature.parameters.items()
    }
    parameters = [
        parameter.replace(
            annotation=parameter.empty if parameter.annotation is parameter.empty else kinds[name]
        )
        for name, parameter in signature.parameters.items()
        if not (bound and name == "self")
    ]
    gives: Any = signature.empty
    if typed and not inspect.isclass(found):
        gives = _Word(signature.return_annotation)
    text = str(inspect.Signature(parameters, return_annotation=gives))
    return re.sub(r"<(factory|object|function)[^>]*>", "...", text)


class _Word(str):
    """An annotation as it is written, without quotes."""

    __slots__ = ()
    __repr__ = str.__str__


def _prose(text: str) -> str:
    """Numpy-style sections as Markdown."""
    lines, section = inspect.cleandoc(text).split("\n"), ""
    out: list[str] = []
    index = 0
    while index < len(lines):
        line = lines[index]
        if line in SECTIONS and index + 1 < len(lines) and set(lines[index + 1]) == {"-"}:
            _close(out, section)
            section = line
            out += [f"**{line}**", ""]
            if section == "Examples":
                out.append("```python")
            index += 2
            continue
        if section in SECTIONS[:4] and line and not line.startswith(" "):
            line = f"- `{line}`"
        out.append(line.replace("``", "`") if section != "Examples" else line)
        index += 1
    _close(out, section)
    return "\n".join(out).rstrip()


def _close(out: list[str], section: str) -> None:
    """End what the section before opened."""
    if section == "Examples":
        while out and not out[-1]:
            out.pop()
        out += ["```", ""]


def write(folder: Path = FOLDER) -> None:
    """Write all pages and remove those of names that are gone."""
    folder.mkdir(exist_ok=True)
    made = pages()
    for old in folder.glob("*.md"):
        if old.name not in made:
            old.unlink()
    for name, text in made.items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write(*map(Path, sys.argv[1:2]))
