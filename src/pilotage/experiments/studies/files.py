"""Digests of the files that a study names, which tell whether they changed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from pilotage.core.errors import InputError
from pilotage.core.files import opened, read_yaml
from pilotage.experiments.named_files import WORDS, anchored, named_file
from pilotage.maps.ros_map import image_of

YAML = frozenset({".yaml", ".yml"})


def digests(values: Any) -> dict[str, str]:
    """Digests of the files that some values name, and of those that these name in turn, by their paths."""
    found: dict[str, str] = {}
    waiting = list(_named(values))
    while waiting:
        path = waiting.pop()
        real = str(path.resolve())
        if real not in found:
            digest = hashlib.sha256()
            with opened(path) as file:
                while part := file.read(1 << 20):
                    digest.update(part)
            found[real] = digest.hexdigest()[:16]
            if path.suffix.lower() in YAML:
                waiting += _inside(path)
    return found


def _named(values: Any) -> Iterable[Path]:
    if isinstance(values, Mapping):
        for key, value in values.items():
            if key not in WORDS:
                yield from _named(value)
    elif isinstance(values, list | tuple):
        for value in values:
            yield from _named(value)
    else:
        found = named_file(values)
        if found is not None:
            yield found


def _inside(path: Path) -> Iterable[Path]:
    """What a YAML file names, such as a map's picture: relative to the file."""
    try:
        values = read_yaml(path)
    except InputError:
        return ()
    found = list(_named(anchored(values, (path.parent,))))
    image = values.get("image") if isinstance(values, dict) else None
    if isinstance(image, str):
        with suppress(InputError):  # a ROS map's, which may lie beside it instead of where it says
            found.append(image_of(path, image))
    return tuple(found)
