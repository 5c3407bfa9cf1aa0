"""What shape the offset of odometry has: none, a scale, a bias, a turned heading, a step along a wrong axis.

Each shape predicts the displacement that odometry claims for a true step of length d along u(theta):

    none                 d u(theta)
    scale                (1 + s) d u(theta)                      s free
    heading-offset       d u(theta + delta)                      delta free
    body-bias            d u(theta) + R(theta) b                 b free (2)
    map-bias             d u(theta) + b                          b free (2)
    wrong-axis-x         d u(0): the step is taken along x whatever the heading
    wrong-axis           d u(alpha)                              alpha free

They are fitted by least squares and compared by Schwarz's criterion (Ann. Stat. 1978),
``BIC = N log(RSS / N) + k log N``, which charges for free parameters: a bias that merely imitates a wrong
axis on one heading fits as well and loses by its two parameters. On a log of N = 500 steps without offset
some other shape than ``none`` is named in about 2 % of the logs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pilotage.core.types import FloatArray
from pilotage.logs.odometry_steps import OdometrySteps

LEAST_STEP_M = 1e-6
"""Shorter steps have no direction."""
RESOLUTION_M = 1e-9
"""Residuals below this are rounding, not noise: no model is better for fitting them."""

WRONG_AXIS = "wrong-axis"
WRONG_AXIS_X = "wrong-axis-x"

EXPLANATIONS = {
    "none": "no offset: the errors scatter about zero",
    "scale": "every step is claimed too long or too short by the same factor",
    "heading-offset": "every step is claimed turned by the same angle from the heading",
    "body-bias": "the same displacement in the robot's own frame is added to every step",
    "map-bias": "the same displacement in the map frame is added to every step",
    WRONG_AXIS_X: (
        "every step is claimed along the x axis whatever the heading: one step taken along a wrong axis, "
        "an artefact of how the log was taken, not a bias of the odometry"
    ),
    WRONG_AXIS: (
        "every step is claimed along one fixed direction whatever the heading: one step taken along a wrong "
        "axis, an artefact of how the log was taken, not a bias of the odometry"
    ),
}


@dataclass(frozen=True, slots=True)
class OffsetModel:
    """One fitted shape: its parameters by name with units, the residual and the criterion."""

    shape: str
    parameters: dict[str, float]
    free: int
    rms_m: float
    bic: float


@dataclass(frozen=True, slots=True)
class OffsetComparison:
    """All shapes, best first."""

    models: tuple[OffsetModel, ...]

    @property
    def best(self) -> OffsetModel:
        """The shape that the data speak for."""
        return self.models[0]

    @property
    def axis_rad(self) -> float | None:
        """Direction of the wrong axis, where that is the shape."""
        return self.best.parameters.get("axis_rad")

    def as_dict(self) -> dict[str, object]:
        """Return the comparison as JSON knows it."""
        best = self.best
        return {
            "shape": best.shape,
            "explanation": EXPLANATIONS[best.shape],
            "parameters": best.parameters,
            "models": [
                {
                    "shape": model.shape,
                    "free_parameters": model.free,
                    "rms_m": model.rms_m,
                    "delta_bic": model.bic - best.bic,
                }
                for model in self.models
            ],
        }


@dataclass(frozen=True, slots=True)
class _Steps:
    """Steps that have a direction: lengths (N,), headings (N,), unit vectors (N, 2), claims (N, 2)."""

    d: FloatArray
    theta: FloatArray
    u: FloatArray
    claim: FloatArray


Fit = Callable[[_Steps], tuple[dict[str, float], FloatArray]]


def compare_offsets(logs: Sequence[OdometrySteps]) -> OffsetComparison | None:
    """Compare the shapes on all steps of some logs together; None where nothing moves."""
    steps = _moving(logs)
    n = steps.d.shape[0]
    if n < 3:
        return None
    models = []
    for shape, free, fit in _MODELS:
        parameters, prediction = fit(steps)
        rss = float(((steps.claim - prediction) ** 2).sum())
        bic = n * math.log(max(rss / n, RESOLUTION_M**2)) + free * math.log(n)
        models.append(OffsetModel(shape, parameters, free, math.sqrt(rss / n), bic))
    # Stable: where two shapes say the same (a wrong axis that is the heading), the plainer one comes first.
    return OffsetComparison(tuple(sorted(models, key=lambda model: round(model.bic, 6))))


def _moving(logs: Sequence[OdometrySteps]) -> _Steps:
    lengths, headings, claims = [np.zeros(0)], [np.zeros(0)], [np.zeros((0, 2))]
    for log in logs:
        step = log.truth[:, :2] - log.start[:, :2]
        middle = log.middle_heading_rad
        chord = step[:, 0] * np.cos(middle) + step[:, 1] * np.sin(middle)
        moves = np.abs(chord) > LEAST_STEP_M
        lengths.append(chord[moves])
        headings.append(middle[moves])
        claims.append((log.claimed[:, :2] - log.start[:, :2])[moves])
    theta = np.concatenate(headings)
    return _Steps(np.concatenate(lengths), theta, unit(theta), np.concatenate(claims))


def unit(angle_rad: FloatArray) -> FloatArray:
    """Unit vectors (N, 2) in the directions (N,)."""
    return np.column_stack([np.cos(angle_rad), np.sin(angle_rad)])


def _none(s: _Steps) -> tuple[dict[str, float], FloatArray]:
    return {}, s.d[:, None] * s.u


def _scale(s: _Steps) -> tuple[dict[str, float], FloatArray]:
    truth = s.d[:, None] * s.u
    scale = float((truth * s.claim).sum() / (truth**2).sum())
    return {"scale": scale}, scale * truth


def _heading_offset(s: _Steps) -> tuple[dict[str, float], FloatArray]:
    cross = s.u[:, 0] * s.claim[:, 1] - s.u[:, 1] * s.claim[:, 0]
    dot = (s.u * s.claim).sum(axis=1)
    delta = math.atan2(float(s.d @ cross), float(s.d @ dot))
    return {"heading_offset_rad": delta}, s.d[:, None] * unit(s.theta + delta)


def _body_bias(s: _Steps) -> tuple[dict[str, float], FloatArray]:
    left = np.column_stack([-s.u[:, 1], s.u[:, 0]])
    error = s.claim - s.d[:, None] * s.u
    x, y = float((error * s.u).sum(axis=1).mean()), float((error * left).sum(axis=1).mean())
    return {"bias_x_m": x, "bias_y_m": y}, (s.d + x)[:, None] * s.u + y * left


def _map_bias(s: _Steps) -> tuple[dict[str, float], FloatArray]:
    truth = s.d[:, None] * s.u
    bias = (s.claim - truth).mean(axis=0)
    return {"bias_x_m": float(bias[0]), "bias_y_m": float(bias[1])}, truth + bias


def _wrong_axis_x(s: _Steps) -> tuple[dict[str, float], FloatArray]:
    return {"axis_rad": 0.0}, np.column_stack([s.d, np.zeros_like(s.d)])


def _wrong_axis(s: _Steps) -> tuple[dict[str, float], FloatArray]:
    pull = s.d @ s.claim
    alpha = math.atan2(float(pull[1]), float(pull[0]))
    return {"axis_rad": alpha}, s.d[:, None] * unit(np.full_like(s.d, alpha))


_MODELS: tuple[tuple[str, int, Fit], ...] = (
    ("none", 0, _none),
    ("scale", 1, _scale),
    ("heading-offset", 1, _heading_offset),
    (WRONG_AXIS_X, 0, _wrong_axis_x),
    (WRONG_AXIS, 1, _wrong_axis),
    ("body-bias", 2, _body_bias),
    ("map-bias", 2, _map_bias),
)
