"""Base of every config: frozen, nothing unknown accepted, finite numbers; errors become one line."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from types import NoneType, UnionType
from typing import Any, ClassVar, Self, TypeAlias, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from pilotage.core.errors import InputError, nearest

FARTHEST_M = 1e9
"""No place on a map is farther from its origin."""


class Config(BaseModel):
    """A frozen pydantic model that refuses unknown keys, NaN and infinities."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        validate_default=True,
        strict=False,
        # Of the hundred and more that a run imports it validates twenty: the others' validators are not made.
        defer_build=True,
        # A component's parameters are written out before they are validated: not a number stays what it is.
        ser_json_inf_nan="constants",
    )

    largest: ClassVar[float] = 1e15
    """Metres, radians, seconds, their variances and counts in files are far within."""

    @model_validator(mode="before")
    @classmethod
    def _true_is_no_number(cls, values: Any) -> Any:
        """Refuse a truth value where it would pass for 0 or 1: as a word it fails at its own key."""
        if not isinstance(values, Mapping):
            return values
        words = {}
        for name, value in values.items():
            field = cls.model_fields.get(name) if isinstance(value, bool) else None
            if (
                field is not None
                and _takes(field.annotation, float, int)
                and not _takes(field.annotation, bool)
            ):
                words[name] = str(value).lower()
        return {**values, **words} if words else values

    @model_validator(mode="after")
    def _numbers_are_quantities(self) -> Self:
        """Refuse what is finite and yet no length, time or variance, in text and lists too."""
        for name in type(self).model_fields:
            wrong = _out_of_range(getattr(self, name), name, self.largest)
            if wrong is not None:
                raise ValueError(wrong)
        return self


def _takes(annotation: Any, *kinds: type) -> bool:
    """Whether an annotation such as ``float | None`` names one of the types itself."""
    return annotation in kinds or any(_takes(part, *kinds) for part in getattr(annotation, "__args__", ()))


class MapConfig(Config):
    """A config of places and lengths on a map, which are no farther than records hold."""

    largest: ClassVar[float] = FARTHEST_M


SMALLEST, LARGEST, LARGEST_WHOLE = 1e-100, Config.largest, 2**63 - 1
"""Sizes of the numbers in files."""

_DEEPEST = 4
"""Levels of a file in which a key is looked for that stands at the wrong place."""
_SHOULD = "Input should be "
_LISTS = (list, tuple, dict)

ConfigT = TypeVar("ConfigT", bound=BaseModel)


Places: TypeAlias = Mapping[str, type[BaseModel]]
"""What can be set at dotted places of a file beside what its model has."""


def validate(
    model: type[ConfigT], values: Any, where: str, more: Callable[[], Places] | None = None
) -> ConfigT:
    """Validate ``values`` against ``model``.

    Parameters
    ----------
    where
        Dotted place of the values in the user's file, put before each key in the message.
    more
        Asked where a key is unknown: where else it may belong.

    Raises
    ------
    InputError
        One line naming the first wrong key, what was expected and found, and for an unknown key the
        nearest right one.
    """
    if not isinstance(values, dict):
        raise InputError(f"{where or 'file'}: expected a mapping of keys, found {_show(values)}")
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise InputError(describe(error, model, where, more)) from None


def _out_of_range(value: Any, place: str, largest: float) -> str | None:
    """What is wrong with a number that no quantity has: products of such are infinite or no numbers."""
    if isinstance(value, float):
        if math.isfinite(value) and value != 0.0 and not SMALLEST <= abs(value) <= largest:
            return (
                f"{place}: expected 0 or a number from {SMALLEST:g} to {largest:g} in size, found {value:g}"
            )
    elif isinstance(value, int):
        if abs(value) > LARGEST_WHOLE:
            return f"{place}: expected a whole number below 2^63, found {str(value)[:30]}"
    elif isinstance(value, list | tuple):
        wrong = (_out_of_range(item, f"{place}.{i}", largest) for i, item in enumerate(value))
        return next((text for text in wrong if text), None)
    return None


