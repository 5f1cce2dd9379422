"""The intermediate terms of a control law, named in words; they are the fields of ControlState.msg, for every law.

| name | meaning | unit | equation |
|---|---|---|---|
| surge, sway, heading_error | z1e, z2e, z3e | m, m, rad | (11) |
| .._error_rate | their time derivatives | m/s, m/s, rad/s | (23), (12), (17) |
| sway, heading_surface | sigma1, sigma2 | m/s, rad/s | (12), (17) |
| yaw, surge_surface | S1, S2 | rad/s, m/s | (20), (23) |
| commanded_.. | heading, yaw rate and surge velocity that the guidance commands | rad, rad/s, m/s | - |
| .._estimate | network outputs for f_u, f_v, f_r | m/s², m/s², rad/s² | (25), (14), (15) |
| .._weights | their weights W3, W1, W2, shape (l,) | as the outputs | (25), (14), (15) |
| .._weight_norm | Euclidean norm of each weight vector | as the outputs | (30) |
| lyapunov | V_S = (S1² + S2²)/2, the part of V that can be measured | mixed | (30) |
| lyapunov_rate | difference quotient of V_S since the last step | 1/s | (31) |
| .._saturated | whether the law limited the wrench | - | - |
"""

import math
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core.arrays import Array

Number = TypeVar("Number", float, NDArray[np.float64])

NONE = math.nan
NO_WEIGHTS: Array = np.empty(0)


class Terms(NamedTuple):
    """The terms of one control period; terms that a law does not have keep their default: NaN, empty or false."""

    surge_error: float = NONE
    sway_error: float = NONE
    heading_error: float = NONE
    surge_error_rate: float = NONE
    sway_error_rate: float = NONE
    heading_error_rate: float = NONE
    sway_surface: float = NONE
    heading_surface: float = NONE
    yaw_surface: float = NONE
    surge_surface: float = NONE
    commanded_heading: float = NONE
    commanded_yaw_rate: float = NONE
    commanded_surge_velocity: float = NONE
    surge_estimate: float = NONE
    sway_estimate: float = NONE
    yaw_estimate: float = NONE
    surge_weights: Array = NO_WEIGHTS
    sway_weights: Array = NO_WEIGHTS
    yaw_weights: Array = NO_WEIGHTS
    surge_weight_norm: float = NONE
    sway_weight_norm: float = NONE
    yaw_weight_norm: float = NONE
    lyapunov: float = NONE
    lyapunov_rate: float = NONE
    surge_saturated: bool = False
    yaw_saturated: bool = False


def diagnosed(terms: Terms, previous_lyapunov: float | None, interval: float) -> Terms:
    """Add the quantities that follow from the terms of any law: weight norms, V_S and its rate of change.

    `previous_lyapunov`: V_S at the last step; None at the first step, whose rate is 0. `interval`: time since the last step, s.
    Returns the terms with weight_norm, lyapunov and lyapunov_rate filled in.
    """
    lyapunov = lyapunov_function(terms.yaw_surface, terms.surge_surface)
    rate = 0.0 if previous_lyapunov is None else (lyapunov - previous_lyapunov) / interval
    return terms._replace(
        surge_weight_norm=_norm(terms.surge_weights),
        sway_weight_norm=_norm(terms.sway_weights),
        yaw_weight_norm=_norm(terms.yaw_weights),
        lyapunov=lyapunov,
        lyapunov_rate=rate,
    )


def lyapunov_function(yaw_surface: Number, surge_surface: Number) -> Number:
    """V_S of (30) from S1 and S2, numbers or arrays; NaN for a law without both surfaces."""
    return 0.5 * (yaw_surface * yaw_surface + surge_surface * surge_surface)


def lyapunov_rates(lyapunov: Array, interval: Array) -> Array:
    """The rates of V_S that `diagnosed` gives step by step, for a whole run.

    `lyapunov`: V_S at each control step, shape (m,). `interval`: time since the step before, s, shape (m,); the first value is
    not used. Returns difference quotients, shape (m,); the first is 0.
    """
    rates = np.zeros(len(lyapunov))
    rates[1:] = np.diff(lyapunov) / interval[1:]
    return rates


def weight_norms(weights: Array) -> Array:
    """Euclidean norms over the last axis, bit-identical to those that `diagnosed` gives step by step.

    `weights`: weights, shape (..., l). Returns the norms, shape (...).
    """
    squares = np.zeros(weights.shape[:-1])
    # One after the other, as `_norm` does: np.sum and np.dot add in other orders for other shapes.
    for i in range(weights.shape[-1]):
        squares += weights[..., i] * weights[..., i]
    return np.sqrt(squares)


def _norm(weights: Array) -> float:
    return math.sqrt(np.add.accumulate(weights * weights)[-1]) if len(weights) else NONE
