"""The parameters of the hierarchical law, dimensionless, and its constants for a vessel.

| symbol | meaning | unit |
|---|---|---|
| L, T | length of the hull; time of the vessel's turns, sqrt(m33/tau_2max) | m, s |
| T_r, T_d, T_f | lag that remains, dead time, and time from zero to the limit of an actuator | s |
| h | control period | s |
| q | stretch of T for slow actuators | - |

    q = 0.8 + 2·(max(T_r + T_d + 0.4·T_f) + h/2)/T, at least 2.4 + h/T where not all of the actuators is declared

Lengths are in units of L, times in units of q·T, and l0 in units of q·L: one set of numbers serves a model
of 1 m and a ship of 300 m. On the paper's ship with q = 1 the slopes are those of the paper: 0.3 1/s is 1.4 1/T.
"""

from dataclasses import dataclass
from typing import NamedTuple

from vessel_hsmc_ros.control.interface.applied_wrench import LARGEST_CHANGE, Channel, channel
from vessel_hsmc_ros.control.interface.inputs import dynamics, unit_time
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.network import NetworkParameters
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import InstabilityError
from vessel_hsmc_ros.core.schema import group, parameter

INSTANT, PER_SLOWNESS, UNDECLARED = 0.8, 2.0, 2.4
"""Stretch of the unit of time: with instant actuators, its growth with their slowness in T, and least stretch
where not all of the actuators is declared."""

DEAD, RISE = 1.0, 0.4
"""How much of the dead time, and of the time from zero to the limit, counts as lag, although the law predicts both."""

ASSUMED_FULL = 2.5
"""Time from zero to the limit, in T, by which the reaching is braked where not all of the actuators is declared."""

SLOWER, BEYOND = 0.5, 3.0
"""Rate c at most, in terms of the declared decay rate of the sway velocity, because an error that decays faster than the drift
circles; and station lever at least, in terms of the pivot's distance ahead, behind which a moment acts in reverse."""

CURRENT_TIME, LASTING, WATER_SPEED = 4.0, 0.3, 0.07
"""Time constant of the estimated current in T, share of its rate at which the hull's lasting sway velocity is learned, and speed
through the water in L/T below which the reference's turn is not corrected for the current."""


def number(default: float, description: str, unit: str, symbol: str) -> float:
    """Declare a positive number in units of the vessel; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=1e-4, high=1e3, symbol=symbol, tunable=True)


@dataclass(frozen=True)
class HierarchicalParameters:
    """Numbers in units of the vessel's length L and of the time of its turns T, which is stretched for slow actuators."""

    approach_rate: float = number(1.4, "Rate at which small position errors decay, the slope of (12) and (23).", "1/T", "c")
    approach_deceleration: float = number(0.15, "Deceleration of an approach from afar.", "L/T²", "a")
    station_lever: float = number(0.021, "Distance of the controlled point ahead of the origin at rest.", "L", "l0")
    lookahead_time: float = number(0.6, "Time in which the vessel sails that distance under way.", "T", "T_a")
    turn_deceleration: float = number(0.6, "Yaw deceleration that a turn is to need at most.", "1/T²", "a_r")
    yaw_reaching_gain: float = number(4.6, "Reaching gain of the yaw surface (21).", "1/T", "k1")
    surge_reaching_gain: float = number(4.6, "Reaching gain of the surge surface (27).", "1/T", "k2")
    yaw_switching_gain: float = number(0.053, "Switching gain of the yaw law (21).", "L/T²", "eta1")
    surge_switching_gain: float = number(0.053, "Switching gain of the surge law (27).", "L/T²", "eta2")
    yaw_boundary_layer: float = number(0.023, "Boundary layer of the yaw surface.", "L/T", "phi1")
    surge_boundary_layer: float = number(0.023, "Boundary layer of the surge surface.", "L/T", "phi2")
    prediction_gain: float = number(18.0, "Rate at which prediction errors decay.", "1/T", "lam")
    sway_adaptation_gain: float = number(0.21, "Adaptation of the network for f_v by the yaw surface (29).", "1/T²", "gamma1")
    yaw_adaptation_gain: float = number(8.7, "Adaptation of the network for f_r by the yaw surface (29).", "1/(L·T)²", "gamma2")
    surge_adaptation_gain: float = number(0.85, "Adaptation of the network for f_u by the surge surface (29).", "1/T²", "gamma3")
    actuator_identification: bool = parameter(
        True,
        "Whether lag, dead time and rate of the actuators are identified while the vessel turns, and replace declared ones that"
        " do not explain its motion.",
    )
    network: NetworkParameters = group(NetworkParameters)


