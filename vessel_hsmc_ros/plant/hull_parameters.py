"""Declarations of the hull data: inertia, damping, limits and dimensions of a ship, and the coefficients that they give.

A damping coefficient is minus the hydrodynamic derivative, so that a positive one opposes its own velocity. Names follow one
rule: `<force>_damping[_from_<velocity>][_at_<speed>][_quadratic|_cubic]`, such as `sway_damping_from_yaw_at_sway`, the sway force
lost to |v|·r. All coefficients beyond the paper's are 0 by default; docs/model.md lists them beside the symbols.

Electric power that the propulsion takes, and the battery that it comes from.

| symbol | meaning | unit |
|---|---|---|
| s, m | surge force and yaw moment, as shares of their limits | - |
| P_0, P_1 | power of all else, power at full thrust | W |
| F, U | largest surge force, top speed | N, m/s |

At a constant advance ratio the thrust of a propeller grows with the square of its shaft speed, and its power with the cube, by
the affinity laws: P is proportional to T^(3/2). Two propellers that share the surge force and turn by their difference take

    P = P_0 + P_1/2·(|s + m|^(3/2) + |s - m|^(3/2))

A vessel with a rudder or an azimuth turns without a difference: m = 0. Where the power at full thrust is not declared, it is
estimated as P_1 = F·U/eta, with the efficiency eta from the battery to the thrust.

Before a run, hull data are checked: damping must take energy from the ship, P = nu'·D(nu)·nu >= 0, at the speeds for which it
holds. Two defects are errors: an axis on its own that gains energy, and, where no range of speeds is declared, a gain at ever
larger speeds, because then the motion has no bound. A gain by cross terms at some speeds only is a warning: several published
hulls have it, CyberShip II among them, and their motions stay bounded.
"""

import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, SimulationError
from vessel_hsmc_ros.core.hull import Hull, NamedVessel, inherited, steering_loss, steering_speed
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.core.thruster_layout import ThrusterLayout
from vessel_hsmc_ros.plant.dynamics import Vessel, damping_force

EFFICIENCY = 0.4  # eta: 0.5 of the propeller and 0.8 of motor and electronics, as is usual for small electric boats


def power(description: str, symbol: str) -> float:
    """Declare an electric power, zero by default."""
    return parameter(0.0, description, unit="W", low=0.0, high=1e9, symbol=symbol)


@dataclass(frozen=True)
class PowerParameters:
    """What the vessel takes from its battery, for forecasts; nothing of it has a part in the motion."""

    full_thrust: float = power("Electric power at full thrust, for forecasts; 0 estimates it from the top speed.", "P_1")
    other: float = power("Electric power of all else, such as computers and sensors, for forecasts.", "P_0")
    battery_wh: float = parameter(
        0.0, "Usable capacity of the battery, for forecasts; 0 for not known.", unit="W·h", low=0.0, high=1e12
    )


def electric_power(surge: Array, yaw: Array, full_thrust: float, other: float) -> Array:
    """The power P, (n,) W.

    `surge`, `yaw`: s and m, (n,); m is 0 where the vessel does not turn by a difference of thrusts. `full_thrust`, `other`: P_1
    and P_0, W.
    """
    shares: Array = 0.5 * (np.abs(surge + yaw) ** 1.5 + np.abs(surge - yaw) ** 1.5)
    return other + full_thrust * shares


UNBOUNDED = (-math.inf, math.inf)
BEYOND_THE_PAPER = Vessel._fields[12:28]


def inertia(default: float, description: str, unit: str, symbol: str, high: float = 1e12) -> float:
    """Declare an inertia, which must be positive; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=1e-3, high=high, symbol=symbol)


def damping(default: float, description: str, unit: str, symbol: str, high: float = 1e12) -> float:
    """Declare a linear damping coefficient, which must not be negative; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=0.0, high=high, symbol=symbol)