def describe(
    error: ValidationError, model: type[BaseModel], where: str, more: Callable[[], Places] | None = None
) -> str:
    """Turn a pydantic error into one line: place, expected, found, nearest right name."""
    errors = error.errors(include_url=False)
    # An unknown key is the likelier slip and explains a missing one: say it first.
    first = next((e for e in errors if e["type"] == "extra_forbidden"), errors[0])
    path = [str(part) for part in first["loc"]]
    kinds = _kinds_refused(model, errors, path)
    said = _without_tags(model, path[:-1] if kinds else path)
    place = ".".join([where, *said] if where else said)
    if kinds:
        return f"{place}: input should be {_as_of_a_file(' or '.join(kinds))}, found {_show(first['input'])}"
    if first["type"] == "extra_forbidden":
        known = _fields_at(model, path[:-1])
        close = nearest(path[-1], known)
        away = elsewhere(model, path[-1], more() if more else {}, exactly=close is not None)
        close = (f"{where}.{away}" if where else away) if away else close
        # Such as a disc's radius in a polygon: neither another key nor another place is meant.
        if len(path) > 2 and path[-1] in _taken_by_others(model, path[:-1]):
            close = None
        hint = f"did you mean '{close}'?" if close else "known keys: " + ", ".join(sorted(known))
        return f"{place}: unknown key; {hint}"
    if first["type"] == "missing":
        where_listed = getattr(_model_at(model, path), "where_listed", None)
        hint = f"; {where_listed(path[-1])}" if where_listed else ""
        return f"{place}: missing; it has to be given{hint}"
    known = _choices_of(first)
    if known:
        key, found = first.get("ctx", {}).get("discriminator", ""), first["input"]
        if key:
            # One that is told by a function has the function's name here, which no file knows.
            said = [part for part in (place, key.strip("'")) if part and not part.endswith("()")]
            place, found = ".".join(said), first["ctx"]["tag"]
        close = nearest(str(found), known)
        hint = f"did you mean '{close}'?" if close else "known: " + ", ".join(known)
        return f"{place}: unknown value {_show(found)}; {hint}"
    message = first["msg"].removeprefix("Value error, ")
    if first["type"] == "model_type":
        message = "expected a mapping with keys of " + ", ".join(sorted(_fields_at(model, path)))
    if first["type"] in {"too_long", "too_short"}:
        bound, key = ("at most", "max_length") if first["type"] == "too_long" else ("at least", "min_length")
        message = f"expected {bound} {first['ctx'][key]} items, found {first['ctx']['actual_length']}"
    message = _as_of_a_file(message[:1].lower() + message[1:])
    # A rule among several keys of one level names the one that it is about.
    key, colon, rest = message.partition(": ")
    if (
        place
        and colon
        and first["type"] == "value_error"
        and key.partition(".")[0] in _fields_at(model, path)
    ):
        place, message = f"{place}.{key}", rest
    # A rule that says itself what it found, or is about the whole file: the dump would only bury it.
    if place and ", found " not in message:
        message += f", found {_show(first['input'])}"
    return f"{place}: {message}" if place else message


def _as_of_a_file(message: str) -> str:
    """A file knows mappings and lists, not Python's classes."""
    message = re.sub(r" or instance of \w+$", "", message)
    return message.replace("a valid dictionary", "a mapping").replace("a valid tuple", "a list")


def _kinds_refused(model: type[BaseModel], errors: Sequence[Mapping[str, Any]], path: list[str]) -> list[str]:
    """What a value should be that may be of several plain kinds and is of none; empty: it may be of one.

    Pydantic tells an error for each kind and puts the kind behind the key.
    """
    field = _model_at(model, path[:-2]).model_fields.get(path[-2]) if len(path) > 1 else None
    kinds = [] if field is None else [kind for kind in get_args(field.annotation) if kind is not NoneType]
    if field is None or len(kinds) < 2 or get_origin(field.annotation) not in (Union, UnionType):
        return []
    said = [error["msg"] for error in errors if [str(part) for part in error["loc"][:-1]] == path[:-1]]
    if not all(
        text.startswith(_SHOULD) for text in said
    ):  # a rule of one kind tells more than all kinds' names
        return []
    return [text.removeprefix(_SHOULD).split(", ")[0] for text in said]


