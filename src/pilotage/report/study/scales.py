"""One unit for a whole column or axis, and as many digits as its intervals are worth."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from statistics import median

from pilotage.evaluation.metrics import METRICS
from pilotage.report import quantities

MAX_DECIMALS = 6
ROUNDING = 1e-9
"""Standard deviations below this share of the mean are rounding."""
LEAST_PLAIN = 1e-4
"""Variances below this are written in powers of ten."""
SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
LEAST_P = 0.001
"""Smaller p-values are not told apart."""


@dataclass(frozen=True, slots=True)
class Scale:
    """What a value is multiplied by to be written, and the unit that it then has; empty for plain numbers."""

    times: float = 1.0
    unit: str = ""

    @property
    def label(self) -> str:
        """The unit in brackets, with the space before it."""
        return f" [{self.unit}]" if self.unit else ""

    @property
    def square(self) -> str:
        """The unit of a variance, likewise."""
        return f" [({self.unit})²]" if self.unit == "%" else f" [{self.unit}²]" if self.unit else ""

    def decimals(self, value: float, low: float, high: float) -> int:
        """Decimals that leave two digits of an interval's half; four digits of the value without one.

        What rounding leaves between the ends of an interval is none.
        """
        half = 0.5 * (high - low) * self.times
        if math.isfinite(half) and half > ROUNDING * abs(value * self.times):
            return min(max(1 - math.floor(math.log10(half)), 0), MAX_DECIMALS)
        size = abs(value * self.times)
        if not math.isfinite(size) or size == 0.0:
            return 0
        return min(max(3 - math.floor(math.log10(size)), 0), MAX_DECIMALS)

    def write(self, value: float, decimals: int, *, signed: bool = False) -> str:
        """Write a value with so many decimals, never in powers of ten, with thousands apart."""
        if not math.isfinite(value):
            return quantities.NOTHING
        rounded = round(value * self.times, decimals) + 0.0  # no sign on a zero
        text = f"{rounded:{'+' if signed else ''},.{decimals}f}"
        return text.replace(",", "\u00a0").replace("-", "−")

    def write_variance(self, variance: float, mean: float = 0.0) -> str:
        """Write a variance in the square of the unit; what rounding leaves of equal values is none.

        A small one is written in powers of ten, the only number here that is.
        """
        value = variance * self.times**2
        if not math.isfinite(value):
            return quantities.NOTHING
        if variance <= (ROUNDING * abs(mean)) ** 2:
            return "0"
        if value >= LEAST_PLAIN:
            return quantities.significant(value)
        digits, power = f"{value:.2e}".split("e")
        return f"{digits} · 10{power.lstrip('-0').translate(SUPERSCRIPTS).join(('⁻', ''))}"


def scale_of(metric: str, values: Iterable[float]) -> Scale:
    """The unit in which these values of a metric are told: that of the middle one."""
    size = median([abs(value) for value in values if math.isfinite(value)] or [0.0])
    unit = METRICS.find(metric).unit
    if unit == "share":
        return Scale(100.0, "%")
    if unit == "rad":
        return Scale(math.degrees(1.0), "°")
    if unit == "m":
        if 0.0 < size < 0.1:
            return Scale(1000.0, "mm")
        return Scale(0.001, "km") if size >= 10_000.0 else Scale(1.0, "m")
    if unit == "s":
        if 0.0 < size < 0.1:
            return Scale(1000.0, "ms")
        return Scale(1.0 / 3600.0, "h") if size >= 3.0 * 3600.0 else Scale(1.0, "s")
    return Scale(1.0, _UNWRITTEN.get(unit, unit))


def told(metric: str, value: float, low: float, high: float, *, signed: bool = False) -> str:
    """A value with its interval in one unit: ``24.52 m (24.51 to 24.54)``."""
    if not math.isfinite(value):
        return quantities.NOTHING
    scale = scale_of(metric, (value, low, high))
    digits = scale.decimals(value, low, high)
    unit = {"": "", "°": "°"}.get(scale.unit, f"\u00a0{scale.unit}")
    text = f"{scale.write(value, digits, signed=signed)}{unit}"
    if not math.isfinite(low):
        return text
    return f"{text} ({scale.write(low, digits, signed=signed)} to {scale.write(high, digits, signed=signed)})"


def points(text: str) -> str:
    """A difference of shares, as it is said."""
    return text.replace("\u00a0%", "\u00a0percentage points")


def p_value(value: float, letter: str = "") -> str:
    """A p-value as one says it; with its letter before it, as ``p = 0.012``."""
    if not math.isfinite(value):
        return quantities.NOTHING
    if value < LEAST_P:
        return f"{letter}< {LEAST_P:g}"
    return f"{letter}{'= ' if letter else ''}{value:.3f}"


_UNWRITTEN = {"count": "", "ratio": ""}
"""Units of metrics that are not written."""
