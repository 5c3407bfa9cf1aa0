"""What a study varies: a list, a range, a logarithmic or random range, or named levels."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from pydantic import Field, field_validator, model_validator

from pilotage.core.config import Config

MAX_VALUES = 10_000
"""More values than this are a slip in the step."""


class Span(Config):
    """Evenly spaced values from ``start`` to ``stop``, both included where the step meets them."""

    start: float | int
    stop: float | int
    step: float | int

    @model_validator(mode="after")
    def _not_empty(self) -> Span:
        if self.step == 0:
            raise ValueError("expected a step other than 0")
        if (self.stop - self.start) / self.step < 0:
            raise ValueError(f"an empty range: no step of {self.step} leads from {self.start} to {self.stop}")
        if (self.stop - self.start) / self.step >= MAX_VALUES:
            raise ValueError(f"expected a range of at most {MAX_VALUES} values")
        return self

    def values(self) -> tuple[float | int, ...]:
        """The values in decimal arithmetic: 0.1 to 1.0 by 0.1 holds 0.3, not 0.30000000000000004."""
        start, stop, step = (Decimal(str(x)) for x in (self.start, self.stop, self.step))
        whole = all(isinstance(x, int) for x in (self.start, self.step))
        found = [start + i * step for i in range(int((stop - start) / step) + 1)]
        return tuple(int(x) if whole else float(x) for x in found)


class LogRange(Config):
    """``count`` values in a geometric series from ``start`` to ``stop``."""

    start: float = Field(gt=0.0)
    stop: float = Field(gt=0.0)
    count: int = Field(ge=1, le=MAX_VALUES)

    @model_validator(mode="after")
    def _not_empty(self) -> LogRange:
        if (self.start == self.stop) != (self.count == 1):
            raise ValueError(f"an empty range: {self.count} values from {self.start:g} to {self.stop:g}")
        return self

    def values(self) -> tuple[float, ...]:
        """The values, rounded to 12 digits; the ends exactly."""
        if self.count == 1:
            return (self.start,)
        inner = np.geomspace(self.start, self.stop, self.count)[1:-1]
        return (self.start, *(float(f"{x:.12g}") for x in inner), self.stop)


class RandomRange(Config):
    """``count`` values drawn between ``low`` and ``high``, evenly or evenly in the logarithm."""

    low: float
    high: float
    count: int = Field(ge=1, le=MAX_VALUES)
    seed: int = Field(default=0, ge=0)
    log: bool = False

    @model_validator(mode="after")
    def _not_empty(self) -> RandomRange:
        if not self.low < self.high:
            raise ValueError(f"an empty range: nothing lies between {self.low:g} and {self.high:g}")
        if self.log and self.low <= 0.0:
            raise ValueError("expected low above 0 for a logarithmic range")
        return self

    def values(self) -> tuple[float, ...]:
        """The values; the same seed draws the same."""
        rng = np.random.default_rng(self.seed)
        if self.log:
            drawn = np.exp(rng.uniform(math.log(self.low), math.log(self.high), self.count))
        else:
            drawn = rng.uniform(self.low, self.high, self.count)
        return tuple(float(x) for x in drawn)


SOURCES = ("values", "range", "log_range", "random_range", "levels")


class Factor(Config):
    """One thing that is varied.

    Attributes
    ----------
    key
        The mission's key, or several that take the same value together.
    name
        What it is called in tables; by default the last part of the key (of ``stack.localizer.name`` the
        role), as many parts as tell it from the study's other factors.
    values, range, log_range, random_range, levels
        One of them. ``levels`` are named sets of overrides, for what one key cannot say.
    multiply
        The values multiply what the mission holds: 0.1, 1, 10 times each variance.
    """

    key: str | tuple[str, ...] = ()
    name: str = ""
    values: tuple[Any, ...] | None = None
    range: Span | None = None
    log_range: LogRange | None = None
    random_range: RandomRange | None = None
    levels: dict[str, dict[str, Any]] | None = None
    multiply: bool = False

    @field_validator("levels", mode="before")
    @classmethod
    def _named(cls, levels: Any) -> Any:
        for name in levels if isinstance(levels, Mapping) else ():
            if not isinstance(name, str):
                raise ValueError(f"expected names in quotes, for YAML reads 1 as no text, found {name}")
        return levels

    @model_validator(mode="after")
    def _whole(self) -> Factor:
        given = [source for source in SOURCES if getattr(self, source) is not None]
        if len(given) != 1:
            raise ValueError(f"expected one of {', '.join(SOURCES)}, found {' and '.join(given) or 'none'}")
        if self.levels is None and not self.keys:
            raise ValueError("expected the key that is varied")
        if self.levels is not None and (self.keys or self.multiply or not self.name):
            raise ValueError("levels set keys of their own: expected a name beside them, no key, no multiply")
        twice_key = first_twice(self.keys)
        if twice_key is not None:
            raise ValueError(f"the key '{twice_key}' stands twice")
        found = self.settings()
        if not found:
            raise ValueError("an empty list of values")
        check_plain(self.levels if self.levels is not None else list(found), "values")
        if len(found) > MAX_VALUES:
            raise ValueError(f"expected at most {MAX_VALUES} values, found {len(found)}")
        twice = first_twice([repr(value) for value in found])
        if twice is not None:
            raise ValueError(f"the value {twice} stands twice")
        if self.multiply and not all(_is_number(value) for value in found):
            raise ValueError("expected numbers to multiply by")
        return self

    @property
    def keys(self) -> tuple[str, ...]:
        """The mission's keys that take the value."""
        return (self.key,) if isinstance(self.key, str) else self.key

    @property
    def title(self) -> str:
        """What the factor is called."""
        return self.name or self.tail(1)

    def tail(self, parts: int) -> str:
        """The last parts of the key; a component that is named goes by its role: ``localizer``."""
        return "_".join(self.keys[0].removesuffix(".name").split(".")[-parts:])

    @property
    def names(self) -> dict[str, str]:
        """Of the files among the values, by their absolute paths, the ends of these that tell them apart."""
        paths = [text for text in _texts(self.settings()) if Path(text).is_absolute()]
        common = os.path.commonpath([Path(path).parent for path in paths]) if paths else ""
        return {path: str(Path(path).relative_to(common)) for path in paths}

    def said(self, value: Any) -> str:
        """A value as a cell's name has it, a file by its name there."""
        return show(value, self.names)

    def settings(self) -> tuple[Any, ...]:
        """The values, or the levels' names."""
        if self.levels is not None:
            return tuple(self.levels)
        if self.values is not None:
            return self.values
        source = self.range or self.log_range or self.random_range
        assert source is not None
        return source.values()


