"""The robot's colour: a range in HSV, given or learned from what moves on the sheet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.core.whole_number import whole_number
from pilotage.tracking.background import Background
from pilotage.tracking.film import Image
from pilotage.tracking.opencv import opencv

_HUES = 180
_COLOURFUL = 70
"""Least saturation (0 to 255) of a pixel whose hue means something."""
_BRIGHT = 35
_LEAST_COLOURED_SHARE = 0.12
"""Of the moving thing's pixels; a robot with less colour than this is told by its difference alone."""


@dataclass(frozen=True, slots=True)
class HsvRange:
    """Bounds in OpenCV's units: hue 0 to 179, saturation and value 0 to 255; the hue may wrap past 179."""

    low: tuple[int, int, int]
    high: tuple[int, int, int]

    def within(self, cut: Image) -> Image:
        """Where a picture (BGR) has this colour: 255 or 0."""
        cv2 = opencv()
        hsv = cv2.cvtColor(cut, cv2.COLOR_BGR2HSV)
        if self.low[0] <= self.high[0]:
            inside: Image = cv2.inRange(hsv, self.low, self.high)
            return inside
        above = cv2.inRange(hsv, self.low, (_HUES - 1, *self.high[1:]))
        below = cv2.inRange(hsv, (0, *self.low[1:]), self.high)
        both: Image = cv2.bitwise_or(above, below)
        return both


def parse_hsv(text: str) -> HsvRange:
    """Read ``H0,S0,V0,H1,S1,V1``.

    Raises
    ------
    InputError
        If these are not six whole numbers in range; H0 may be above H1 (red wraps), S0 and V0 may not.
    """
    parts = text.split(",")
    values = [number for number in (whole_number(part.strip()) for part in parts) if number is not None]
    if len(parts) != 6 or len(values) != 6:
        raise InputError(f"--hsv: expected H0,S0,V0,H1,S1,V1 as six whole numbers, found '{text}'")
    h0, s0, v0, h1, s1, v1 = values
    if max(h0, h1) >= _HUES or max(values) > 255 or s0 > s1 or v0 > v1:
        raise InputError(f"--hsv: expected hues 0..179, others 0..255 with low <= high, found '{text}'")
    return HsvRange((h0, s0, v0), (h1, s1, v1))


def learn_colour(samples: Sequence[Image], background: Background) -> HsvRange | None:
    """Learn the commonest hue of what moves on the sheet.

    Returns
    -------
    HsvRange | None
        None where what moves has no colour of its own (grey, black, white).

    Raises
    ------
    InputError
        If nothing moves on the sheet.
    """
    moving = [pixels for pixels in _moving_pixels(samples, background) if len(pixels)]
    if not moving:
        raise InputError("nothing moves on the map in this video; give the robot's colour by --hsv")
    pixels = np.concatenate(moving)
    coloured = pixels[(pixels[:, 1] >= _COLOURFUL) & (pixels[:, 2] >= _BRIGHT)]
    if len(coloured) < _LEAST_COLOURED_SHARE * len(pixels):
        return None
    counts = np.bincount(coloured[:, 0], minlength=_HUES).astype(np.float64)
    wrapped = np.concatenate([counts[-8:], counts, counts[:8]])
    smooth = np.convolve(wrapped, np.ones(17) / 17.0, mode="valid")
    peak = int(np.argmax(smooth))
    from_peak = (coloured[:, 0].astype(int) - peak + _HUES // 2) % _HUES - _HUES // 2
    near = coloured[np.abs(from_peak) <= 18]
    if len(near) < _LEAST_COLOURED_SHARE * len(pixels):
        return None
    reach = int(np.clip(np.percentile(np.abs(from_peak[np.abs(from_peak) <= 18]), 95) + 3, 8, 20))
    # The floor reflects the robot's hue, paler than the robot itself.
    saturation = int(max(0.5 * np.median(near[:, 1]), 50))
    value = int(max(0.75 * np.percentile(near[:, 2], 5), 20))
    return HsvRange(((peak - reach) % _HUES, saturation, value), ((peak + reach) % _HUES, 255, 255))


def _moving_pixels(samples: Sequence[Image], background: Background) -> Iterator[NDArray[np.uint8]]:
    """HSV of the largest moving thing that lies wholly on the sheet, for each sample."""
    cv2 = opencv()
    rim = cv2.morphologyEx(
        background.region.mask.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((5, 5), np.uint8)
    )
    sheet_area = np.count_nonzero(background.region.mask)
    for sample in samples:
        cut = background.in_this_light(sample)
        mask = cv2.morphologyEx(background.foreground(cut), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        count, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
        # A foot or an arm reaches in over the edge; the robot stands on the sheet.
        reaching_in = np.unique(labels[rim > 0])
        areas = stats[:, cv2.CC_STAT_AREA].astype(np.float64)
        areas[0] = 0.0
        areas[reaching_in] = 0.0
        areas[(areas < 2e-4 * sheet_area) | (areas > 0.15 * sheet_area)] = 0.0
        if count > 1 and areas.max() > 0.0:
            hsv = cv2.cvtColor(cut, cv2.COLOR_BGR2HSV)
            yield hsv[labels == int(areas.argmax())]
