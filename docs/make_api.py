"""Writes ``docs/api``: one page a public name, from its signature and its docstring."""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pilotage

FOLDER = Path(__file__).parent / "api"
SECTIONS = ("Parameters", "Attributes", "Returns", "Raises", "Notes", "Examples")
MODULES = ("filters", "lines", "planners")


def pages() -> dict[str, str]:
    """Text by file name."""
    out = {}
    for name in pilotage.__all__:
        found = getattr(pilotage, name)
        out[page_of(name)] = _module(name, found) if inspect.ismodule(found) else _entry(f"pl.{name}", found)
    return {"README.md": _index(), **out}


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


def _module(name: str, module: Any) -> str:
    parts = [f"# `pl.{name}`", "", _prose(inspect.getdoc(module) or "")]
    for inner in module.__all__:
        parts += ["", _entry(f"pl.{name}.{inner}", getattr(module, inner), level=2)]
    return "\n".join(parts).rstrip() + "\n"


def _entry(name: str, found: Any, level: int = 1) -> str:
    parts = [f"{'#' * level} `{name}`", ""]
    config = inspect.isclass(found) and hasattr(found, "model_fields")
    if not config:
        parts += ["```python", f"{name}{_signature(found)}", "```", ""]
    parts.append(_prose(_doc(found)))
    if config:
        parts += ["", *(f"- `{key}`" for key in found.model_fields)]
    elif inspect.isclass(found) and not issubclass(found, BaseException):
        for key, member in _members(found):
            shown = f"{key}{_signature(member, bound=True)}" if callable(member) else key
            parts += ["", f"{'#' * (level + 1)} `{shown}`", "", _prose(_doc(member))]
    return "\n".join(parts).rstrip() + "\n"


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
        for key, member in vars(base).items():
            raw = member.fget if isinstance(member, property) else getattr(member, "func", member)
            raw = getattr(raw, "__func__", raw)
            if not key.startswith("_") and inspect.isfunction(raw) and raw.__doc__:
                out[key] = raw if inspect.isfunction(member) or isinstance(member, staticmethod) else member
    return list(out.items())


def _signature(found: Callable[..., Any], *, bound: bool = False) -> str:
    """Parameters as they are called, without types: these are told in words."""
    try:
        signature = inspect.signature(found)
    except ValueError:
        return "(...)"
    parameters = [
        parameter.replace(annotation=inspect.Parameter.empty)
        for name, parameter in signature.parameters.items()
        if not (bound and name == "self")
    ]
    text = str(inspect.Signature(parameters))
    return re.sub(r"<(factory|object|function)[^>]*>", "...", text)


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
