"""A small commented example of one's own: a mission, a robot or a planner that runs at once."""

from __future__ import annotations

import re
from importlib import resources
from pathlib import Path

from pilotage.core.errors import InputError, unknown_name
from pilotage.core.whole_file import write_whole

TEMPLATES = resources.files("pilotage.missions") / "templates"
KINDS = ("mission", "planner", "robot")


def new(kind: str, name: str | None = None, folder: Path = Path()) -> tuple[Path, ...]:
    """Write an example; the first file is the mission to run.

    Parameters
    ----------
    kind
        ``mission``, ``planner`` or ``robot``.
    name
        What it is to be called; None: ``my-`` and its kind.

    Raises
    ------
    InputError
        Where there is no such kind, the name is none, or a file of that name is there already.
    """
    if kind not in KINDS:
        raise unknown_name("kind of example", kind, KINDS)
    called = f"my-{kind}" if name is None else name
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9-]{0,60}", called):
        raise InputError(f"new {kind}: expected a name of letters, digits and '-', found '{called}'")
    mission, plugin = folder / f"{called}.yaml", folder / f"{called.replace('-', '_')}.py"
    texts = {mission: (TEMPLATES / f"{kind}.yaml").read_text(encoding="utf-8")}
    if kind == "planner":
        texts[plugin] = (TEMPLATES / "planner.py.txt").read_text(encoding="utf-8")
    for path in texts:
        if path.exists():
            raise InputError(f"new {kind}: expected a name that is free, found '{path}' there already")
    if not folder.is_dir():
        raise InputError(f"new {kind}: expected a folder that is there, found none: '{folder}'")
    for path, text in texts.items():
        told = text.replace("NAME", called).replace("PLUGIN", plugin.name).replace("FILE", mission.name)
        write_whole(path, told)
    return tuple(texts)
