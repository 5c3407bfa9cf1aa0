"""What a metric is: its key, its unit, which way it is better, and who gives it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from fnmatch import filter as matching

from pilotage.core.errors import InputError
from pilotage.core.misfit import told
from pilotage.core.types import FloatArray


class Direction(StrEnum):
    """Which way a metric is better."""

    LESS = "less"
    MORE = "more"
    NONE = "none"
    """Best near an ideal value, of either sign, given by the world, or unknown."""


class Aspect(StrEnum):
    """What a metric speaks of."""

    ACCURACY = "accuracy"
    TIME = "time"
    SAFETY = "safety"
    EFFORT = "effort"
    COUNT = "count"


class Clock(StrEnum):
    """Whether the same run gives the same number again."""

    DETERMINISTIC = "deterministic"
    WALL = "wall-clock"


Compute = Callable[[Mapping[str, FloatArray], Mapping[str, object]], float | None]
"""From a run's trace and the metrics that it has so far to a number; None where the run does not give it."""

UNITS = frozenset(
    {
        *("", "share", "count", "ratio", "×", "1/s"),
        *("m", "m²", "m/s", "m/s²", "s", "rad", "rad²", "rad/s", "rad/s²", "°", "Hz"),
    }
)
LONGEST_UNIT = 12
_POWERS = str.maketrans("23", "²³")
_ENDINGS = {
    "m_s2": "m/s²",
    "rad_s2": "rad/s²",
    "rad_s": "rad/s",
    "m_s": "m/s",
    "m2": "m²",
    "rad2": "rad²",
    "hz": "Hz",
    "deg": "°",
    "rad": "rad",
    "m": "m",
    "s": "s",
}


@dataclass(frozen=True, slots=True)
class Metric:
    """One metric.

    Attributes
    ----------
    key
        The JSON key of a run; an entry of a nested object has one level of names (``final_error_x_m``).
    name, meaning
        What it is called, and what it means in plain words.
    unit
        One of ``UNITS``, told in the size that fits, or any other short text;
        ``share`` is a share of one, ``ratio`` a quotient worth three decimals.
    whole_runs
        It compares only among runs that came to their end: one that fails early is not fast.
    tasks
        The tasks whose runs give it; empty: all of them.
    needs
        What else a mission must have for its runs to give it, such as ``planner`` or ``estimate``.
    columns
        Columns of the trace without which no run gives it; ``*`` stands for any letters.
    sometimes
        It tells of what need not happen: trials that all went well may do without it.
    ideal
        What a metric without a direction should be; nan where there is no such value.
    group
        The heading under which a run's tables show it; empty: they do not (a seed, a map's size, a share of
        trials).
    compute
        Gives it, where the run itself does not.
    """

    key: str
    name: str
    unit: str
    meaning: str
    direction: Direction = Direction.NONE
    aspect: Aspect = Aspect.COUNT
    clock: Clock = Clock.DETERMINISTIC
    whole_runs: bool = False
    tasks: frozenset[str] = frozenset()
    needs: frozenset[str] = frozenset()
    columns: frozenset[str] = frozenset()
    sometimes: bool = False
    ideal: float = float("nan")
    group: str = "Further"
    compute: Compute | None = None

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z][a-z0-9_]*", self.key):
            raise InputError(f"metric '{self.key}': expected a key of a-z, 0-9 and _")
        if self.unit not in UNITS:
            self._require_a_short_text()

    def _require_a_short_text(self) -> None:
        """A unit that is none of ours stands behind the number; ours in another spelling does not."""
        unit: object = self.unit
        short = isinstance(unit, str) and len(unit) <= LONGEST_UNIT and unit.isprintable() and " " not in unit
        if not short:
            raise InputError(
                f"metric '{self.key}': expected a unit, at most {LONGEST_UNIT} letters and signs without "
                f"spaces, found {told(unit)}"
            )
        ours = self.unit.replace("^", "").replace("**", "").translate(_POWERS)
        if ours in UNITS:
            raise InputError(f"metric '{self.key}': unknown unit '{self.unit}'; did you mean '{ours}'?")

    @property
    def less_is_better(self) -> bool | None:
        """Whether less of it is better; None where neither is, or nobody knows."""
        return None if self.direction is Direction.NONE else self.direction is Direction.LESS

    def is_told_by(self, columns: Iterable[str]) -> bool:
        """Whether a trace of these columns has all that it needs."""
        return all(matching(columns, pattern) for pattern in self.columns)

    def is_given_by(self, task: str, has: frozenset[str] | None = None) -> bool:
        """Whether runs of a task can give it; ``has`` is what the mission has (None: everything)."""
        return (not self.tasks or task in self.tasks) and (has is None or self.needs <= has)


def unnamed(key: str) -> Metric:
    """A metric that nobody declared: its words and its unit by its key."""
    name, unit = words_and_unit(key)
    clean = re.sub(r"[^a-z0-9_]", "_", key.lower())
    return Metric(clean if clean[:1].isalpha() else f"m_{clean}", name, unit, "")


def words_and_unit(key: str) -> tuple[str, str]:
    """A key as words, and its unit by its ending: ``turning radius``, ``m``.

    The name stays whole: a quotient of two units, as in ``angle_var_rad2_per_rad``, is its unit as a whole.
    """
    words, unit = _ending(key.rsplit(".", 1)[-1])
    if unit and words.endswith("_per"):
        words, over = _ending(words.removesuffix("_per"))
        unit = f"{over or '1'}/{unit}".replace("m/s/s", "m/s²").replace("rad/s/s", "rad/s²")
    return words.replace("_", " "), unit


def _ending(words: str) -> tuple[str, str]:
    """Words without the unit that they end with, and the unit."""
    for ending, unit in _ENDINGS.items():
        if words.endswith(f"_{ending}") and len(words) > len(ending) + 1:
            return words[: -len(ending) - 1], unit
    return words, ""