def fitted(default: float, description: str, unit: str, symbol: str, high: float = 1e12) -> float:
    """Declare a coefficient that may be negative where others outweigh it; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=-high, high=high, symbol=symbol)


def coupling(description: str, unit: str, symbol: str) -> float:
    """Declare a coefficient of another velocity, zero by default; the arguments are those of `parameter`."""
    return fitted(0.0, description, unit, symbol, 1e15)


def propulsion_limit(what: str, unit: str) -> float:
    """Declare the largest force or moment of the propulsion; there is no limit by default, as in the paper."""
    return parameter(math.inf, f"Largest {what} of the propulsion, in either direction.", unit=unit, low=1e-3, high=math.inf)


def speed_range(what: str, unit: str) -> tuple[float, ...]:
    """Declare the range of a velocity in which the hull data are valid; unbounded by default."""
    return parameter(
        UNBOUNDED, f"Range of the {what} in which the hull data are valid.", unit=unit, low=-math.inf, high=math.inf, length=2
    )


@dataclass(frozen=True)
class VesselParameters(NamedVessel):
    """The coefficients and limits of the ship; the defaults are the ship of the paper's section 6.2."""

    surge_inertia: float = inertia(120e3, "Mass with added mass in surge.", "kg", "m11")
    sway_inertia: float = inertia(177.9e3, "Mass with added mass in sway.", "kg", "m22")
    yaw_inertia: float = inertia(636e5, "Moment of inertia with added inertia in yaw.", "kg·m²", "m33", 1e15)
    sway_yaw_inertia: float = coupling("Inertia of the sway force by a yaw acceleration.", "kg·m", "m23")
    yaw_sway_inertia: float = coupling(
        "Inertia of the yaw moment by a sway acceleration; 0 for that of sway_yaw_inertia.", "kg·m", "m32"
    )
    surge_damping: float = damping(215e2, "Linear damping in surge.", "kg/s", "d_u")
    sway_damping: float = damping(147e3, "Linear damping in sway.", "kg/s", "d_v")
    yaw_damping: float = damping(802e4, "Linear damping in yaw.", "kg·m²/s", "d_r", 1e15)
    surge_damping_quadratic: float = fitted(0.2 * 215e2, "Quadratic damping in surge, on |u|u.", "kg/m", "d_u2")
    surge_damping_cubic: float = fitted(0.1 * 215e2, "Cubic damping in surge, on u³.", "kg·s/m²", "d_u3")
    surge_damping_from_sway: float = coupling("Surge force lost to sway, on v².", "kg/m", "d_x_vv")
    surge_damping_from_sway_yaw: float = coupling("Surge force lost to sway and yaw, on v·r.", "kg", "d_x_vr")
    sway_damping_quadratic: float = fitted(0.2 * 147e3, "Quadratic damping in sway, on |v|v.", "kg/m", "d_v2")
    sway_damping_cubic: float = fitted(0.1 * 147e3, "Cubic damping in sway, on v³.", "kg·s/m²", "d_v3")
    sway_damping_at_yaw: float = coupling("Sway damping by the yaw rate, on |r|v.", "kg", "d_y_rv")
    sway_damping_at_surge: float = coupling("Sway damping by the surge speed, on |u|v.", "kg/m", "d_y_uv")
    sway_damping_from_yaw: float = coupling("Sway force lost to yaw, on r.", "kg·m/s", "d_y_r")
    sway_damping_from_yaw_quadratic: float = coupling("Sway force lost to yaw, on |r|r.", "kg·m", "d_y_rr")
    sway_damping_from_yaw_at_sway: float = coupling("Sway force lost to yaw by the sway speed, on |v|r.", "kg", "d_y_vr")
    sway_damping_from_yaw_at_surge: float = coupling("Sway force lost to yaw by the surge velocity, on u·r.", "kg", "d_y_ur")
    yaw_damping_quadratic: float = fitted(0.2 * 802e4, "Quadratic damping in yaw, on |r|r.", "kg·m²", "d_r2", 1e15)
    yaw_damping_cubic: float = fitted(0.1 * 802e4, "Cubic damping in yaw, on r³.", "kg·m²·s", "d_r3", 1e15)
    yaw_damping_at_sway: float = coupling("Yaw damping by the sway speed, on |v|r.", "kg·m", "d_n_vr")
    yaw_damping_at_surge: float = coupling("Yaw damping by the surge speed, on |u|r.", "kg·m", "d_n_ur")
    yaw_damping_from_sway: float = coupling("Yaw moment lost to sway, on v.", "kg·m/s", "d_n_v")
    yaw_damping_from_sway_quadratic: float = coupling("Yaw moment lost to sway, on |v|v.", "kg", "d_n_vv")
    yaw_damping_from_sway_at_yaw: float = coupling("Yaw moment lost to sway by the yaw rate, on |r|v.", "kg·m", "d_n_rv")
    yaw_damping_from_sway_at_surge: float = coupling("Yaw moment lost to sway by the surge speed, on |u|v.", "kg", "d_n_uv")
    surge_force_limit: float = propulsion_limit("surge force", "N")
    yaw_moment_limit: float = propulsion_limit("yaw moment", "N·m")
    steering_loss: float = steering_loss()
    steering_speed: float = steering_speed()
    as_printed: bool = parameter(False, "Divide the higher-order yaw damping by m11, as printed in (6), instead of by m33.")

    def coefficients(self) -> Vessel:
        """The coefficients by the symbols of `dynamics`, with the misprint included where `as_printed` is set."""
        s = schema.symbols(self)
        if self.as_printed:
            s |= {name: s["m33"] / s["m11"] * s[name] for name in ("d_r2", "d_r3")}
        s["m32"] = s["m32"] or s["m23"]
        determinant = s["m22"] * s["m33"] - s["m23"] * s["m32"]
        if not determinant > 0.0:
            raise ParameterError(_singular(self, s))
        inverse = {
            "i22": s["m33"] / determinant,
            "i23": -s["m23"] / determinant,
            "i32": -s["m32"] / determinant,
            "i33": s["m22"] / determinant,
        }
        return Vessel(**s, **inverse, coupled=any(s[name] for name in BEYOND_THE_PAPER), m_c=0.5 * (s["m23"] + s["m32"]))


