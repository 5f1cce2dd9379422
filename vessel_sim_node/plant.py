"""The ship model: a surface vessel in three degrees of freedom (surge, sway, yaw) with two inputs, equations (6) and (7).

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
| f_u, f_v, f_r | unforced acceleration: Coriolis forces and damping | m/s², m/s², rad/s² | (7) |
| E, N | current, steady and uniform, east and north | m/s | not in the paper |
| u_c, v_c | the current in the body frame | m/s | not in the paper |

In a current the hydrodynamic forces, Coriolis force, Munk moment and damping, depend on the velocity relative to the water,
u - u_c and v - v_c. The state remains the velocity over ground. The current is constant in the earth-fixed frame, so in the body
frame du_c = r·v_c and dv_c = -r·u_c, and (6) becomes

    du = f_u(u - u_c, v - v_c, r) + r·v_c + tau_1/m11 + tau_uw
    dv = f_v(u - u_c, v - v_c, r) - r·u_c + tau_vw
    dr = f_r(u - u_c, v - v_c, r) + tau_2/m33 + tau_rw

Source: Trajectory tracking of underactuated surface vessels based on neural network and hierarchical sliding mode.
The printed f_r divides the higher-order yaw damping by m11; it is interpreted here as m33, the inertia of that equation. The
printed form is selected by `as_printed`, which is equivalent to d_r2 and d_r3 being m33/m11 times larger.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import SimulationError
from vessel_hsmc_ros.core.hull import Hull, NamedVessel, inherited
from vessel_hsmc_ros.core.kernel import kernel
from vessel_hsmc_ros.core.kinematics import Motion, as_motion
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.core.thruster_layout import ThrusterLayout

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


def inertia(default: float, description: str, unit: str, symbol: str, high: float = 1e12) -> float:
    """Declare an inertia, which must be positive; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=1e-3, high=high, symbol=symbol)


def damping(default: float, description: str, unit: str, symbol: str, high: float = 1e12) -> float:
    """Declare a non-negative damping coefficient; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=0.0, high=high, symbol=symbol)


def propulsion_limit(what: str, unit: str) -> float:
    """Declare the largest force or moment of the propulsion; there is no limit by default, as in the paper."""
    return parameter(math.inf, f"Largest {what} of the propulsion, in either direction.", unit=unit, low=1e-3, high=math.inf)


@dataclass(frozen=True)
class VesselParameters(NamedVessel):
    """The coefficients and limits of the ship; the defaults are the ship of the paper's section 6.2."""

    surge_inertia: float = inertia(120e3, "Mass with added mass in surge.", "kg", "m11")
    sway_inertia: float = inertia(177.9e3, "Mass with added mass in sway.", "kg", "m22")
    yaw_inertia: float = inertia(636e5, "Moment of inertia with added inertia in yaw.", "kg·m²", "m33", 1e15)
    surge_damping: float = damping(215e2, "Linear damping in surge.", "kg/s", "d_u")
    sway_damping: float = damping(147e3, "Linear damping in sway.", "kg/s", "d_v")
    yaw_damping: float = damping(802e4, "Linear damping in yaw.", "kg·m²/s", "d_r", 1e15)
    surge_damping_quadratic: float = damping(0.2 * 215e2, "Quadratic damping in surge, on |u|u.", "kg/m", "d_u2")
    surge_damping_cubic: float = damping(0.1 * 215e2, "Cubic damping in surge, on u³.", "kg·s/m²", "d_u3")
    sway_damping_quadratic: float = damping(0.2 * 147e3, "Quadratic damping in sway, on |v|v.", "kg/m", "d_v2")
    sway_damping_cubic: float = damping(0.1 * 147e3, "Cubic damping in sway, on v³.", "kg·s/m²", "d_v3")
    yaw_damping_quadratic: float = damping(0.2 * 802e4, "Quadratic damping in yaw, on |r|r.", "kg·m²", "d_r2", 1e15)
    yaw_damping_cubic: float = damping(0.1 * 802e4, "Cubic damping in yaw, on r³.", "kg·m²·s", "d_r3", 1e15)
    surge_force_limit: float = propulsion_limit("surge force", "N")
    yaw_moment_limit: float = propulsion_limit("yaw moment", "N·m")
    as_printed: bool = parameter(False, "Divide the higher-order yaw damping by m11, as printed in (6), instead of by m33.")

    def coefficients(self) -> Vessel:
        """The coefficients by the symbols of (6), with the misprint included where `as_printed` is set."""
        vessel = Vessel(**schema.symbols(self))
        if not self.as_printed:
            return vessel
        factor = vessel.m33 / vessel.m11
        return vessel._replace(d_r2=factor * vessel.d_r2, d_r3=factor * vessel.d_r3)


@dataclass(frozen=True)
class ShipParameters(Hull, VesselParameters):
    """The coefficients of the ship with its dimensions, which the waves use."""

    draught: float = parameter(1.3, "Draught of the hull, for waves.", unit="m", low=1e-3, high=1e2)
    thrusters: ThrusterLayout = group(ThrusterLayout)


