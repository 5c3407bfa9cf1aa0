"""What is said of a recording, and which kind it is: cheap, so that a wrong name is refused at once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pilotage.core.errors import InputError
from pilotage.core.types import Pose2
from pilotage.logs.bag_messages import is_bag

FORMATS = ("bag", "mrclam", "aer1513", "stops")


@dataclass(frozen=True, slots=True)
class Setting:
    """What a bag does not say of itself, by the options of ``pilotage localize``.

    Attributes
    ----------
    map
        A shipped map's name or a map file; None where landmarks are all that is known.
    landmarks
        A CSV table id, x_m, y_m; None: those of the map.
    start
        Where the robot was, or that this is unknown; None: where the truth says, if it does.
    topics, truth, from_s, to_s
        As ``bag_drive`` has them.
    """

    map: str | None = None
    landmarks: Path | None = None
    start: Pose2 | Literal["unknown"] | None = None
    topics: tuple[str, ...] = ()
    truth: str | None = None
    from_s: float = 0.0
    to_s: float = math.inf


UNSET = Setting()


def told_format(log: Path) -> str:
    """What a recording is, by what it holds.

    Raises
    ------
    InputError
        Where nothing is there.
    """
    if not log.exists():
        raise InputError(f"{log}: expected a recording, found nothing there")
    if log.is_dir():
        return "mrclam" if (log / "Barcodes.dat").exists() else "bag"
    if is_bag(log):
        return "bag"
    return {".mat": "aer1513", ".csv": "stops"}.get(log.suffix.lower(), "bag")