def _singular(hull: VesselParameters, s: dict[str, float]) -> str:
    product, largest = s["m23"] * s["m32"], s["m22"] * s["m33"]
    return (
        f"vessel.sway_yaw_inertia·yaw_sway_inertia must be less than sway_inertia·yaw_inertia = {largest:g} kg²·m²"
        f" (got {hull.sway_yaw_inertia:g}·{s['m32']:g} = {product:g})"
    )


@dataclass(frozen=True)
class ShipParameters(Hull, VesselParameters):
    """The coefficients of the ship with its dimensions, which the waves use, and the speeds for which they hold."""

    draught: float = parameter(1.3, "Draught of the hull, for waves.", unit="m", low=1e-3, high=1e2)
    surge_speed_range: tuple[float, ...] = speed_range("surge velocity", "m/s")
    sway_speed_range: tuple[float, ...] = speed_range("sway velocity", "m/s")
    yaw_rate_range: tuple[float, ...] = speed_range("yaw rate", "rad/s")
    thrusters: ThrusterLayout = group(ThrusterLayout)
    power: PowerParameters = group(PowerParameters)


def initial_pose(default: tuple[float, float, float]) -> tuple[float, ...]:
    """Declare the initial pose of a ship."""
    return parameter(default, "Initial position x, y [m] and heading.", low=-1e6, high=1e6, length=3)


def initial_velocity() -> tuple[float, ...]:
    """Declare the initial velocity of a ship, zero by default."""
    return parameter((0.0, 0.0, 0.0), "Initial surge, sway and yaw velocity.", low=-1e3, high=1e3, length=3)


def divergence(what: str, time: float, cause: str, vessel: VesselParameters) -> SimulationError:
    """The error for a motion that is no longer finite, with what its ship has in common with the paper's ship.

    `time`: simulated time, s. `cause`: what may have caused it, with the inputs at that time.
    """
    remaining = inherited(vessel)
    message = f"the motion of the {what} is no longer finite at t = {time:g} s {cause}"
    return SimulationError(f"{message}; {remaining}" if remaining else message)


SHARES = ((1.0, 1e3), (0.3, 30.0), (0.1, 1.0), (0.03, 0.1), (0.01, 0.01))
"""Sampled boxes: shares of a declared range, and speeds [m/s] where none is declared, the largest first."""

HALF = 8  # samples of an axis in a box on each side of 0
ROUNDING = 1e-12  # a power is negative below this share of the sum of its terms' magnitudes
AXES = (
    ("surge", "surge_speed_range", "u", "m/s"),
    ("sway", "sway_speed_range", "v", "m/s"),
    ("yaw", "yaw_rate_range", "r", "rad/s"),
)
"""Name, parameter of the range, symbol and unit of each velocity."""


class Gain(NamedTuple):
    """The speeds at which damping adds energy fastest, and the rate -P/E at which it does, 1/s."""

    # u, v, r: velocities, m/s, m/s, rad/s
    u: float
    v: float
    r: float
    rate: float  # -P/E, 1/s
    unbounded: bool  # whether it also adds energy at the largest sampled speeds of a ship without declared ranges

    def __str__(self) -> str:
        return f"u = {self.u:.3g} m/s, v = {self.v:.3g} m/s, r = {self.r:.3g} rad/s"


def check_hull(ship: ShipParameters, owner: str = "vessel_sim") -> None:
    """Check the ranges of speeds and the damping of a hull. `owner`: the node that they belong to, for the error message."""
    for axis in AXES:
        _check_axis(ship, owner, *axis)
    gain = largest_gain(ship)
    if gain is not None and gain.unbounded:
        raise ParameterError(
            f"{owner}.vessel: the cross terms of the damping add energy without bound, as at {gain}: change them, or declare the"
            f" speeds for which they hold as {', '.join(name for _, name, _, _ in AXES)}"
        )


