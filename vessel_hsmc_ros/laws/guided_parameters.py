"""The gains of the guided law, one set for all cases; docs/guided.md gives the reason for each value."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.laws.known_vessel import KnownVessel
from vessel_hsmc_ros.laws.network import NetworkParameters


def gain(default: float, description: str, unit: str, symbol: str, low: float = 0.0, high: float = 1e3) -> float:
    """Declare a gain that may be changed while the law runs; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=low, high=high, symbol=symbol, tunable=True)


def positive(default: float, description: str, unit: str, symbol: str) -> float:
    """Declare a gain that appears in a denominator, so it must not be zero; the arguments are those of `parameter`."""
    return gain(default, description, unit, symbol, low=1e-3)


@dataclass(frozen=True)
class GuidedParameters:
    """Gains of guidance, surfaces, networks and filters; bandwidths hold in continuous time, for every control period."""

    position_gain: float = positive(0.33, "Decay rate of a small position error.", "1/s", "k_p")
    approach_speed: float = positive(1.2, "Largest speed of approach to a distant reference.", "m/s", "v_max")
    drift_gain: float = gain(0.011, "Integral gain on the position error, which removes the steady-state error.", "1/s²", "k_i")
    drift_limit: float = gain(0.1, "Largest velocity that the integral contributes.", "m/s", "xi_max")
    heading_surface_slope: float = positive(0.42, "Slope of the heading surface (17).", "1/s", "c")
    sway_share: float = gain(
        0.62,
        "Share of the sway acceleration beyond the reference's that the yaw-rate command feeds forward.",
        "",
        "eta",
        high=1.0,
    )
    turn_acceleration_share: float = gain(
        0.4, "Share of the largest yaw acceleration that heading changes are planned with.", "", "a_share", low=0.01, high=1.0
    )
    turn_rate_limit: float = positive(0.25, "Largest yaw rate of a heading change.", "rad/s", "r_max")
    command_bandwidth: float = positive(2.0, "Bandwidth of the command filter.", "1/s", "lambda_c")
    command_integral: float = gain(
        0.1, "Integral gain of the command filter, relative to its bandwidth squared.", "", "kappa", high=1.0
    )
    yaw_reaching_gain: float = positive(1.8, "Reaching gain of the yaw surface (21).", "1/s", "k1")
    surge_reaching_gain: float = positive(1.4, "Reaching gain of the surge surface (27).", "1/s", "k2")
    surge_learning_rate: float = positive(2.0, "Bandwidth of the adaptation of the network for f_u.", "1/s", "w_u")
    sway_learning_rate: float = positive(3.0, "Bandwidth of the adaptation of the network for f_v.", "1/s", "w_v")
    yaw_learning_rate: float = positive(1.8, "Bandwidth of the adaptation of the network for f_r.", "1/s", "w_r")
    position_filter: float = positive(1.5, "Bandwidth of the correction of the predicted position.", "1/s", "w_p")
    heading_filter: float = positive(3.0, "Bandwidth of the correction of the predicted heading.", "1/s", "w_h")
    slew_time: float = gain(0.9, "Slew-rate limit: time for the wrench to go from zero to its limit; 0 for none.", "s", "T_s")
    resting_lever: float = positive(
        0.18, "Station-keeping lever arm: distance ahead of midships of the controlled point.", "m", "rho"
    )
    resting_lever_time: float = gain(3.0, "Growth of the station-keeping lever arm with the sway mismatch.", "s", "T_m")
    resting_heading_gain: float = gain(0.03, "Gain on the reference's heading in undisturbed station keeping.", "1/s", "k_h")
    resting_speed: float = positive(0.02, "Speed below which the ship counts as at rest.", "m/s", "v_0")
    resting_push: float = positive(
        0.005, "Disturbing acceleration below which station keeping counts as undisturbed.", "m/s²", "a_0"
    )
    backing_distance: float = gain(
        50.0, "Largest distance over which the ship goes astern to the reference.", "m", "R_b", high=1e6
    )
    network: NetworkParameters = group(NetworkParameters)


class Gains(NamedTuple):
    """The constants of the law by their symbols, discretised for the control period.

    A bandwidth w becomes a pole z = exp(-w·T), a reaching gain k becomes (1 - exp(-k·T))/T: the exact discretisation of the
    continuous law, which is stable for every gain at every rate.
    """

    k_p: float
    v_max: float
    k_i: float
    xi_max: float
    c: float
    eta: float
    a_max: float
    S1_max: float
    r_max: float
    kappa: float
    T_s: float
    rho: float
    T_m: float
    k_h: float
    v_0: float
    a_0: float
    R_b: float
    m11: float
    m33: float
    tau_1max: float
    tau_2max: float
    T: float
    lambda_c: float
    step_c: float
    k1: float
    k2: float
    z_u: float
    z_v: float
    z_r: float
    z_p: float
    z_h: float


def gains(parameters: GuidedParameters, vessel: KnownVessel, period: float) -> Gains:
    """The constants of the law for a ship and a control period.

    Args:
        parameters: Gains as declared.
        vessel: The known inertia and limits.
        period: Control period T, s.

    Returns:
        The constants, with bandwidths as discrete poles and reaching gains as exact discrete gains.
    """
    T = period
    given = {**schema.symbols(parameters), **schema.symbols(vessel)}
    poles = {name.replace("w_", "z_"): math.exp(-given.pop(name) * T) for name in ("w_u", "w_v", "w_r", "w_p", "w_h")}
    # At S1 = S1_max the reaching term k1·S1 alone needs the entire yaw moment.
    full = vessel.yaw_moment_limit / vessel.yaw_inertia
    S1_max, a_max = full / given["k1"], full * given.pop("a_share")
    # expm1 keeps full precision for k·T near zero, where 1 - exp(-k·T) would cancel.
    for name in ("k1", "k2"):
        given[name] = -math.expm1(-given[name] * T) / T
    return Gains(
        **given,
        **poles,
        a_max=a_max,
        S1_max=S1_max,
        tau_1max=vessel.surge_force_limit,
        tau_2max=vessel.yaw_moment_limit,
        T=T,
        step_c=-math.expm1(-given["lambda_c"] * T) / T,
    )
