"""A drive as its sensors logged it: odometer steps and sightings of landmarks."""

from __future__ import annotations

from dataclasses import dataclass

from pilotage.core.types import FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class LandmarkLog:
    """What a rover's odometer and landmark sensor said.

    Attributes
    ----------
    steps
        (T, 3) distance, direction of travel less heading at the step's begin, and turn of each step.
    variances
        (T, 2) of distance and turn, by the sensor's data sheet: noise grows with the step.
    first
        (T + 1,) sightings of step t are ``first[t]`` to ``first[t + 1]``; they are taken at its end.
    ids, ranges_m, bearings_rad
        (S,) in the order of the steps.
    """

    steps: FloatArray
    variances: FloatArray
    first: IntArray
    ids: IntArray
    ranges_m: FloatArray
    bearings_rad: FloatArray