def _check_axis(ship: ShipParameters, owner: str, axis: str, name: str, symbol: str, unit: str) -> None:
    low, high = getattr(ship, name)
    if not low <= 0.0 <= high or low == high:
        raise ParameterError(f"{owner}.vessel.{name} must contain 0 and other speeds (got [{low:g}, {high:g}])")
    speed = negative_damping(ship, axis, max(-low, high))
    if speed is not None:
        raise ParameterError(
            f"{owner}.vessel.{axis}_damping with its quadratic and cubic terms adds energy from {symbol} = {speed:.3g} {unit}"
            f" on: make them non-negative, or declare the speeds for which they hold as {name}"
        )


def hull_warning(ship: ShipParameters) -> str:
    """A sentence on cross terms that add energy at some speeds; empty where damping takes energy at all speeds."""
    gain = largest_gain(ship)
    if gain is None:
        return ""
    return f"the damping of vessel adds energy at {gain}, at {gain.rate:.2g} 1/s: its cross terms outweigh the others there"


def negative_damping(ship: ShipParameters, axis: str, largest: float) -> float | None:
    """The speed from which on the damping of an axis is negative; None for an axis that always damps.

    `axis`: surge, sway or yaw. `largest`: largest speed of interest, in m/s or rad/s; infinite for none.
    """
    linear, quadratic, cubic = (float(getattr(ship, f"{axis}_damping{power}")) for power in ("", "_quadratic", "_cubic"))
    if linear >= 0.0 and quadratic >= 0.0 and cubic >= 0.0:
        return None
    # The damping linear + quadratic·a + cubic·a² changes its sign at its real positive roots only.
    roots = np.roots([cubic, quadratic, linear])  # which leaves out leading zeros
    positive = sorted(float(root.real) for root in roots if root.imag == 0.0 and root.real > 0.0)
    edges = [0.0, *(root for root in positive if root < largest), largest if math.isfinite(largest) else 1e9]
    for low, high in itertools.pairwise(edges):
        middle = 0.5 * (low + high)
        if linear + quadratic * middle + cubic * middle * middle < 0.0:
            return low
    return None


@functools.lru_cache(maxsize=64)
def largest_gain(ship: ShipParameters) -> Gain | None:
    """Sample the power of damping over the declared speeds, or over all up to 1000 m/s; None where it is never negative."""
    vessel = ship.coefficients()
    if not vessel.coupled:
        return None  # the power is the sum of those of the axes
    found, free = [], any(math.isinf(bound) for _, name, _, _ in AXES for bound in getattr(ship, name))
    for i, (u, v, r) in enumerate(_boxes(ship, vessel)):
        X, Y, N = damping_force(u, v, r, vessel)
        terms = np.array([u * X, v * Y, r * N])
        power, size = terms.sum(axis=0), np.abs(terms).sum(axis=0)
        energy = 0.5 * (vessel.m11 * u * u + vessel.m22 * v * v + vessel.m33 * r * r)
        rate = np.where(power < -ROUNDING * size, -power / np.maximum(energy, 1e-300), 0.0)
        k = int(np.argmax(rate))
        if rate[k] > 0.0:
            found.append(Gain(float(u[k]), float(v[k]), float(r[k]), float(rate[k]), free and i == 0))
    if not found:
        return None
    # The box of the largest speeds decides whether the gain has a bound; otherwise the fastest gain is the one to name.
    return found[0] if found[0].unbounded else max(found, key=lambda gain: gain.rate)


def _boxes(ship: ShipParameters, vessel: Vessel) -> Iterator[Array]:
    """Velocities on grids over boxes of decreasing size, shape (3, n)."""
    length = math.sqrt(vessel.m33 / vessel.m22)  # a radius of gyration: it makes a yaw rate of a speed
    for share, speed in SHARES:
        axes = []
        for (_, name, _, _), scale in zip(AXES, (speed, speed, speed / length), strict=True):
            low, high = (share * bound if math.isfinite(bound) else math.copysign(scale, bound) for bound in getattr(ship, name))
            axes.append(np.concatenate([np.linspace(low, 0.0, HALF + 1), np.linspace(0.0, high, HALF + 1)[1:]]))
        yield np.array(np.meshgrid(*axes, indexing="ij")).reshape(3, -1)


def bounded(ship: ShipParameters) -> bool:
    """Whether the hull data hold for some speeds only."""
    return any(math.isfinite(bound) for _, name, _, _ in AXES for bound in getattr(ship, name))


def outside(ship: ShipParameters, nu: Sequence[float]) -> str:
    """The first velocity that lies outside of its declared range, in words; empty if there is none.

    `nu`: u, v, r, relative to the water.
    """
    for (what, name, _, unit), value in zip(AXES, nu, strict=True):
        low, high = getattr(ship, name)
        if not low <= value <= high:
            kind = "rate" if what == "yaw" else "velocity"
            return f"a {what} {kind} of {value:.3g} {unit}, where the hull data hold from {low:g} to {high:g} {unit}"
    return ""