def told_apart(factors: Sequence[Factor]) -> tuple[Factor, ...]:
    """The same factors, each with as many parts of its key as name as tell it from all others."""
    return tuple(
        factor.model_copy(update={"name": factor.tail(parts)}) if parts > 1 else factor
        for factor in factors
        for parts in [_parts(factor, [one for one in factors if one is not factor])]
    )


def _parts(factor: Factor, others: Sequence[Factor]) -> int:
    """How many parts of its key tell a factor from others; 1 where it has a name, or where none do."""
    most = 0 if factor.name else factor.keys[0].count(".") + 1
    apart = (
        parts
        for parts in range(1, most + 1)
        if all((one.name or one.tail(parts)) != factor.tail(parts) for one in others)
    )
    return next(apart, 1)


def show(value: Any, names: Mapping[str, str] = MappingProxyType({})) -> str:
    """A value in a cell's name, as a mission file has it: ``null``, ``true``, ``{name: slam}``.

    Texts that have a name in ``names`` are called by it.
    """
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {show(inner, names)}" for key, inner in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(show(inner, names) for inner in value) + "]"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return f"{value:.12g}" if isinstance(value, float) else names.get(str(value), str(value))


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, Mapping):
        value = tuple(value.values())
    if isinstance(value, list | tuple):
        for inner in value:
            yield from _texts(inner)
    elif isinstance(value, str):
        yield value


def first_twice(texts: Iterable[str]) -> str | None:
    """The first text that stands there a second time; None where each stands once."""
    seen: set[str] = set()
    for text in texts:
        if text in seen:
            return text
        seen.add(text)
    return None


def check_plain(value: Any, where: str) -> None:
    """Refuse what a mission cannot hold, such as a date or a number that is none.

    Raises
    ------
    ValueError
        With the place of the first such value.
    """
    if isinstance(value, Mapping):
        for key, inner in value.items():
            check_plain(inner, f"{where}.{key}")
    elif isinstance(value, list | tuple):
        for i, inner in enumerate(value):
            check_plain(inner, f"{where}.{i}")
    elif isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{where}: expected a finite number, found {value}")
    elif not isinstance(value, bool | int | float | str | None):
        raise ValueError(f"{where}: expected a number or text, found the {type(value).__name__} {value}")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