def initial_pose(default: tuple[float, float, float]) -> tuple[float, ...]:
    """Declare the initial pose of a ship."""
    return parameter(default, "Initial position x, y [m] and heading.", low=-1e6, high=1e6, length=3)


def initial_velocity() -> tuple[float, ...]:
    """Declare the initial velocity of a ship, zero by default."""
    return parameter((0.0, 0.0, 0.0), "Initial surge, sway and yaw velocity.", low=-1e3, high=1e3, length=3)


@kernel
def unforced_acceleration(u: float, v: float, r: float, vessel: Vessel) -> tuple[float, float, float]:
    """f_u, f_v, f_r of (7): Coriolis, Munk moment and damping, without inputs and disturbances.

    Args:
        u, v, r: Body velocities, m/s, m/s, rad/s.
        vessel: Coefficients of (6).

    Returns:
        f_u [m/s²], f_v [m/s²], f_r [rad/s²].
    """
    s = vessel
    # Damping opposes the velocity: |u|u and u³ are odd functions, so that the sign of the velocity is kept.
    f_u = (s.m22 * v * r - s.d_u * u - s.d_u2 * abs(u) * u - s.d_u3 * u * u * u) / s.m11
    f_v = (-s.m11 * u * r - s.d_v * v - s.d_v2 * abs(v) * v - s.d_v3 * v * v * v) / s.m22
    # (m11 - m22)·u·v is the Munk moment, which turns a drifting hull broadside to the flow.
    f_r = ((s.m11 - s.m22) * u * v - s.d_r * r - s.d_r2 * abs(r) * r - s.d_r3 * r * r * r) / s.m33
    return f_u, f_v, f_r


def unforced_in_current(state: Array, vessel: Vessel, current: tuple[float, float] = STILL_WATER) -> tuple[float, float, float]:
    """The unforced acceleration of a ship in a current, including the rotation of the body frame; (7) in still water.

    Args:
        state: x, y, psi, u, v, r, shape (6,); velocities over ground.
        vessel: Coefficients of (6).
        current: E, N, m/s.

    Returns:
        f_u(u_r, v_r, r) + r·v_c [m/s²], f_v(u_r, v_r, r) - r·u_c [m/s²], f_r(u_r, v_r, r) [rad/s²].
    """
    return unforced(as_motion(state), vessel, current)


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
    tau, disturbing = (float(wrench[0]), float(wrench[1])), (float(disturbance[0]), float(disturbance[1]), float(disturbance[2]))
    return np.array(rate_of_motion(as_motion(state), tau, disturbing, vessel, current))


@kernel
def rate_of_motion(
    motion: Motion,
    tau: tuple[float, float],
    disturbance: tuple[float, float, float],
    vessel: Vessel,
    current: tuple[float, float],
) -> Motion:
    """`derivative` of a motion; the arguments are the same.

    Args:
        motion: State; velocities over ground.
        tau: tau_1, tau_2.
        disturbance: tau_uw, tau_vw, tau_rw.
        vessel: Coefficients of (6).
        current: E, N.

    Returns:
        Derivatives in the order of the state.
    """
    u, v, r = motion.u, motion.v, motion.r
    c, s = math.cos(motion.psi), math.sin(motion.psi)
    f_u, f_v, f_r = unforced(motion, vessel, current)
    return Motion(
        u * c - v * s,
        u * s + v * c,
        r,
        f_u + tau[0] / vessel.m11 + disturbance[0],
        # No input in sway: the ship is underactuated.
        f_v + disturbance[1],
        f_r + tau[1] / vessel.m33 + disturbance[2],
    )


def divergence(what: str, time: float, cause: str, vessel: VesselParameters) -> SimulationError:
    """The error for a motion that is no longer finite, with what its ship has in common with the paper's ship.

    Args:
        what: The ship.
        time: Simulated time, s.
        cause: What may have caused it, with the inputs at that time.
        vessel: The hull data.
    """
    remaining = inherited(vessel)
    message = f"the motion of the {what} is no longer finite at t = {time:g} s {cause}"
    return SimulationError(f"{message}; {remaining}" if remaining else message)


@kernel
def unforced(motion: Motion, vessel: Vessel, current: tuple[float, float]) -> tuple[float, float, float]:
    """`unforced_in_current` of a motion."""
    u_c = v_c = 0.0
    # In still water the forces do not wait for the cosine and sine.
    if current[0] != 0.0 or current[1] != 0.0:
        c, s = math.cos(motion.psi), math.sin(motion.psi)
        # The current in the body frame; the terms r·v_c and -r·u_c are its rates there.
        u_c, v_c = current[0] * c + current[1] * s, current[1] * c - current[0] * s
    f_u, f_v, f_r = unforced_acceleration(motion.u - u_c, motion.v - v_c, motion.r, vessel)
    return f_u + motion.r * v_c, f_v - motion.r * u_c, f_r
