"""Thresholds of the guided law, and what it does only for some hulls, in the units of the ship."""

import math

from vessel_hsmc_ros.guided.rule import dynamics, unit_time
from vessel_hsmc_ros.guided.sway_model import GRAVITY, SwayPrior, sway_prior
from vessel_hsmc_ros.law.known_vessel import ControlledVessel, KnownVessel

COURSE_DAMPING, TURNED, COURSE_BANDWIDTH = 1.5, 0.5, 2.0
"""The gain b of the course rate for a hull that declares `drift_decay`; where its course turns the other way first at most
TURNED/(kappa - 1), because at 1/(kappa - 1) the yaw rate would oscillate; and its bandwidth, in 1/T."""

DOUBT = 0.014
"""The drift c_0 of which half is used on such a hull, in sqrt(g·L)."""

REST_DOUBT = 0.0035
"""The drift of which half is used at rest, and half of the long lever arm taken, in sqrt(g·L)."""

SPIN_ERROR = 0.05
"""Position error, in L, above which a ship that turns at rest is expected to come closer."""

LONG_LEVER = 0.08
"""The lever arm of station keeping in a drift, in L."""


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
        "k_s": 2.0 * given["k_p"] if vessel.drift_decay >= 0.0 else 0.0,
    }


def thresholds(vessel: KnownVessel) -> dict[str, float | SwayPrior]:
    """Thresholds, the leakage of the weights, and what a declared `drift_decay` adds."""
    T = unit_time(vessel)
    speed, slow_drift = vessel.length / T, vessel.drift_decay >= 0.0
    prior = sway_prior(vessel)
    # Where nothing is declared, coupled inertia looks like a drift until the ship has turned a few times.
    doubt = (0.023 if dynamics(vessel).declared else 0.05) * speed
    return {
        "e_max": 0.144 * speed,
        "e_r_max": 0.92 / T,
        "m_max": 0.043 * speed,
        "U_s": 0.029 * speed,
        "U_xi": 0.0144 * speed,
        "c_max": 0.3 * speed,
        "c_doubt": DOUBT * math.sqrt(GRAVITY * vessel.length) if slow_drift else doubt,
        "theta_max": T,
        "leak": 0.046 / T,
        "W_0": 0.12 * speed,
        "rho_l": LONG_LEVER * vessel.length,
        "c_rest": REST_DOUBT * math.sqrt(GRAVITY * vessel.length),
        "e_spin": SPIN_ERROR * vessel.length,
        "b": min(COURSE_DAMPING, TURNED / max(prior.kappa - 1.0, 1e-9)) if slow_drift else 0.0,
        "w_b": COURSE_BANDWIDTH / T,
        "sway": prior,
    }
