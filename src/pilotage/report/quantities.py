"""Numbers as one says them: millimetres where metres would be all zeros, minutes where seconds run on."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

NOTHING = "–"
HOURS_FROM_S = 7200.0


def significant(value: float, digits: int = 3) -> str:
    """Write a number with so many significant digits, never in powers of ten, with thousands apart."""
    if not math.isfinite(value):
        return NOTHING
    if value == 0.0:
        return "0"
    # The exponent of the rounded number: 0.9996 is 1.00, not 1.000.
    exponent = int(f"{value:.{digits - 1}e}".partition("e")[2])
    decimals = max(0, digits - 1 - exponent)
    return f"{value:,.{decimals}f}".replace(",", "\u00a0").replace("-", "−")


def scientific(value: float, digits: int = 4) -> str:
    """Write a number plainly where it is near 1, else with a power of ten."""
    if not math.isfinite(value):
        return NOTHING
    if value == 0.0 or 1e-3 <= abs(value) < 1e4:
        return f"{value:.{digits}g}".replace("-", "−")
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    power = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{mantissa} × 10{power}".replace("-", "−")


def length(value_m: float) -> str:
    """Write a length in mm below 0.1 m, in m from there, in km from 10 km on."""
    if not math.isfinite(value_m):
        return NOTHING
    if 0.0 < abs(value_m) < 1e-6:
        return "<0.001\u00a0mm" if value_m > 0.0 else "0\u00a0mm"
    if abs(value_m) < 0.1:
        return f"{significant(1000.0 * value_m)}\u00a0mm"
    if abs(value_m) >= 10_000.0:
        return f"{significant(value_m / 1000.0, 4)}\u00a0km"
    return f"{value_m:.2f}\u00a0m".replace("-", "−")


def angle(value_rad: float) -> str:
    """Write an angle in degrees."""
    return f"{significant(math.degrees(value_rad))}°" if math.isfinite(value_rad) else NOTHING


def duration(value_s: float) -> str:
    """Write a duration in ms, s, minutes and seconds (from 2 min), hours (from 2 h), days (from 2 days)."""
    if not math.isfinite(value_s):
        return NOTHING
    if value_s < 0.0:
        return f"−{duration(-value_s)}"
    if 0.0 < abs(value_s) < 0.1:
        return f"{significant(1000.0 * value_s)}\u00a0ms"
    if abs(value_s) < 120.0:
        return f"{value_s:.2f}\u00a0s" if abs(value_s) < 10.0 else f"{value_s:.1f}\u00a0s"
    if abs(value_s) >= 2.0 * 86_400.0:
        return f"{significant(value_s / 86_400.0, 4)}\u00a0days"
    if abs(value_s) >= HOURS_FROM_S:
        hours, minutes = divmod(round(value_s / 60.0), 60)
        return f"{hours}\u00a0h {minutes:02d}\u00a0min"
    minutes, seconds = divmod(round(value_s), 60)
    return f"{minutes}\u00a0min {seconds:02d}\u00a0s"


def moment(t_s: float) -> str:
    """Write a time since the start: to a tenth of a second, in hours and days where there are hours."""
    return f"{t_s:.1f}\u00a0s" if abs(t_s) < HOURS_FROM_S else duration(t_s)


def share(value: float) -> str:
    """Write a share of one in percent."""
    # Added to 0.0, what is rounded to -0.0 loses its sign.
    return (
        f"{round(100.0 * value, 1) + 0.0:.1f}\u00a0%".replace("-", "−") if math.isfinite(value) else NOTHING
    )


def count(value: float) -> str:
    """Write a whole number."""
    return f"{round(value):,}".replace(",", "\u00a0") if math.isfinite(value) else NOTHING


def counted(number: int, noun: str) -> str:
    """So many of something: ``1 course``, ``2 courses``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _degrees(value: float) -> str:
    return f"{significant(value)}°" if math.isfinite(value) else NOTHING


def _rate(value: float) -> str:
    return f"{count(value)} / s" if math.isfinite(value) else NOTHING


BY_UNIT: Mapping[str, Callable[[float], str]] = {
    "m": length,
    "s": duration,
    "rad": angle,
    "°": _degrees,
    "share": share,
    "count": count,
    "1/s": _rate,
    "ratio": lambda value: f"{value:.3f}",
    "×": lambda value: f"{value:.0f} ×",
}
"""How a metric of some unit is written; all others as plain numbers."""


def measured(value: float, unit: str) -> str:
    """Write a value of a unit as one says it."""
    write = BY_UNIT.get(unit)
    if write is not None:
        return write(value)
    text = scientific(value, 3) if 0.0 < abs(value) < 1e-4 else significant(value)
    return f"{text} {unit}" if unit and math.isfinite(value) else text
