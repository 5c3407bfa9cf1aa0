"""Dead reckoning over a rover's stops, each stretch by what the other stretches taught, and judged."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy
import yaml

from pilotage.calibration.stop_legs import LENGTHS_M, TURNS_RAD, ComplexArray, LegModel, Legs
from pilotage.core.chi_square import chi_square_quantile
from pilotage.core.types import BoolArray, Event, FloatArray, IntArray
from pilotage.evaluation.intervals import summarize
from pilotage.experiments.recorder import BELIEF_COLUMNS, TRUTH_COLUMNS
from pilotage.logs.stops_csv import Stops, read_stops
from pilotage.records.run_folder import RunFiles, write_run
from pilotage.records.trace import trace_of
from pilotage.records.world import RobotOutline, World

STRETCHES = 10
"""Each of some fifty stops of Curiosity's, and 1.7 km."""
PROBABILITY = 0.95
HEADING_VAR_RAD2 = 1e-4
"""Of the yaw at a stop, which is measured there: about half a degree; it decides nothing here."""
TEXTBOOK_ANGLE_VAR_RAD2_PER_M = 1.9038589e-6
TEXTBOOK_DISTANCE_VAR_M2_PER_M = 4.0e-5
"""The rover report's odometer: 4 mm and 0.05 degrees on a step of 0.4 m."""


@dataclass(frozen=True, slots=True, eq=False)
class Reckoned:
    """Dead reckoning over all stops, localized anew where a stretch begins.

    Attributes
    ----------
    error_m
        (M, 2) estimate minus localized place at the end of each leg.
    covs
        (M, 2, 2) what it believes of that error.
    stretch
        (M,) of each leg.
    factors, shares
        (K,) by stretch: what the other stretches scale the covariance by, and what they say that slip and
        detours leave of the odometer on legs between whose ends the heading stayed.
    """

    error_m: FloatArray
    covs: FloatArray
    stretch: IntArray
    factors: FloatArray
    shares: FloatArray

    @property
    def nees(self) -> FloatArray:
        """(M,) normalized squared errors of the position; 2 is ideal."""
        return np.asarray(np.einsum("ni,nij,nj->n", self.error_m, np.linalg.inv(self.covs), self.error_m))

    @property
    def inside(self) -> BoolArray:
        """(M,) whether the localized place is in its 95 % ellipse."""
        return np.asarray(self.nees <= chi_square_quantile(PROBABILITY, 2))

    def by_stretch(self, values: FloatArray | BoolArray) -> FloatArray:
        """(K,) means over the stretches: they are independent of each other, neighbouring stops are not."""
        count = np.bincount(self.stretch)
        return np.asarray(np.bincount(self.stretch, np.asarray(values, dtype=np.float64)) / count)


def reckon(legs: Legs, stretches: int = STRETCHES) -> Reckoned:
    """Leave one stretch out, learn from the others, reckon over it.

    The errors of neighbouring legs are alike (the same ground, the same habits of the drivers), so their
    sum grows faster than a model of single legs says. By how much is learned too, again by leaving out:
    each of the other stretches is reckoned by the rest of them, and the mean of its squared errors over
    what was believed scales the covariance. What is learned from K - 1 stretches is uncertain itself,
    which a Student's t with twice as many degrees of freedom has a wider covariance for.
    """
    count = legs.chord_m.shape[0]
    stretch = np.minimum(np.arange(count) * stretches // count, stretches - 1)
    error, covs = np.zeros((count, 2)), np.zeros((count, 2, 2))
    factors, shares = np.ones(stretches), np.ones(stretches)
    freedom = 2 * (stretches - 1)
    wider = freedom / (freedom - 2)
    for out in range(stretches):
        squared = []
        for other in range(stretches):
            if other != out:
                model = LegModel.fitted(legs, np.flatnonzero((stretch != out) & (stretch != other)))
                e, P = _along(legs, model, stretch == other)
                squared.append(float(np.einsum("ni,nij,nj->n", e, np.linalg.inv(P), e).mean()) / 2.0)
        factors[out] = wider * float(np.mean(squared))
        model = LegModel.fitted(legs, np.flatnonzero(stretch != out))
        own = stretch == out
        error[own], covs[own] = _along(legs, model, own)
        covs[own] *= factors[out]
        steady = (stretch != out) & (legs.kind % (len(TURNS_RAD) + 1) == 0)
        driven_m = float(legs.odometer_m[steady].sum())
        if driven_m > 0.0:  # who turned on every leg tells nothing of detours
            shares[out] = float(np.abs(legs.chord_m[steady]).sum()) / driven_m
    return Reckoned(error, covs, stretch, factors, shares)


def textbook(legs: Legs, stretch: IntArray) -> BoolArray:
    """(M,) whether the place is in the ellipse of the report's dead reckoning: the odometer along the yaw."""
    chords = legs.odometer_m * legs.after
    c, s, way = legs.after.real, legs.after.imag, legs.odometer_m
    along, across = TEXTBOOK_DISTANCE_VAR_M2_PER_M * way, TEXTBOOK_ANGLE_VAR_RAD2_PER_M * way**3 / 3.0
    xx, yy, xy = along * c**2 + across * s**2, along * s**2 + across * c**2, (along - across) * c * s
    covs = np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-2)
    inside = np.zeros(way.shape[0], dtype=np.bool_)
    for one in range(int(stretch.max()) + 1):
        own = stretch == one
        e, P = _summed(chords[own] - legs.chord_m[own]), np.cumsum(covs[own], axis=0)
        squared = np.einsum("ni,nij,nj->n", e, np.linalg.inv(P), e)
        inside[own] = squared <= chi_square_quantile(PROBABILITY, 2)
    return inside


