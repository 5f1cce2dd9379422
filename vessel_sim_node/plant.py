"""The ship: a surface vessel in three degrees of freedom with two inputs, equations (6) and (7).

| symbol | meaning | unit | equation |
|---|---|---|---|
| x, y | position in the earth-fixed frame | m | (6) |
| psi | heading, counter-clockwise from x | rad | (6) |
| u, v, r | surge, sway and yaw velocity in the body frame | m/s, m/s, rad/s | (6) |
| tau_1, tau_2 | surge force and yaw moment, the two inputs | N, N·m | (6) |
| m11, m22 | mass with added mass, surge and sway | kg | (6) |
| m33 | moment of inertia with added inertia, yaw | kg·m² | (6) |
| d_u, d_v, d_r | linear damping | kg/s, kg/s, kg·m²/s | (6) |
| d_u2 .. d_r3 | quadratic and cubic damping | per power of the velocity | (6) |
| tau_uw, tau_vw, tau_rw | disturbances, as accelerations | m/s², m/s², rad/s² | (6) |
| f_u, f_v, f_r | acceleration from the ship's own motion | m/s², m/s², rad/s² | (7) |
| E, N | current, steady and uniform, east and north | m/s | not in the paper |
| u_c, v_c | the current seen from the ship, in the body frame | m/s | not in the paper |

In a current the hull feels the water: Coriolis, Munk moment and damping act on the velocity relative to it, u - u_c and v - v_c.
The state stays the velocity over ground. The frame turns under the current, so du_c = r·v_c and dv_c = -r·u_c, and (6) becomes

    du = f_u(u - u_c, v - v_c, r) + r·v_c + tau_1/m11 + tau_uw
    dv = f_v(u - u_c, v - v_c, r) - r·u_c + tau_vw
    dr = f_r(u - u_c, v - v_c, r) + tau_2/m33 + tau_rw

Source: Trajectory tracking of underactuated surface vessels based on neural network and hierarchical sliding mode.
The printed f_r divides the higher-order yaw damping by m11; it is read here as m33, the inertia of that equation. The print
stays selectable: `as_printed` makes d_r2 and d_r3 m33/m11 times larger, which is the same.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.schema import parameter

Array = NDArray[np.float64]

STILL_WATER = (0.0, 0.0)


class Vessel(NamedTuple):
    """The coefficients of (6), by the paper's symbols."""

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


@dataclass(frozen=True)
class VesselParameters:
    """The ship's data; defaults are the ship of the paper's section 6.2."""

    surge_inertia: float = parameter(120e3, "Mass with added mass in surge.", unit="kg", low=1e-3, high=1e12, symbol="m11")
    sway_inertia: float = parameter(177.9e3, "Mass with added mass in sway.", unit="kg", low=1e-3, high=1e12, symbol="m22")
    yaw_inertia: float = parameter(
        636e5, "Moment of inertia with added inertia in yaw.", unit="kg·m²", low=1e-3, high=1e15, symbol="m33"
    )
    surge_damping: float = parameter(215e2, "Linear damping in surge.", unit="kg/s", low=0.0, high=1e12, symbol="d_u")
    sway_damping: float = parameter(147e3, "Linear damping in sway.", unit="kg/s", low=0.0, high=1e12, symbol="d_v")
    yaw_damping: float = parameter(802e4, "Linear damping in yaw.", unit="kg·m²/s", low=0.0, high=1e15, symbol="d_r")
    surge_damping_quadratic: float = parameter(
        0.2 * 215e2, "Damping in surge with |u|u.", unit="kg/m", low=0.0, high=1e12, symbol="d_u2"
    )
    surge_damping_cubic: float = parameter(
        0.1 * 215e2, "Damping in surge with u³.", unit="kg·s/m²", low=0.0, high=1e12, symbol="d_u3"
    )
    sway_damping_quadratic: float = parameter(
        0.2 * 147e3, "Damping in sway with |v|v.", unit="kg/m", low=0.0, high=1e12, symbol="d_v2"
    )
    sway_damping_cubic: float = parameter(
        0.1 * 147e3, "Damping in sway with v³.", unit="kg·s/m²", low=0.0, high=1e12, symbol="d_v3"
    )
    yaw_damping_quadratic: float = parameter(
        0.2 * 802e4, "Damping in yaw with |r|r.", unit="kg·m²", low=0.0, high=1e15, symbol="d_r2"
    )
    yaw_damping_cubic: float = parameter(
        0.1 * 802e4, "Damping in yaw with r³.", unit="kg·m²·s", low=0.0, high=1e15, symbol="d_r3"
    )
    as_printed: bool = parameter(False, "Divide the higher-order yaw damping by m11, as the printed (6) does, instead of by m33.")

    def coefficients(self) -> Vessel:
        """The same data by the symbols of (6), the misprint turned into coefficients where it is asked for."""
        vessel = Vessel(**schema.symbols(self))
        if not self.as_printed:
            return vessel
        factor = vessel.m33 / vessel.m11
        return vessel._replace(d_r2=factor * vessel.d_r2, d_r3=factor * vessel.d_r3)