def elsewhere(model: type[BaseModel], key: str, more: Places, *, exactly: bool = False) -> str | None:
    """The dotted place at which a key belongs that stands where it is unknown, the one nearest to the top.

    A key that begins as the asked one goes on counts for it (``radius`` is ``radius_m``) unless it has to be
    named ``exactly``.
    """
    places, level = [], [("", model), *((f"{place}.", other) for place, other in more.items())]
    for _ in range(_DEEPEST):
        inner: list[tuple[str, type[BaseModel]]] = []
        for place, owner in level:
            for name, field in owner.model_fields.items():
                places.append((name, place + name))
                found = _model_in(field.annotation)
                if found is not None and get_origin(field.annotation) not in _LISTS:
                    inner.append((f"{place}{name}.", found))
        level = inner
    same = [place for name, place in places if name == key]
    if not same and not exactly:
        same = [place for name, place in places if len(key) > 2 and name.startswith(f"{key.lower()}_")]
    return min(same, key=lambda place: place.count(".")) if same else None


def _choices_of(error: Mapping[str, Any]) -> list[str]:
    """The texts among which a value had to be, where a text stood that is none of them."""
    context = error.get("ctx", {})
    if error["type"] == "union_tag_invalid":
        return re.findall(r"'([^']+)'", str(context["expected_tags"]))
    if error["type"] in {"literal_error", "enum"} and isinstance(error["input"], str):
        return re.findall(r"'([^']+)'", str(context["expected"]))
    return []


def _fields_at(model: type[BaseModel], path: list[str]) -> list[str]:
    """Names of the fields of the model that ``path`` leads to."""
    return list(_model_at(model, path).model_fields)


def _model_at(model: type[BaseModel], path: list[str]) -> type[BaseModel]:
    """The model that ``path`` leads to, or the last one on the way there."""
    return _led_to(model, path)[0]


def _led_to(model: type[BaseModel], path: list[str]) -> tuple[type[BaseModel], Any]:
    """That model, and what the last field on the way there may be."""
    current: type[BaseModel] = model
    annotation: Any = None
    for part in path:
        field = current.model_fields.get(part)
        if field is not None:
            annotation = field.annotation
        inner = _model_in(annotation) if field is not None else _alternatives(annotation).get(part)
        if inner is None:
            continue
        current = inner
    return current, annotation


def _without_tags(model: type[BaseModel], path: list[str]) -> list[str]:
    """The keys of a path as a file has them: pydantic puts in which of several alternatives it took."""
    current: type[BaseModel] | None = model
    annotation: Any = None
    said = []
    for part in path:
        field = None if current is None else current.model_fields.get(part)
        if field is None and part in (alternatives := _alternatives(annotation)):
            current = alternatives[part]
            continue
        said.append(part)
        if field is not None:
            annotation = field.annotation
            current = _model_in(annotation)
    return said


def _taken_by_others(model: type[BaseModel], path: list[str]) -> set[str]:
    """Keys of the alternatives to the one that ``path`` ends with; none where there is no choice."""
    _, annotation = _led_to(model, path[:-1])
    others = [other for tag, other in _alternatives(annotation).items() if tag != path[-1]]
    return {name for other in others if other is not None for name in other.model_fields}


def _alternatives(annotation: Any) -> dict[str, type[BaseModel] | None]:
    """The alternatives of an annotation by their tags; None for those that are no models."""
    found: dict[str, type[BaseModel] | None] = {}
    for note in getattr(annotation, "__metadata__", ()):
        if isinstance(tag := getattr(note, "tag", None), str):
            return {tag: _model_in(annotation)}
        if isinstance(key := getattr(note, "discriminator", None), str):
            for other in get_args(get_args(annotation)[0]):
                found |= dict.fromkeys(get_args(other.model_fields[key].annotation), other)
    for argument in getattr(annotation, "__args__", ()):
        found |= _alternatives(argument)
    return found


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """Return the first model found inside an annotation such as ``Optional[Model]``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        found = _model_in(argument)
        if found is not None:
            return found
    return None


def _show(value: Any) -> str:
    """A short rendering of an offending value."""
    if value is None:
        return "nothing"
    text = repr(value) if isinstance(value, str) else str(value)
    return text if len(text) <= 80 else text[:77] + "..."


def rising(bounds: tuple[float, float]) -> tuple[float, float]:
    """Of a range from which something is drawn: the smaller bound first.

    Raises
    ------
    ValueError
        Where it is not.
    """
    low, high = bounds
    if low > high:
        raise ValueError(f"expected the smaller bound first, found {low:g} and {high:g}")
    return bounds
