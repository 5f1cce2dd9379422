"""The gains of the guided law, derived from the declared vessel or set by hand; docs/guided.md gives the reason for each."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.guided.rule import DERIVED, Dynamics, Input, derived_gains, dynamics, unit_time
from vessel_hsmc_ros.guided.sway_model import GRAVITY, SwayPrior, sway_prior
from vessel_hsmc_ros.law.applied_wrench import Channel, channel
from vessel_hsmc_ros.law.known_vessel import ControlledVessel, KnownVessel
from vessel_hsmc_ros.law.network import NetworkParameters

COURSE_DAMPING, TURNED, COURSE_BANDWIDTH = 1.5, 0.5, 2.0
"""The gain b of the course rate for a hull that declares `sway_damping_rate`; where its course turns the other way first at most
TURNED/(kappa - 1), because at 1/(kappa - 1) the yaw rate would oscillate; and its bandwidth, in 1/T."""

DOUBT = 0.014
"""The current c_0 of which half is used on such a hull, in sqrt(g·L)."""

REST_DOUBT = 0.0035
"""The current of which half is used at rest, and half of the long lever arm taken, in sqrt(g·L)."""

SPIN_ERROR = 0.05
"""Position error, in L, above which a ship that turns at rest is expected to come closer."""

LONG_LEVER = 0.08
"""The lever arm of station keeping in a current, in L."""


def station_keeping(vessel: KnownVessel, given: dict[str, float], a_max: float) -> dict[str, float]:
    """The constants of station keeping.

    Args:
        vessel: What is declared of the ship.
        given: The gains by their symbols.
        a_max: Yaw acceleration that turns are planned with, rad/s².
    """
    x_p = vessel.ahead if isinstance(vessel, ControlledVessel) else 0.0
    # An offset of r_h·lever/k_p across the hull stops the turn to the reference's heading.
    lever = given["rho"] + abs(x_p or vessel.sway_yaw_inertia / vessel.sway_inertia)
    return {
        "x_p": x_p,
        "x_far": 0.01 * vessel.length,
        "r_rest": max(given["r_max"], 0.8 / unit_time(vessel)),
        "dr_rest": max(2.0 * a_max, 0.3 * vessel.yaw_moment_limit / vessel.yaw_inertia),
        "r_h": 0.0005 * vessel.length * given["k_p"] / lever,
        "k_s": 2.0 * given["k_p"] if vessel.sway_damping_rate >= 0.0 else 0.0,
    }


def thresholds(vessel: KnownVessel) -> dict[str, float | SwayPrior]:
    """Thresholds, the leakage of the weights, and what a declared `sway_damping_rate` adds."""
    T = unit_time(vessel)
    speed, low_sway_damping = vessel.length / T, vessel.sway_damping_rate >= 0.0
    prior = sway_prior(vessel)
    # Where nothing is declared, coupled inertia looks like a current until the ship has turned a few times.
    doubt = (0.023 if dynamics(vessel).declared else 0.05) * speed
    return {
        "e_max": 0.144 * speed,
        "e_r_max": 0.92 / T,
        "m_max": 0.043 * speed,
        "U_s": 0.029 * speed,
        "U_xi": 0.0144 * speed,
        "c_max": 0.3 * speed,
        "c_doubt": DOUBT * math.sqrt(GRAVITY * vessel.length) if low_sway_damping else doubt,
        "theta_max": T,
        "leak": 0.046 / T,
        "W_0": 0.12 * speed,
        "rho_l": LONG_LEVER * vessel.length,
        "c_rest": REST_DOUBT * math.sqrt(GRAVITY * vessel.length),
        "e_spin": SPIN_ERROR * vessel.length,
        "b": min(COURSE_DAMPING, TURNED / max(prior.kappa - 1.0, 1e-9)) if low_sway_damping else 0.0,
        "w_b": COURSE_BANDWIDTH / T,
        "sway": prior,
    }


POSITIVE = (
    "position_gain",
    "approach_speed",
    "heading_surface_slope",
    "turn_acceleration_share",
    "yaw_reaching_gain",
    "station_keeping_lever",
    "station_keeping_speed",
    "station_keeping_disturbance",
)
"""The gains that appear in a denominator, so they must not be zero."""

SURGE_FORECAST = 1.6, 0.15
"""Least bandwidth of the forecast in surge where actuators are declared, in 1/T, and in terms of their dead time: a force that
comes later than declared would oscillate. Where nothing is declared, a force may take 10 s to build up: none is added."""


def gain(description: str, unit: str, symbol: str, high: float = 1e3, former: str = "") -> float:
    """Declare a gain that may be changed while the law runs; by default it follows from the declared vessel."""
    text = f"{description} Negative: derived from the vessel."
    return parameter(DERIVED, text, unit=unit, low=DERIVED, high=high, symbol=symbol, tunable=True, former=former)


@dataclass(frozen=True)
class GuidedParameters:
    """Gains of guidance, surfaces, networks and filters; bandwidths hold in continuous time, for every control period."""

    position_gain: float = gain("Decay rate of a small position error.", "1/s", "k_p")
    approach_speed: float = gain("Largest speed of approach to a distant reference.", "m/s", "v_max")
    integral_gain: float = gain(
        "Integral gain on the position error, which removes the steady-state error.", "1/s²", "k_i", former="drift_gain"
    )
    integral_limit: float = gain("Largest velocity that the integral contributes.", "m/s", "xi_max", former="drift_limit")
    heading_surface_slope: float = gain("Slope of the heading surface (17).", "1/s", "c")
    sway_share: float = gain(
        "Share of the sway acceleration beyond the reference's that the yaw-rate command feeds forward.",
        "",
        "eta",
        high=1.0,
    )
    sway_bandwidth: float = gain("Bandwidth below which all of that sway acceleration is fed forward.", "1/s", "w_s")
    turn_acceleration_share: float = gain(
        "Share of the largest yaw acceleration that heading changes are planned with.", "", "a_share", high=1.0
    )
    turn_rate_limit: float = gain("Largest yaw rate of a heading change.", "rad/s", "r_max")
    command_bandwidth: float = gain("Bandwidth of the command filter.", "1/s", "lambda_c")
    command_integral: float = gain(
        "Integral gain of the command filter, relative to its bandwidth squared.", "", "kappa", high=1.0
    )
    yaw_reaching_gain: float = gain("Reaching gain of the yaw surface (21).", "1/s", "k1")
    surge_reaching_gain: float = gain("Reaching gain of the surge surface (27).", "1/s", "k2")
    surge_learning_rate: float = gain("Bandwidth of the adaptation of the network for f_u.", "1/s", "w_u")
    sway_learning_rate: float = gain("Bandwidth of the adaptation of the network for f_v.", "1/s", "w_v")
    yaw_learning_rate: float = gain("Bandwidth of the adaptation of the network for f_r.", "1/s", "w_r")
    forecast_bandwidth: float = gain(
        "Bandwidth up to which the lags of adaptation and actuators are made up for in the networks' outputs.", "1/s", "w_f"
    )
    position_filter: float = gain("Bandwidth of the correction of the predicted position.", "1/s", "w_p")
    heading_filter: float = gain("Bandwidth of the correction of the predicted heading.", "1/s", "w_h")
    slew_time: float = gain("Slew-rate limit: time for the wrench to go from zero to its limit; 0 for none.", "s", "T_s")
    station_keeping_lever: float = gain(
        "Station-keeping lever arm: distance ahead of midships of the controlled point.", "m", "rho", former="resting_lever"
    )
    station_keeping_lever_time: float = gain(
        "Growth of the station-keeping lever arm with the sway mismatch.", "s", "T_m", former="resting_lever_time"
    )
    station_keeping_heading_gain: float = gain(
        "Gain on the reference's heading in undisturbed station keeping.", "1/s", "k_h", former="resting_heading_gain"
    )
    station_keeping_speed: float = gain("Speed below which the ship counts as at rest.", "m/s", "v_0", former="resting_speed")
    station_keeping_disturbance: float = gain(
        "Disturbing acceleration below which station keeping counts as undisturbed.", "m/s²", "a_0", former="resting_push"
    )
    backing_distance: float = gain("Largest distance over which the ship goes astern to the reference.", "m", "R_b", high=1e6)
    actuator_identification: bool = parameter(
        True,
        "Whether lag, dead time and rate of the actuators are identified while the ship turns, and take the place of the declared"
        " ones where these do not explain her motion.",
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
    step_s: float
    step_f: float
    step_fu: float
    lead_u: float
    lead_r: float
    a_max: float
    S1_max: float
    r_max: float
    kappa: float
    slew_1: float
    slew_2: float
    rho: float
    T_m: float
    k_h: float
    v_0: float
    a_0: float
    R_b: float
    e_max: float
    e_r_max: float
    m_max: float
    U_s: float
    U_xi: float
    c_max: float
    c_doubt: float
    theta_max: float
    leak: float
    W_0: float
    r_h: float
    x_p: float
    x_far: float
    r_rest: float
    dr_rest: float
    k_s: float
    b: float
    w_b: float
    step_b: float
    rho_l: float
    c_rest: float
    e_spin: float
    sway: SwayPrior
    m11: float
    m33: float
    surge: Channel
    yaw: Channel
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


def by_hand_or_derived(parameters: GuidedParameters, vessel: KnownVessel) -> GuidedParameters:
    """The gains as numbers: those set by hand, and the derived ones.

    Raises:
        ParameterError: a gain that appears in a denominator is zero.
    """
    derived = {name: value for name, value in derived_gains(vessel).items() if getattr(parameters, name) < 0.0}
    chosen = schema.changed(parameters, derived, "controller.guided")
    for name in POSITIVE:
        if getattr(chosen, name) == 0.0:
            raise ParameterError(f"controller.guided.{name} = 0.0 is not allowed: it takes a number above 0, or -1 to derive it")
    return chosen


def gains(parameters: GuidedParameters, vessel: KnownVessel, period: float) -> Gains:
    """The constants of the law for a ship and a control period.

    Args:
        parameters: Gains set by hand or to be derived.
        vessel: What is declared of the ship.
        period: Control period T, s.

    Returns:
        The constants, with bandwidths as discrete poles and reaching gains as exact discrete gains.

    Raises:
        ParameterError: a gain that appears in a denominator is zero.
    """
    T = period
    given = schema.symbols(by_hand_or_derived(parameters, vessel))
    bandwidths = given["w_u"], given["w_r"]
    poles = {name.replace("w_", "z_"): math.exp(-given.pop(name) * T) for name in ("w_u", "w_v", "w_r", "w_p", "w_h")}
    # At S1 = S1_max the reaching term k1·S1 alone needs the entire yaw moment.
    full = vessel.yaw_moment_limit / vessel.yaw_inertia
    S1_max, a_max = full / given["k1"], full * given.pop("a_share")
    # expm1 keeps full precision for k·T near zero, where 1 - exp(-k·T) would cancel.
    for name in ("k1", "k2"):
        given[name] = -math.expm1(-given[name] * T) / T
    constants = {**given, **poles, **thresholds(vessel), **schema.symbols(vessel)}
    inputs = dynamics(vessel)
    constants |= _forecast(constants.pop("w_f"), bandwidths, inputs, unit_time(vessel), T)
    constants["step_b"] = -math.expm1(-constants["w_b"] * T)
    constants["step_s"] = -math.expm1(-constants.pop("w_s") * T)
    constants |= station_keeping(vessel, given, a_max)
    constants |= {"a_max": a_max, "S1_max": S1_max, "T": T, "step_c": -math.expm1(-given["lambda_c"] * T) / T}
    limits = vessel.surge_force_limit, vessel.yaw_moment_limit
    T_s = constants.pop("T_s")
    constants["slew_1"], constants["slew_2"] = (
        _slew(each, limit / T_s if T_s > 0.0 else math.inf, T)
        for each, limit in zip((inputs.surge, inputs.yaw), limits, strict=True)
    )
    surge, yaw = (_channel(each, limit, T) for each, limit in zip((inputs.surge, inputs.yaw), limits, strict=True))
    return Gains(surge=surge, yaw=yaw, **constants)


def _slew(known: Input, fastest: float, T: float) -> float:
    """Largest change of a command in a period, or 0 for none.

    An input without lag follows a command at its declared rate exactly, whether it is as slow as declared or faster: the command
    is then the applied wrench. Otherwise the law would take what a faster input does for a disturbance.

    Args:
        known: What the law takes the input for.
        fastest: Rate by the gain T_s, N/s or N·m/s.
        T: Control period, s.
    """
    rate = min(fastest, known.rate if known.lag == 0.0 else math.inf)
    return rate * T if rate < math.inf else 0.0


def _forecast(w_f: float, bandwidths: tuple[float, float], inputs: Dynamics, unit: float, T: float) -> dict[str, float]:
    """The filters of the slow parts of the networks' outputs, and the factors on what exceeds them.

    Args:
        w_f: Bandwidth of the forecast.
        bandwidths: Of the networks for surge and yaw.
        inputs: Dynamics of surge force and yaw moment.
        unit: Time of the ship's turns, s.
        T: Control period, s.
    """
    # The surge loop has phase to spare: its forecast also follows the resistance, which varies as a current is turned through.
    least = min(SURGE_FORECAST[0] / (unit * inputs.q), SURGE_FORECAST[1] / max(inputs.surge.dead_time, 1e-9))
    least = least if inputs.declared else 0.0
    w_fu = max(w_f, least) if w_f > 0.0 else 0.0
    lag_u, lag_r = (
        2.0 / max(w, 1e-9) + each.dead_time + each.remaining
        for w, each in zip(bandwidths, (inputs.surge, inputs.yaw), strict=True)
    )
    return {
        "step_f": -math.expm1(-w_f * T),
        "step_fu": -math.expm1(-w_fu * T),
        "lead_u": w_fu * lag_u,
        "lead_r": w_f * lag_r,
    }


def _channel(known: Input, limit: float, period: float) -> Channel:
    return channel(limit, known.lag, known.remaining, known.rate, known.dead_time, period)
