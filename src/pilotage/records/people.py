"""``people.npz``: where people walked."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pilotage.core.config import FARTHEST_M
from pilotage.core.types import FloatArray
from pilotage.records.arrays import Arrays, read_record, write_arrays

PEOPLE_FILE = "people.npz"


@dataclass(frozen=True, slots=True)
class PeopleTracks:
    """People over time.

    Attributes
    ----------
    t_s, places_m
        (N,) rising times and (N, P, 2) places then, NaN for who was not there.
    radius_m
        (P,) their radii.
    """

    t_s: FloatArray = field(default_factory=lambda: np.empty(0))
    places_m: FloatArray = field(default_factory=lambda: np.empty((0, 0, 2)))
    radius_m: FloatArray = field(default_factory=lambda: np.empty(0))

    def at(self, t_s: FloatArray) -> FloatArray:
        """(M, P, 2) places at (M,) times: those at the last time before each that was kept."""
        if not len(self.t_s):
            return np.empty((len(t_s), 0, 2))
        last = np.searchsorted(self.t_s, t_s + 1e-6, side="right") - 1
        return self.places_m[np.maximum(last, 0)]


def write_people(folder: Path, people: PeopleTracks) -> None:
    """Write the tracks; no file where there are none."""
    if len(people.t_s):
        places = people.places_m.astype(np.float32)
        arrays = {"t_s": people.t_s, "places_m": places, "radius_m": people.radius_m}
        write_arrays(folder / PEOPLE_FILE, arrays)


def read_people_tracks(folder: Path) -> PeopleTracks:
    """Read the tracks; none where there is no such file; InputError as ``read_record``."""
    return read_record(folder / PEOPLE_FILE, _tracks, PeopleTracks())


def _tracks(arrays: Arrays) -> PeopleTracks:
    t_s, radius_m = arrays.floats("t_s", -1), arrays.floats("radius_m", -1)
    places_m = arrays.floats("places_m", len(t_s), len(radius_m), 2)
    if not (np.isfinite(t_s).all() and (np.diff(t_s) > 0.0).all()):
        raise ValueError("t_s: expected rising times")
    if not ((radius_m > 0.0) & (radius_m <= FARTHEST_M)).all():
        raise ValueError("radius_m: expected radii above 0 m")
    places_m[~(np.abs(places_m) <= FARTHEST_M)] = np.nan
    return PeopleTracks(t_s, places_m, radius_m)
