"""The numbers that a config may hold, and the ends of what each may be."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel

from pilotage.core.config import LARGEST, LARGEST_WHOLE, SMALLEST, Config

Place = tuple[str | int, ...]
"""Keys and indices that lead to a number."""


def numbers_of(config: Config) -> Iterator[tuple[Place, str, list[float]]]:
    """Each number of a config and of the configs in it: where it is, whose it is, and the ends of its range.

    Whose: the class and the field, alike for configs that several components have in them. The ends are
    those that are declared and the next number inside each, else the largest and smallest that any config
    takes. A list's first and last are its numbers.
    """
    for name, field in type(config).model_fields.items():
        value = getattr(config, name)
        owner = next(cls for cls in type(config).__mro__ if name in getattr(cls, "__annotations__", {}))
        whose = f"{owner.__name__}.{name}"
        if isinstance(value, Config):
            for place, inner, ends in numbers_of(value):
                yield (name, *place), inner, ends
            continue
        kind = _kind(field.annotation)
        if kind is None:
            continue
        ends = _ends(kind, [*field.metadata, *_notes(field.annotation)])
        for place in _places(value):
            yield (name, *place), whose + ".".join(map(str, place)), ends


def changed(values: dict[str, Any], place: Place, value: float) -> dict[str, Any]:
    """Plain values with another number at a place."""
    first, *rest = place
    if not rest:
        return {**values, first: value} if isinstance(first, str) else values
    inner = values[first]  # type: ignore[index]
    if isinstance(inner, dict):
        return {**values, first: changed(inner, tuple(rest), value)}  # type: ignore[dict-item]
    return {**values, first: _replaced(inner, rest, value)}  # type: ignore[dict-item]


PARAMETERS: dict[tuple[str, str], dict[str, Any]] = {
    ("people", "social-force"): {"count": 4, "doors_m": [[1.0, 4.0], [9.0, 6.0]]},
    ("people", "intruder"): {"enters_from_s": 0.0, "enters_until_s": 0.2, "doors_m": [[1.0, 4.0]]},
    **{("local_controller", name): {"rollouts": 32} for name in ("gap-horizon", "mppi")},
}
"""Where a component's example leaves numbers out, or takes longer than its numbers need."""


def _replaced(values: Any, place: list[Any], value: float) -> Any:
    index, *rest = place
    return [
        (_replaced(item, rest, value) if rest else value) if i == index else item
        for i, item in enumerate(values)
    ]


def _places(value: Any) -> Iterator[Place]:
    if isinstance(value, BaseModel | dict | str):
        return
    if isinstance(value, tuple | list):
        for i in sorted({0, len(value) - 1}) if value else ():
            for place in _places(value[i]):
                yield (i, *place)
        return
    if not isinstance(value, bool):
        yield ()


def _kind(annotation: Any) -> type | None:
    if annotation in (int, float):
        return annotation  # type: ignore[no-any-return]
    kinds = [_kind(part) for part in getattr(annotation, "__args__", ())]
    return next((kind for kind in (float, int) if kind in kinds), None)


def _notes(annotation: Any) -> list[Any]:
    own = list(getattr(annotation, "__metadata__", ()))
    return own + [note for part in getattr(annotation, "__args__", ()) for note in _notes(part)]


def _ends(kind: type, notes: list[Any]) -> list[float]:
    bounds = {
        key: getattr(inner, key)
        for note in notes
        for inner in (note, *getattr(note, "metadata", ()))
        for key in ("ge", "gt", "le", "lt")
        if getattr(inner, key, None) is not None
    }
    low, high = bounds.get("ge"), bounds.get("le")
    above, below = bounds.get("gt"), bounds.get("lt")
    if kind is int:
        lowest = low if low is not None else above + 1 if above is not None else -LARGEST_WHOLE
        highest = high if high is not None else below - 1 if below is not None else LARGEST_WHOLE
        return sorted({lowest, min(lowest + 1, highest), max(highest - 1, lowest), highest})
    lowest = low if low is not None else above if above is not None else -LARGEST
    highest = high if high is not None else below if below is not None else LARGEST
    ends = {_beside(lowest, 1.0), _beside(highest, -1.0)}
    ends |= {float(lowest)} if above is None else set()
    ends |= {float(highest)} if below is None else set()
    if lowest < 0.0 < highest:
        ends |= {-SMALLEST, 0.0, SMALLEST}
    return sorted(ends)


def _beside(end: float, side: float) -> float:
    """The next number inside: none is nearer to zero than the smallest that a config takes."""
    return side * SMALLEST if end == 0.0 else math.nextafter(end, math.copysign(math.inf, side))
