"""Heading from encoders, gyroscope and magnetometer: one error model, gains optimal or given.

State: heading and gyroscope bias, with covariance P (2, 2). Both updates are in Joseph form, so P is what
the errors really are for whatever gain is used, the Kalman gain or a designer's.
"""

from __future__ import annotations

import math

from pilotage.kernels.arrays import FloatArray
from pilotage.kernels.geometry.motion import wrap
from pilotage.kernels.jit import kernel


@kernel
def scalar_gain(var: float, process_var: float, measurement_var: float) -> tuple[float, float]:
    """Gain of a scalar Kalman filter's step and its variance afterwards.

    P <- P + Q, K = P / (P + R), P <- (1 - K)^2 P + K^2 R.
    """
    predicted = var + process_var
    gain = predicted / (predicted + measurement_var)
    return gain, (1.0 - gain) * (1.0 - gain) * predicted + gain * gain * measurement_var


@kernel
def increment_gains(P: FloatArray, dt: float, encoder_var: float, gyro_var: float) -> tuple[float, float]:
    """Kalman gains for heading and bias of what the gyroscope says beyond the encoders in one step.

    The innovation is v = w + b dt + e with w the encoders' error in the turn, b the bias' error and e
    the gyroscope's own; K = cov((heading, bias), v) / var(v). Zero where nothing is uncertain.
    """
    S = encoder_var + P[1, 1] * dt * dt + gyro_var
    if not S > 0.0:
        return 0.0, 0.0
    return (P[0, 1] * dt + encoder_var) / S, P[1, 1] * dt / S


@kernel
def turn_by_encoders_and_gyro(
    state: FloatArray,
    P: FloatArray,
    encoder_angle: float,
    gyro_angle: float,
    dt: float,
    encoder_var: float,
    gyro_var: float,
    heading_gain: float,
    bias_gain: float,
) -> float:
    """Turn ``state`` (2,) and P (2, 2) in place by one step; returns the innovation in rad.

    The encoders predict, the gyroscope's angle over the step corrects: with the true turn u,
    encoder_angle = u - w and gyro_angle = u + b dt + e. A heading gain of 1 with a bias gain of 0 is the
    gyroscope alone, one of 0 the encoders alone.
    """
    innovation = gyro_angle - encoder_angle - state[1] * dt
    state[0] = wrap(state[0] + encoder_angle + heading_gain * innovation)
    state[1] += bias_gain * innovation
    # Errors afterwards: heading + (1 - Kh) w - Kh (b dt + e), and (1 - Kb dt) b - Kb (w + e).
    a01, a11 = -heading_gain * dt, 1.0 - bias_gain * dt
    p00, p01, p11 = P[0, 0], P[0, 1], P[1, 1]
    from_w, minus_bias = 1.0 - heading_gain, -bias_gain
    P[0, 0] = p00 + a01 * (2.0 * p01 + a01 * p11) + from_w * from_w * encoder_var + heading_gain**2 * gyro_var
    P[0, 1] = (
        a11 * (p01 + a01 * p11) + from_w * minus_bias * encoder_var + heading_gain * bias_gain * gyro_var
    )
    P[1, 0] = P[0, 1]
    P[1, 1] = a11 * a11 * p11 + bias_gain**2 * (encoder_var + gyro_var)
    return float(innovation)


@kernel
def correct_by_gyro(
    state: FloatArray, P: FloatArray, innovation: float, dt: float, encoder_cov: float, var: float
) -> float:
    """Correct ``state`` (2,) and P (2, 2) in place by what a gyroscope said over a time ``dt``, which the
    encoders have predicted already; returns the correction of the heading.

    The innovation, of variance ``var``, is v = b dt + e - w with w the encoders' errors over that time, whose
    covariance with the heading's error is ``encoder_cov``: all their variance, but for what the heading was
    corrected by meanwhile. K = -cov((heading, bias), v) / var(v), the Kalman gain.
    """
    if not var > 0.0:
        return 0.0
    heading_cov, bias_cov = encoder_cov + P[0, 1] * dt, P[1, 1] * dt
    correction = heading_cov / var * innovation
    state[0] = wrap(state[0] + correction)
    state[1] += bias_cov / var * innovation
    P[0, 0] -= heading_cov * heading_cov / var
    P[0, 1] -= heading_cov * bias_cov / var
    P[1, 0] = P[0, 1]
    P[1, 1] -= bias_cov * bias_cov / var
    return float(correction)


@kernel
def correct_by_heading(
    state: FloatArray,
    P: FloatArray,
    measured: float,
    var: float,
    heading_gain: float,
    bias_gain: float,
) -> None:
    """Correct ``state`` (2,) and P (2, 2) in place by a measured heading, with the gains given."""
    innovation = wrap(measured - state[0])
    state[0] = wrap(state[0] + heading_gain * innovation)
    state[1] += bias_gain * innovation
    a00, a10 = 1.0 - heading_gain, -bias_gain
    p00, p01, p11 = P[0, 0], P[0, 1], P[1, 1]
    P[0, 0] = a00 * a00 * p00 + heading_gain**2 * var
    P[0, 1] = a00 * (a10 * p00 + p01) + heading_gain * bias_gain * var
    P[1, 0] = P[0, 1]
    P[1, 1] = a10 * (a10 * p00 + 2.0 * p01) + p11 + bias_gain**2 * var


@kernel
def squared_distance_of_heading(state: FloatArray, P: FloatArray, measured: float, var: float) -> float:
    """Squared Mahalanobis distance of a heading at state (2,), P (2, 2): chi-square of one degree."""
    innovation = wrap(measured - state[0])
    S = P[0, 0] + var
    return float(innovation * innovation / S) if S > 0.0 else math.nan
