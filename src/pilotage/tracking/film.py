"""A film, one frame at a time: memory does not grow with its length."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pilotage.core.errors import InputError
from pilotage.core.files import opened
from pilotage.core.hushed import hushed
from pilotage.tracking.opencv import opencv

Image = NDArray[np.uint8]
Advance = Callable[[int, int], None]
"""Called with the frames done and the frames promised (0 where unknown)."""

WORKING_SIDE_PX = 960
"""Frames are reduced until their longer side is at most this: half the pixels of a robot place it as well."""

_MOST_SAMPLES = 32
_TOLERATED_MISSING = 0.01
_LISTS = (b"#EXTM3U", b"ffconcat")
"""FFmpeg would open whatever stands in them, a pipe too, and wait for what a live one is still to get."""


@dataclass(frozen=True, slots=True)
class FilmSummary:
    """What one pass over a film found.

    Attributes
    ----------
    frames
        Frames that could be decoded.
    promised
        Frames that the file's header speaks of; 0 where it does not say.
    fps
        Frames a second; 30 where the file does not say.
    width_px, height_px
        Size of the frames.
    reduction
        Frames are reduced by this whole number for learning and tracking.
    samples
        Frames spread over the film, reduced; between 16 and 32 of them where it is long enough.
    """

    frames: int
    promised: int
    fps: float
    width_px: int
    height_px: int
    reduction: int
    samples: tuple[Image, ...]

    @property
    def broke_at_frame(self) -> int | None:
        """First frame that is missing where the film breaks off before its promised end, or None."""
        # Headers are a frame or two off now and then; that is no break.
        missing = self.promised - self.frames
        return self.frames if missing > max(2.0, _TOLERATED_MISSING * self.promised) else None


def survey(path: Path, advance: Advance | None = None) -> FilmSummary:
    """Go once through a film and keep some frames.

    Raises
    ------
    InputError
        If it cannot be read or holds no frame that decodes.
    """
    with _opened(path) as capture:
        cv2 = opencv()
        promised = _whole(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        fps = float(capture.get(cv2.CAP_PROP_FPS))
        kept: list[Image] = []
        every, count, shape = 1, 0, (0, 0)
        reduction = 1
        while capture.grab():
            if count % every == 0:
                good, image = capture.retrieve()
                if not good:
                    break
                shape = image.shape[:2]
                reduction = min(max(1, math.ceil(max(shape) / WORKING_SIDE_PX)), *shape)
                kept.append(reduced(image, reduction))
                if len(kept) > _MOST_SAMPLES:
                    kept, every = kept[::2], every * 2
            count += 1
            if advance is not None:
                advance(count, promised)
    if not kept:
        raise InputError(f"{path}: no frame of this video could be decoded")
    fps = fps if math.isfinite(fps) and 0.0 < fps < 1000.0 else 30.0
    return FilmSummary(count, promised, fps, shape[1], shape[0], reduction, tuple(kept))


def frames(path: Path) -> Iterator[Image]:
    """Yield the frames of a film, BGR, shape (height, width, 3)."""
    with _opened(path) as capture:
        while True:
            good, image = capture.read()
            if not good:
                return
            yield image


def reduced(image: Image, by: int) -> Image:
    """Return an image made smaller by a whole number, each pixel the mean of those it stands for."""
    if by == 1:
        return image
    height, width = image.shape[0] // by, image.shape[1] // by
    cv2 = opencv()
    whole = image[: height * by, : width * by]
    result: Image = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)
    return result


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    cv2 = opencv()
    with opened(path, "a video file") as file:
        if file.read(8).startswith(_LISTS):
            raise InputError(f"{path}: expected a video, found a list of other files; give one of them")
    with hushed():
        capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    try:
        if not capture.isOpened():
            raise InputError(f"{path}: this is not a video that can be decoded")
        yield capture
    finally:
        capture.release()


def _whole(value: float) -> int:
    return int(value) if math.isfinite(value) and 0.0 < value < 1e9 else 0
