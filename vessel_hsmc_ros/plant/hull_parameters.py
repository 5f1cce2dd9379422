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
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, SimulationError
from vessel_hsmc_ros.core.hull import Hull, NamedVessel, inherited, steering_loss, steering_speed
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.core.thruster_layout import ThrusterLayout

EFFICIENCY = 0.4  # eta: 0.5 of the propeller and 0.8 of motor and electronics, as is usual for small electric boats


@dataclass(frozen=True)
class PowerParameters:
    """What the vessel takes from its battery, for forecasts; nothing of it has a part in the motion."""

    full_thrust: float = parameter(
        0.0,
        "Electric power at full thrust, for forecasts; 0 estimates it from the top speed.",
        unit="W",
        low=0.0,
        high=1e9,
        symbol="P_1",
    )
    other: float = parameter(
        0.0,
        "Electric power of all else, such as computers and sensors, for forecasts.",
        unit="W",
        low=0.0,
        high=1e9,
        symbol="P_0",
    )
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


class Vessel(NamedTuple):
    """The coefficients of the ship by the symbols of `dynamics`, and what follows from them.

    Attributes:
        m11 .. d_n_ur: Inertia and damping; those up to d_r3 are the paper's.
    """

    m11: float
    m22: float
    m33: float
    d_u: float
    d_v: float
    d_r: float
    d_u2: float
    d_u3: float
    d_v2: float
    d_v3: float
    d_r2: float
    d_r3: float
    m23: float
    m32: float
    d_x_vv: float
    d_x_vr: float
    d_y_r: float
    d_y_rv: float
    d_y_vr: float
    d_y_rr: float
    d_y_uv: float
    d_y_ur: float
    d_n_v: float
    d_n_vv: float
    d_n_rv: float
    d_n_vr: float
    d_n_uv: float
    d_n_ur: float
    coupled: bool  # whether any coefficient beyond the paper's is not zero
    m_c: float  # (m23 + m32)/2, the coupling inertia of the Coriolis forces
    # i22, i23, i32, i33: the inverse of [m22 m23; m32 m33]
    i22: float
    i23: float
    i32: float
    i33: float


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