def unforced_acceleration(u: float, v: float, r: float, vessel: Vessel) -> tuple[float, float, float]:
    """f_u, f_v, f_r of (7): Coriolis, Munk moment and damping, without inputs and disturbances.

    Args:
        u, v, r: Body velocities, m/s, m/s, rad/s.
        vessel: Coefficients of (6).

    Returns:
        f_u [m/s²], f_v [m/s²], f_r [rad/s²].
    """
    s = vessel
    f_u = (s.m22 * v * r - s.d_u * u - s.d_u2 * abs(u) * u - s.d_u3 * u * u * u) / s.m11
    f_v = (-s.m11 * u * r - s.d_v * v - s.d_v2 * abs(v) * v - s.d_v3 * v * v * v) / s.m22
    f_r = ((s.m11 - s.m22) * u * v - s.d_r * r - s.d_r2 * abs(r) * r - s.d_r3 * r * r * r) / s.m33
    return f_u, f_v, f_r


def unforced_in_current(state: Array, vessel: Vessel, current: tuple[float, float] = STILL_WATER) -> tuple[float, float, float]:
    """f_u, f_v, f_r of a ship in a current, with the terms of the frame that turns under it; (7) in still water.

    Args:
        state: x, y, psi, u, v, r, shape (6,).
        vessel: Coefficients of (6).
        current: E, N, m/s.

    Returns:
        f_u(u_r, v_r, r) + r·v_c [m/s²], f_v(u_r, v_r, r) - r·u_c [m/s²], f_r(u_r, v_r, r) [rad/s²].
    """
    psi, u, v, r = float(state[2]), float(state[3]), float(state[4]), float(state[5])
    c, s = math.cos(psi), math.sin(psi)
    u_c, v_c = current[0] * c + current[1] * s, current[1] * c - current[0] * s
    f_u, f_v, f_r = unforced_acceleration(u - u_c, v - v_c, r, vessel)
    return f_u + r * v_c, f_v - r * u_c, f_r


def derivative(state: Array, wrench: Any, disturbance: Any, vessel: Vessel, current: tuple[float, float] = STILL_WATER) -> Array:
    """The time derivative of the state, (6).

    Args:
        state: x, y, psi, u, v, r, shape (6,); velocities over ground.
        wrench: tau_1 [N], tau_2 [N·m], shape (2,).
        disturbance: tau_uw [m/s²], tau_vw [m/s²], tau_rw [rad/s²], shape (3,).
        vessel: Coefficients of (6).
        current: E, N, m/s.

    Returns:
        Derivatives in the order of the state, shape (6,).
    """
    psi, u, v, r = float(state[2]), float(state[3]), float(state[4]), float(state[5])
    f_u, f_v, f_r = unforced_in_current(state, vessel, current)
    c, s = math.cos(psi), math.sin(psi)
    return np.array(
        [
            u * c - v * s,
            u * s + v * c,
            r,
            f_u + wrench[0] / vessel.m11 + disturbance[0],
            f_v + disturbance[1],
            f_r + wrench[1] / vessel.m33 + disturbance[2],
        ]
    )
