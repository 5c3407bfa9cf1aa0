"""What a study is, as its YAML file says it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, field_validator, model_validator

from pilotage.core.config import Config
from pilotage.experiments.studies.factors import Factor, check_plain, first_twice, show, told_apart

NAME = re.compile(r"[^\W_][\w.-]*")
LONGEST_NAME = 200
"""Names of studies, of letters of any language: of a folder, and in ``pilotage run --from NAME:ROW``."""
CONFIGURATION = "configuration"
"""What the named configurations are called among the factors."""
MANY = 1000
"""So many factors, configurations or metrics are no study but a slip."""


class Configuration(Config):
    """A named set of overrides, such as one row of an ablation table; none is the mission as it is.

    ``values`` says what its settings amount to, by factor: figures over those factors are then drawn of
    named configurations too. They change nothing in the trials.
    """

    name: str = Field(min_length=1)
    set: Mapping[str, Any] = {}
    values: Mapping[str, float | int] = {}


class Seeds(Config):
    """Which seeds the trials take.

    ``shared``: trial i has seed ``first + i`` in every cell, so that cells can be compared pairwise.
    ``independent``: every row has a seed of its own.
    """

    first: int = Field(default=0, ge=0, le=2**62)
    pairing: Literal["shared", "independent"] = "shared"


class Published(Config):
    """What others found for a cell: the cell's name or the factor values that pick it; metric to number."""

    cell: str | Mapping[str, Any]
    metrics: Mapping[str, float]


class Reference(Config):
    """A value that a metric is held against, such as a known optimum."""

    value: float
    name: str = "reference"


class Group(Config):
    """Cells that are judged together: one answer, one figure, one table.

    ``cells`` are names of cells, or how names begin: ``walls*``. ``baseline`` is the one of them that the
    others are held against, or by cell the one that it is held against, of whichever group.
    """

    name: str = Field(min_length=1)
    cells: tuple[str, ...] = Field(min_length=1)
    baseline: str | Mapping[str, str] | None = None


class Contrast(Config):
    """Two metrics of the same trials that are held against each other."""

    metric: str
    against: str


class StudyDefinition(Config):
    """A mission, what is varied, how often it is run, and what is asked.

    Attributes
    ----------
    mission
        A shipped mission's name or a file, relative to the study's file.
    set
        Overrides that hold in every cell.
    combine
        ``grid``: every value with every other; ``one-at-a-time``: each factor alone, the others as the
        mission has them; ``zip``: the first values of all factors, then the second, and so on. Named
        configurations are crossed with all of these.
    metrics
        The metrics to report; none given: every number that the trials give.
    primary, lower_is_better, baseline
        The metric that answers the question, which way it is better (by default as its name says), and the
        cell that the others are held against.
    groups
        Cells that are judged apart from the others, each group with a baseline of its own.
    contrasts
        Pairs of metrics that are held against each other within every trial.
    published
        Shown beside ours.
    reference
        By metric, a bound or an optimum.
    """

    study: str = Field(min_length=1, max_length=LONGEST_NAME)
    question: str = ""
    description: str = ""
    mission: str = Field(min_length=1)
    set: Mapping[str, Any] = {}
    configurations: tuple[Configuration, ...] = ()
    factors: tuple[Factor, ...] = ()
    combine: Literal["grid", "one-at-a-time", "zip"] = "grid"
    trials: int = Field(default=10, ge=1, le=10_000_000)
    seeds: Seeds = Seeds()
    metrics: tuple[str, ...] = ()
    primary: str | None = None
    lower_is_better: bool | None = None
    baseline: str | None = None
    groups: tuple[Group, ...] = ()
    contrasts: tuple[Contrast, ...] = ()
    published: tuple[Published, ...] = ()
    reference: Mapping[str, Reference] = {}

    @field_validator("study")
    @classmethod
    def _names_a_folder(cls, name: str) -> str:
        if not NAME.fullmatch(name):
            raise ValueError("expected letters, digits, '-', '_' and '.', as it names a folder")
        if len(name.encode()) > LONGEST_NAME:
            raise ValueError(f"expected at most {LONGEST_NAME} bytes, as it names a folder")
        return name

    @model_validator(mode="before")
    @classmethod
    def _not_too_many(cls, values: Any) -> Any:
        for key, value in values.items() if isinstance(values, Mapping) else ():
            if isinstance(value, list | tuple) and len(value) > MANY:
                raise ValueError(f"{key}: expected at most {MANY}, found {len(value)}")
        return values

    @field_validator("factors")
    @classmethod
    def _told_apart(cls, factors: tuple[Factor, ...]) -> tuple[Factor, ...]:
        return told_apart(factors)

    @model_validator(mode="after")
    def _sound(self) -> StudyDefinition:
        for where, values in (("set", self.set), *((c.name, c.set) for c in self.configurations)):
            check_plain(values, where)
        titles = [factor.title for factor in self.factors]
        _once(titles, "factors", "give one of them a name")
        _once([c.name for c in self.configurations], "configurations", "names tell them apart")
        _once(list(self.metrics), "metrics", "once is enough")
        _once([group.name for group in self.groups], "groups", "names tell them apart")
        for name in (name for entry in self.contrasts for name in (entry.metric, entry.against)):
            if self.metrics and name not in self.metrics:
                raise ValueError(f"contrasts: expected metrics of the study, found '{name}'")
        if self.groups and self.baseline is not None:
            raise ValueError("baseline: expected one in each of the groups, found one beside them")
        clash = next((name for name in self.value_names if name in {CONFIGURATION, *titles}), None)
        if clash is not None:
            raise ValueError(f"configurations: '{clash}' among their values is a factor's name already")
        if self.configurations and CONFIGURATION in titles:
            raise ValueError(f"a factor cannot be called '{CONFIGURATION}' beside configurations")
        if self.combine != "one-at-a-time":
            keys = [key for f in self.factors for key in f.keys]
            _once(keys, "factors: the key", "one of them would have no effect")
        if self.combine == "zip" and len({len(factor.settings()) for factor in self.factors}) > 1:
            lengths = ", ".join(f"{f.title} {len(f.settings())}" for f in self.factors)
            raise ValueError(f"combine zip: expected factors of one length, found {lengths}")
        for key in self.varied_keys():
            if key == "run.seed":
                raise ValueError("run.seed: the trials take their seeds by themselves; see 'seeds'")
        return self

    def varied_keys(self) -> list[str]:
        """Every key of the mission that some cell changes."""
        keys = [*self.set]
        for configuration in self.configurations:
            keys += configuration.set
        for factor in self.factors:
            keys += factor.keys
            for level in (factor.levels or {}).values():
                keys += level
        return keys

    def said(self, factor: str, value: Any) -> str:
        """A value of a factor as names of cells have it."""
        known = next((entry for entry in self.factors if entry.title == factor), None)
        return show(value) if known is None else known.said(value)

    @property
    def factor_names(self) -> tuple[str, ...]:
        """Names of what is varied, the configurations first."""
        named = (CONFIGURATION,) if self.configurations else ()
        return (*named, *self.value_names, *(f.title for f in self.factors))

    @property
    def value_names(self) -> tuple[str, ...]:
        """Names of what the configurations say that their settings amount to."""
        return tuple(dict.fromkeys(name for c in self.configurations for name in c.values))


def _once(names: list[str], what: str, remedy: str) -> None:
    twice = first_twice(names)
    if twice is not None:
        raise ValueError(f"{what}: '{twice}' stands twice; {remedy}")