class Gains(NamedTuple):
    """The constants by their symbols, in SI units; T is the control period, T_c and U_c those of the estimated current.

    rho = lam²/4 is the adaptation by prediction errors: a prediction error and its weights are two real poles at lam/2.
    """

    c: float
    a: float
    l0: float
    T_a: float
    a_r: float
    k1: float
    k2: float
    eta1: float
    eta2: float
    phi1: float
    phi2: float
    lam: float
    rho: float
    gamma1: float
    gamma2: float
    gamma3: float
    m11: float
    m33: float
    tau_1max: float
    tau_2max: float
    j: float
    T_c: float
    U_c: float
    surge: Channel
    yaw: Channel
    T: float


UNITS = {
    "c": (0, -1), "a": (1, -2), "l0": (1, 0), "T_a": (0, 1), "a_r": (0, -2),
    "k1": (0, -1), "k2": (0, -1), "eta1": (1, -2), "eta2": (1, -2),
    "phi1": (1, -1), "phi2": (1, -1), "lam": (0, -1), "gamma1": (0, -2), "gamma2": (-2, -2), "gamma3": (0, -2),
}  # fmt: skip
"""Powers of L and T in the unit of each number."""


def stretch(vessel: KnownVessel, period: float) -> float:
    """The factor of T for slow actuators and a control period, s: a loop through slow actuators must be slower."""
    inputs, T = dynamics(vessel), unit_time(vessel)
    slowest = max(each.remaining + DEAD * each.dead_time + RISE * each.full for each in (inputs.surge, inputs.yaw))
    least = 0.0 if inputs.declared else UNDECLARED
    return max(INSTANT + PER_SLOWNESS * slowest / T, least) + PER_SLOWNESS * 0.5 * period / T


def gains(parameters: HierarchicalParameters, vessel: KnownVessel, period: float) -> Gains:
    """The constants of the law for a vessel and a control period, s.

    Raises InstabilityError if the period is too long: it takes (k + eta/phi)·T < 2 and lam·T < 2.
    """
    q, inputs = stretch(vessel, period), dynamics(vessel)
    full = max(inputs.yaw.full, 0.0 if inputs.declared else ASSUMED_FULL * unit_time(vessel))
    L, T = vessel.length, unit_time(vessel) * q
    numbers = {
        symbol: value * L ** UNITS[symbol][0] * T ** UNITS[symbol][1] for symbol, value in schema.symbols(parameters).items()
    }
    if vessel.sway_damping_rate > 0.0:
        numbers["c"] = min(numbers["c"], SLOWER * vessel.sway_damping_rate)
    l0 = max(q * numbers["l0"], BEYOND * vessel.percussion_point)
    surge, yaw = (
        channel(limit, each.lag, each.remaining, each.rate, each.dead_time, period)
        for limit, each in zip((vessel.surge_force_limit, vessel.yaw_moment_limit), dynamics(vessel)[:2], strict=True)
    )
    g = Gains(
        **numbers | {"l0": l0}, rho=0.25 * numbers["lam"] * numbers["lam"],
        m11=vessel.surge_inertia, m33=vessel.yaw_inertia, tau_1max=vessel.surge_force_limit, tau_2max=vessel.yaw_moment_limit,
        j=1.0 / (unit_time(vessel) ** 2 * full) if full > 0.0 else LARGEST_CHANGE,
        T_c=CURRENT_TIME * T, U_c=WATER_SPEED * L / T, surge=surge, yaw=yaw, T=period,
    )  # fmt: skip
    fastest = max(g.k1 + g.eta1 / g.phi1, g.k2 + g.eta2 / g.phi2, g.lam)
    if fastest * period >= 2.0:
        raise InstabilityError(
            f"controller.rate_hz must be above {0.5 * fastest:.3g} Hz with the gains of controller.hierarchical"
            f" (got {1.0 / period:g} Hz): reaching gain plus switching gain per boundary layer, and prediction gain, times the"
            " period, must be below 2"
        )
    return g