def localize_stops(log: Path, out: Path) -> tuple[dict[str, object], Path]:
    """Reckon over a log of stops and write its run folder; its metrics and where they are.

    Raises
    ------
    InputError
        Where the log is not what it should be.
    """
    stops = read_stops(log)
    legs = Legs.between(stops.position_m, stops.heading_rad, stops.odometer_m)
    found = reckon(legs)
    metrics = {"mission": f"localize-{stops.name}-stops", **_metrics(stops, legs, found)}
    settings = {"recording": stops.name, "stack": {"localizer": _settings(found)}}
    text = yaml.safe_dump(settings, sort_keys=False)
    digest = hashlib.sha256(text.encode()).hexdigest()[:8]
    (xmin, ymin), (xmax, ymax) = stops.position_m.min(axis=0) - 50.0, stops.position_m.max(axis=0) + 50.0
    start = (0.0, 0.0, float(stops.heading_rad[0]))
    bounds = (float(xmin), float(ymin), float(xmax), float(ymax))
    world = World(bounds_m=bounds, robots=(RobotOutline(start=start),))
    begins = np.flatnonzero(np.diff(found.stretch, prepend=-1))
    events = tuple(Event(float(stops.t_s[k]), "found", "localized: a stretch begins") for k in begins)
    files = RunFiles(trace_of(_trace(stops, found)), metrics, events, localizer_text=text, world=world)
    folder = write_run(out, f"{metrics['mission']}-{digest}", files)
    return {**metrics, "run_dir": str(folder)}, folder


def _along(legs: Legs, model: LegModel, own: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Errors and covariances along one stretch, which begins at a known place."""
    chords, covs = model.predicted(legs)
    return _summed((chords - legs.chord_m)[own]), np.cumsum(covs[own], axis=0)


def _summed(steps_m: ComplexArray) -> FloatArray:
    total = np.cumsum(steps_m)
    return np.column_stack([total.real, total.imag])


def _metrics(stops: Stops, legs: Legs, found: Reckoned) -> dict[str, object]:
    held = summarize(found.by_stretch(found.inside))
    squared = summarize(found.by_stretch(found.nees))
    told = summarize(found.by_stretch(textbook(legs, found.stretch)))
    distance = np.hypot(*found.error_m.T)
    # Jackknife: stretches left out one at a time tell how sure the share is.
    count = found.shares.shape[0]
    mean, std = float(found.shares.mean()), math.sqrt((count - 1) * float(found.shares.var()))
    half = float(scipy.stats.t.ppf(0.975, count - 1)) * std
    ends = np.flatnonzero(np.diff(found.stretch, append=-1))
    return {
        "success": bool(held.low <= PROBABILITY <= held.high),
        "reason": f"its 95 % ellipse holds {100.0 * found.inside.mean():.1f} % of the stops "
        f"({100.0 * held.low:.1f} to {100.0 * held.high:.1f} % by stretches)",
        "format": "stops",
        "stops": stops.t_s.shape[0],
        "stretches": count,
        "odometer_m": float(stops.odometer_m.sum()),
        "straight_m": float(np.abs(legs.chord_m).sum()),
        "ellipse_coverage": float(found.inside.mean()),
        "ellipse_coverage_low": held.low,
        "ellipse_coverage_high": held.high,
        "position_nees_mean": squared.mean,
        "position_nees_low": squared.low,
        "position_nees_high": squared.high,
        "covariance_factor": float(found.factors.mean()),
        "odometer_share": mean,
        "odometer_share_low": mean - half,
        "odometer_share_high": mean + half,
        "position_rmse_m": float(np.sqrt(np.square(distance).mean())),
        "position_max_m": float(distance.max()),
        "stretch_end_error_m": float(np.median(distance[ends])),
        "textbook_ellipse_coverage": told.mean,
    }


def _settings(found: Reckoned) -> dict[str, object]:
    return {
        "name": "stop-legs",
        "turns_rad": list(TURNS_RAD),
        "lengths_m": list(LENGTHS_M),
        "stretches": found.factors.shape[0],
        "covariance_factors": [round(float(factor), 6) for factor in found.factors],
    }


def _trace(stops: Stops, found: Reckoned) -> dict[str, FloatArray]:
    """A row a stop; where a stretch begins the next leg's estimate starts from the localized place."""
    truth = np.column_stack([stops.position_m, stops.heading_rad])
    estimate = truth.copy()
    estimate[1:, :2] += found.error_m
    tiny = 1e-6 * np.eye(2)[None]
    covs = np.concatenate([tiny, found.covs])
    upper = (covs[:, 0, 0], covs[:, 0, 1], covs[:, 1, 1])
    zero, heading = np.zeros(truth.shape[0]), np.full(truth.shape[0], HEADING_VAR_RAD2)
    columns = [stops.t_s, *truth.T, *estimate.T, *upper, zero, zero, heading]
    return dict(zip((*TRUTH_COLUMNS, *BELIEF_COLUMNS), map(np.ascontiguousarray, columns), strict=True))
