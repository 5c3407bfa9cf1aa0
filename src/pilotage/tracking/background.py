"""The sheet without the robot, learned from frames spread over the film."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pilotage.tracking.channels import greatest_channel
from pilotage.tracking.film import Image
from pilotage.tracking.light import Region, in_light_of, paper_colour
from pilotage.tracking.opencv import opencv

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

_LIKE_PAPER = 0.22
"""Distance from the paper's colour, over its brightness, up to which a pixel may be paper in shade."""


@dataclass(frozen=True, slots=True)
class Background:
    """What the camera sees of the sheet when nothing stands on it.

    Attributes
    ----------
    image
        BGR, shape of the region's cut-out.
    paper
        The paper's colour, shape (3,).
    threshold
        A pixel that differs by more than this in any channel shows something else.
    region
        Where the sheet is in the reduced frames.
    """

    image: Image
    paper: Floats
    threshold: float
    region: Region

    def in_this_light(self, reduced_frame: Image) -> Image:
        """Cut the sheet out of a frame and give it the light that the background was learned in."""
        return in_light_of(self.region.cut(reduced_frame), self.region, self.paper)

    def foreground(self, cut: Image) -> Image:
        """Where a cut-out shows something else: 255 or 0, shape (height, width)."""
        cv2 = opencv()
        difference = cv2.absdiff(cut, self.image)
        blue, green, red = cv2.split(difference)
        largest = cv2.max(cv2.max(blue, green), red)
        _, mask = cv2.threshold(largest, self.threshold, 255, cv2.THRESH_BINARY)
        result: Image = cv2.bitwise_and(mask, self.region.mask.view(np.uint8) * 255)
        return result

    def cleared_of(self, where: Image) -> Background:
        """Return the background with paper around what ``where`` shows: a robot that never moved."""
        cv2 = opencv()
        whole = cv2.morphologyEx(where, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        outlines, _ = cv2.findContours(whole, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
        around = np.zeros_like(where)
        for outline in outlines:
            # Boards that hide a part of the colour belong to the robot too: half as wide again takes them in.
            (x, y), radius = cv2.minEnclosingCircle(outline)
            cv2.circle(around, (round(x), round(y)), round(1.5 * radius) + 2, 255, -1)
        image = np.where(around[..., None] > 0, np.rint(self.paper).astype(np.uint8), self.image)
        return Background(image.astype(np.uint8), self.paper, self.threshold, self.region)


def learn_background(samples: Sequence[Image], region: Region) -> Background:
    """Learn the background.

    A pixel's median over the film is wrong where the robot stood most of the time. A sheet is mostly paper:
    where a pixel looked like paper at least twice (or a tenth of the time), that is what it is, and the
    median is taken over those times alone.
    """
    paper = paper_colour(region.cut(samples[len(samples) // 2]), region)
    stack = np.array([in_light_of(region.cut(sample), region, paper) for sample in samples])
    reach = _LIKE_PAPER * max(float(paper.mean()), 1.0)
    away = greatest_channel(np.abs(stack.astype(np.int16) - paper.astype(np.int16)))
    like_paper = away < reach
    often = like_paper.sum(axis=0) >= max(2, round(0.1 * len(samples)))
    image = np.median(stack, axis=0).astype(np.uint8)
    mixed = often & ~like_paper.all(axis=0)
    pixels = np.where(like_paper[:, mixed, None], stack[:, mixed].astype(np.float32), np.nan)
    image[mixed] = np.nanmedian(pixels, axis=0).astype(np.uint8)
    still = greatest_channel(np.abs(stack[:, ::4, ::4].astype(np.int16) - image[::4, ::4]))
    noise = 1.4826 * float(np.median(still[:, region.mask[::4, ::4]]))
    return Background(image, paper, float(np.clip(8.0 * noise, 24.0, 60.0)), region)
