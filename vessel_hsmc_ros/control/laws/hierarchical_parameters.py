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

Interval arithmetic: sums, products and quotients of numbers that are only known to lie between two bounds.

Each bound is rounded outwards by one unit in the last place, so that the result contains every value that the operands allow.
An expression in which a quantity occurs twice gives an interval that is too wide, never one that is too narrow.

Source: R. E. Moore, R. B. Kearfott and M. J. Cloud, Introduction to Interval Analysis, SIAM 2009.

Conditions and bounds of the hierarchical law in closed form: docs/theory.md derives them.

| symbol | meaning | unit |
|---|---|---|
| D, K | decay rate of the sway velocity, sway acceleration per surge velocity and yaw rate: dv = -D·v - K·u·r | 1/s, - |
| lam | l/U, distance of the controlled point in terms of the speed; T_a where the vessel is not slow | s |
| k | sway acceleration per angle between the bow and an earth-fixed force | m/s² |
| s | bound of the length of (S2, S1) | m/s |

With S1 = S2 = 0 the position error across has these polynomials, all of whose roots are on the left where the ratios exceed 1:

    lam·p³ + (lam·D + 1 - K)·p² + (D + c·(1 - K))·p + c·D       on a straight line: `turning_ratio` and `routh_ratio`
    l0·p³ + l0·D·p² + k·p + k·c                                 at rest, the bow in wind or current: `rest_ratio`

The functions of a `Value` take intervals too, and then hold for every hull within them.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

from vessel_hsmc_ros.control.interface.actuators import LARGEST_CHANGE, Channel, channel, dynamics, unit_time
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.network import NetworkParameters
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import InstabilityError, ParameterError
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
    """The constants of the law for a vessel and a control period, s."""
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


@dataclass(frozen=True)
class Interval:
    """All numbers from `low` to `high`."""

    low: float
    high: float

    def __add__(self, other: "Interval | float") -> "Interval":
        o = interval(other)
        return _outwards(self.low + o.low, self.high + o.high)

    def __radd__(self, other: float) -> "Interval":
        return self + other

    def __neg__(self) -> "Interval":
        return Interval(-self.high, -self.low)

    def __sub__(self, other: "Interval | float") -> "Interval":
        return self + (-interval(other))

    def __rsub__(self, other: float) -> "Interval":
        return interval(other) - self

    def __mul__(self, other: "Interval | float") -> "Interval":
        o = interval(other)
        products = [a * b for a in (self.low, self.high) for b in (o.low, o.high)]
        return _outwards(min(products), max(products))

    def __rmul__(self, other: float) -> "Interval":
        return self * other

    def __truediv__(self, other: "Interval | float") -> "Interval":
        """The quotient. Raises ParameterError if the divisor contains zero."""
        o = interval(other)
        if o.low <= 0.0 <= o.high:
            raise ParameterError(f"the divisor must not contain zero (got {o.low:g} to {o.high:g})")
        quotients = [a / b for a in (self.low, self.high) for b in (o.low, o.high)]
        return _outwards(min(quotients), max(quotients))

    def __rtruediv__(self, other: float) -> "Interval":
        return interval(other) / self

    def squared(self) -> "Interval":
        """The squares, which the product with itself would take for the products of two numbers."""
        low, high = sorted((abs(self.low), abs(self.high)))
        least = 0.0 if self.low <= 0.0 <= self.high else low * low
        return Interval(max(0.0, math.nextafter(least, -math.inf)), math.nextafter(high * high, math.inf))


def interval(value: "Interval | float") -> "Interval":
    """A number as an interval."""
    return value if isinstance(value, Interval) else Interval(value, value)


def about(value: float, share: float) -> "Interval":
    """The numbers within a share of a value, such as 0.2 for 20 %."""
    return interval(value) * Interval(1.0 - share, 1.0 + share)


def _outwards(low: float, high: float) -> "Interval":
    return Interval(math.nextafter(low, -math.inf), math.nextafter(high, math.inf))


MARGIN, FURTHER = 1.05, 1.2
"""How much larger the error at rest may be under a varying sway force than under a constant one, and the growth with the drift in
terms of c·l0; measured, docs/theory.md."""

MAX_DRIFT = 0.6
"""The same drift beyond which the motion may not be a circle."""

