"""The modules of a mission by what they cost: the first section of an attribution's page."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pilotage.evaluation.metrics import METRICS
from pilotage.report import quantities
from pilotage.report.markup import PLAIN, ROW, Html, Section, escape, section, table
from pilotage.report.study.scales import Scale, points, scale_of, told

Module = Mapping[str, Any]
"""One entry of ``experiments.studies.attribution.attribution_of``'s ``modules``."""
Named = tuple[str, Mapping[str, Any]]
"""A metric and its change."""


def ranking_table(modules: Sequence[Module]) -> Section:
    """One row a module, most costly first: how each metric changes where an oracle stands in for it."""
    metrics = [name for name in _metrics(modules) if any(_moves(m["changes"].get(name)) for m in modules)]
    if not metrics:
        return section("ranking", "What each module costs")
    scales = {name: _scale(name, modules) for name in metrics}
    rows = []
    for module in modules:
        small = f'<span class="what">{escape(module["oracle"])}</span>' if module["oracle"] else ""
        cells = (_entry(module["changes"].get(name), scales[name]) for name in metrics)
        rows.append([Html(escape(module["module"]) + small), *cells])
    heads = ((METRICS.find(name).name + scales[name].label, PLAIN) for name in metrics)
    return section(
        "ranking",
        "What each module costs",
        "<p>How the mission changes where an oracle replaces one module, on the same seeds; below it the "
        "95 % interval. Bold is what the trials tell from chance. Success counts before accuracy, accuracy "
        "before safety and time; times and paths are compared where both runs succeeded.</p>",
        table([("oracle for", ROW), *heads], rows, "cells", box="wide"),
    )


def ranking_answer(modules: Sequence[Module]) -> str:
    """One sentence: which module costs most, and how surely.

    A module costs what its oracle makes better; one whose oracle only makes things worse costs nothing.
    """
    for module in modules:
        gains, losses = _gains_and_losses(module, _surely)
        if gains:
            return f"What costs most is '{module['module']}': with an oracle for it {_words(gains, losses)}."
    for module in modules:
        gains, losses = _gains_and_losses(module, _likely)
        if gains:
            return (
                "These trials are too few to tell any module's cost from chance; what costs most is likely "
                f"'{module['module']}': with an oracle for it {_words(gains, losses)}."
            )
    for module in modules:
        _, losses = _gains_and_losses(module, _surely)
        if losses:
            return (
                "These trials tell no module's cost from chance; an oracle even makes things worse: with one "
                f"for '{module['module']}' {_words([], losses)}."
            )
    return "These trials tell no module's cost from chance."


def module_words(module: Module) -> list[str]:
    """What an oracle changes surely, or else what it may, one change each; gains first."""
    for know, word in ((_surely, ""), (_likely, "perhaps ")):
        gains, losses = _gains_and_losses(module, know)
        if gains or losses:
            return [
                *(f"{word}{_said(*entry)}" for entry in gains),
                *(f"{word}worse: {_said(*entry)}" for entry in losses),
            ]
    return []


def _surely(change: Mapping[str, Any]) -> bool:
    return bool(change["sure"])


def _likely(change: Mapping[str, Any]) -> bool:
    return bool(change["low"] > 0.0 or change["high"] < 0.0)


def _gains_and_losses(
    module: Module, know: Callable[[Mapping[str, Any]], bool]
) -> tuple[list[Named], list[Named]]:
    """What is known to become better with the oracle, and what worse; nothing better where success falls."""
    known = [(name, change) for name, change in module["changes"].items() if know(change)]
    gains = [entry for entry in known if entry[1]["better"]]
    losses = [entry for entry in known if not entry[1]["better"]]
    if any(name == "success" for name, _ in losses):
        return [], losses
    return gains, losses


def _words(gains: Sequence[Named], losses: Sequence[Named]) -> str:
    better, worse = (
        "; ".join(_said(*entry, verb=" changes by") for entry in entries[:3]) for entries in (gains, losses)
    )
    return f"{better}; for the worse, {worse}" if better and worse else better or worse


def _said(name: str, change: Mapping[str, Any], verb: str = "") -> str:
    mean, low, high = (float(change[key]) for key in ("mean", "low", "high"))
    if low == high:
        text = f"{told(name, mean, math.nan, math.nan, signed=True)} in every trial"
    else:
        text = told(name, mean, low, high, signed=True)
    return f"{METRICS.find(name).name}{verb} {points(text)}"


def _metrics(modules: Sequence[Module]) -> list[str]:
    return list(dict.fromkeys(name for module in modules for name in module["changes"]))


def _moves(change: Mapping[str, Any] | None) -> bool:
    return change is not None and math.isfinite(change["mean"]) and change["mean"] != 0.0


def _scale(name: str, modules: Sequence[Module]) -> Scale:
    found = (module["changes"].get(name) for module in modules)
    return scale_of(name, [change["mean"] for change in found if change is not None and _moves(change)])


def _entry(change: Mapping[str, Any] | None, scale: Scale) -> str:
    if change is None or not math.isfinite(change["mean"]):
        return quantities.NOTHING
    if change["mean"] == change["low"] == change["high"] == 0.0:
        return "0"
    digits = scale.decimals(change["mean"], change["low"], change["high"])
    mean = scale.write(change["mean"], digits, signed=True)
    if change["low"] == change["high"]:
        band = "in every trial"
    else:
        low, high = (scale.write(change[end], digits, signed=True) for end in ("low", "high"))
        band = f"{low} to {high}"
    shown = f"<b>{mean}</b>" if change["sure"] else mean
    return Html(f'{shown}<br><span class="range">{band}</span>')