PATIENCE = 100.0
"""Time after which what is left of an error at rest in calm water counts as its bound, in 1/c."""

Value = TypeVar("Value", float, Interval)


def turning_ratio(D: Value, K: Value, lam: float) -> Value:
    """(1 + lam·D)/K, above 1 where the course turns with the heading in the end; K above 0."""
    return (D * lam + 1.0) / K


def routh_ratio(g: Gains, D: Value, K: Value, lam: float) -> Value:
    """(lam·D + 1 - K)·(D + c·(1 - K))/(c·lam·D), with the product expanded, so that intervals stay narrow."""
    q = -K + 1.0
    square = q.squared() if isinstance(q, Interval) else q * q
    return D / g.c + q * (1.0 + 1.0 / (g.c * lam)) + square / (D * lam)


def rest_ratio(g: Gains, D: Value) -> Value:
    """D/c."""
    return D / g.c


def decay(g: Gains, d: float) -> float:
    """The rate f = 2·c/(1 + sqrt(1 + 2·c²·d/a)) at which an error of length d is to decay."""
    return 2.0 * g.c / (1.0 + math.sqrt(1.0 + 2.0 * g.c * g.c * d / g.a))


def ball(g: Gains, s: float) -> float:
    """The error at rest under any load: d = 2·l0 + s/f(d)."""
    d = 2.0 * g.l0
    for _ in range(200):  # s/f grows as the square root of d does, so this converges
        d = 2.0 * g.l0 + s / decay(g, d)
    return d


def circling(g: Gains, v: float) -> float:
    """The radius at which a vessel circles the target under a sway force fixed to the hull.

    It is near (l0²·v/c)^(1/3) for a slow drift.

    z2·(c·z2 + v)² = c·l0²·v,   r = -(c·z2 + v)/l0,   z1 = v/r

    `v`: sway velocity at which the hull drifts under the force, at least 0.
    """
    if v == 0.0:
        return 0.0
    low, high = 0.0, (g.l0 * g.l0 * v / g.c) ** (1.0 / 3.0)
    for _ in range(100):
        z2 = 0.5 * (low + high)
        low, high = (z2, high) if z2 * (g.c * z2 + v) ** 2 < g.c * g.l0 * g.l0 * v else (low, z2)
    return math.hypot(low, v * g.l0 / (g.c * low + v))


def circled(g: Gains, v: float, s: float) -> tuple[float, float]:
    """The largest error at rest under a sway force fixed to the hull that varies at will, and the time constant of that circle.

    docs/theory.md has the model, in which a constant force is the worst up to a margin. Surfaces of the size s act like a drift
    of 2·s. In calm water the error decays as the square root of the time: what is left after PATIENCE counts. Infinite beyond
    MAX_DRIFT.

    Args:
        g: Gains.
        v: Largest sway velocity at which the hull drifts under the force while it circles.
        s: Bound of the length of (S2, S1).
    """
    drive = max((v + 2.0 * s) / (g.c * g.l0), (2.0 * PATIENCE) ** -1.5)
    if drive > MAX_DRIFT:
        return math.inf, math.inf
    return (MARGIN + FURTHER * drive) * circling(g, drive * g.c * g.l0), 1.0 / (3.0 * g.c * drive ** (2.0 / 3.0))


def sway_warning(parameters: HierarchicalParameters, vessel: KnownVessel, period: float) -> str:
    """A sentence on a vessel whose declared sway makes the path error grow; empty for one that is kept or declares nothing.

    `parameters`: numbers of the law. Raises InstabilityError if the period is too long for the gains.
    """
    D, K = vessel.sway_damping_rate, vessel.coriolis_ratio
    if D < 0.0:
        return ""
    g, K = gains(parameters, vessel, period), K if K >= 0.0 else min(vessel.surge_inertia / vessel.sway_inertia, 1.0)
    ratio = min(routh_ratio(g, D, K, g.T_a), turning_ratio(D, K, g.T_a) if K else math.inf) if D else 0.0
    if ratio > 1.0:
        return ""
    return (
        f"the hierarchical law does not keep this vessel on its path: with controller.vessel.sway_damping_rate = {D:g} 1/s and"
        f" coriolis_ratio = {K:g} the Routh ratio of the path error must be above 1 (got {ratio:.2g}); guided suits it, or a"
        " smaller controller.hierarchical.approach_rate"
    )
