"""The parameters of the guided law, dimensionless, and its constants for a ship.

| symbol | meaning | unit |
|---|---|---|
| L, T | length of the hull; time of the ship's turns, sqrt(m33/tau_2max) | m, s |
| q | stretch of the controller's unit of time for slow actuators | - |
| T_r, T_d, T_f | lag that remains with the lead against it, dead time, time from zero to the limit | s |
| h | control period in units of T | - |
| i | share of the yaw acceleration that braking curves use, in terms of turn_share | - |

Lengths are in units of L, times in units of T, forces as accelerations of the declared inertia: for the law every ship is of
length 1 with a largest yaw acceleration of 1. The controller reckons in the time q·T with

    q = 1 + max(T_r + T_d + T_f/10)/T,   i = 1/(1 + (T_f/(q·T·1.2))²)

because a loop through slow actuators must be slower, and a moment that rises slowly must begin to fall early. The numbers were
searched on drawn ships; docs/guided.md states on which.

The linear-quadratic regulator of a ship's distance from its track, heading, sway velocity and yaw rate.

| symbol | meaning | unit |
|---|---|---|
| e | distance of the ship to port of its track | L |
| psi, v, r | heading, sway velocity and yaw rate beyond those of the track | rad, L/T, 1/T |
| W | speed through the water | L/T |
| a, kappa | decay rate of the sway, and its growth per surge velocity and yaw rate | 1/T, - |
| e_0, r_0 | what is worth the full yaw moment; e_0 at least | L, 1/T |

    de = W·psi + v,   dpsi = r,   dv = -a·v - kappa·W·r,   dr = alpha,   minimise the integral of (e/e_0)² + (r/r_0)² + alpha²

From alpha to e this hull has a zero at -a/(1 - kappa): where kappa > 1 its course is non-minimum phase, and no gain can make it
faster than that zero. Where lateral damping has its centre x_d behind the pivot, kappa is less by a·x_d/W. The Riccati equation
knows it; with instant actuators its loop has an infinite gain margin and a phase margin of 60 degrees (R. E. Kalman,
When is a linear control system optimal?, Journal of Basic Engineering 86, 1964).
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from vessel_hsmc_ros.control.guided.guidance import Gains
from vessel_hsmc_ros.control.interface.actuators import channel, dynamics, unit_time
from vessel_hsmc_ros.control.interface.known_vessel import ControlledVessel, KnownVessel
from vessel_hsmc_ros.core.kernel import Array, between, kernel
from vessel_hsmc_ros.core.kinematics import GRAVITY
from vessel_hsmc_ros.core.schema import parameter

SPEEDS = 0.08, 0.12, 0.18, 0.27, 0.4, 0.6, 0.9, 1.35, 2.0
DECAYS = 0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 12.8
RATIOS = -2.0, -1.0, -0.4, 0.0, 0.3, 0.5, 0.7, 0.85, 1.0, 1.1, 1.2, 1.35, 1.6  # the grid of W, a and kappa
LARGEST_HEADING_GAIN = 20.0  # largest K_psi, 1/T²: a faster loop answers to the unmodelled more than to its errors


def regulator(W: ArrayLike, a: ArrayLike, kappa: ArrayLike, e_0: ArrayLike, r_0: float) -> Array:
    """The gains K of alpha = -K·(e, psi, v, r), shape (..., 4), from the stable subspaces of the Hamiltonian matrices."""
    W, a, kappa, e_0 = np.broadcast_arrays(*map(np.asarray, (W, a, kappa, e_0)))
    H = np.zeros((*W.shape, 8, 8))
    H[..., 0, 1], H[..., 0, 2], H[..., 1, 3], H[..., 2, 2], H[..., 2, 3] = W, 1.0, 1.0, -a, -kappa * W
    H[..., 4:, 4:] = -np.swapaxes(H[..., :4, :4], -1, -2)
    H[..., 3, 7], H[..., 4, 0], H[..., 7, 3] = -1.0, -1.0 / e_0**2, -1.0 / r_0**2
    values, vectors = np.linalg.eig(H)
    stable = np.take_along_axis(vectors, np.argsort(values.real)[..., None, :4], axis=-1)
    P = np.real(stable[..., 4:, :] @ np.linalg.inv(stable[..., :4, :]))
    return np.ascontiguousarray(P[..., 3, :])


def bounded(W: ArrayLike, a: ArrayLike, kappa: ArrayLike, e_0: float, r_0: float) -> Array:
    """The gains K, shape (..., 4), of the least e_0, in steps of a quarter, at which K_psi is at most LARGEST_HEADING_GAIN.

    At speed the track is worth less, because K_psi grows with it: K_e = 1/e_0 whatever W, a and kappa.
    """
    K = regulator(W, a, kappa, e_0, r_0)
    W, a, kappa = np.broadcast_arrays(W, a, kappa)
    while (large := K[..., 1] > LARGEST_HEADING_GAIN).any():
        e_0 *= 1.25
        K[large] = regulator(W[large], a[large], kappa[large], e_0, r_0)
    return K


@lru_cache(maxsize=16)
def table(e_0: float, r_0: float) -> Array:
    """The gains on the grid, shape (9, 9, 13, 4); they are the same for every ship with the same e_0."""
    found = bounded(*np.meshgrid(SPEEDS, DECAYS, RATIOS, indexing="ij"), e_0, r_0)
    found.flags.writeable = False
    return found


@kernel
def place(value: float, nodes: tuple[float, ...]) -> tuple[int, float]:
    """The node below a value, and the share of the way to the next one; values outside count as the first or last node."""
    i = 0
    while i < len(nodes) - 2 and value >= nodes[i + 1]:
        i += 1
    return i, between((value - nodes[i]) / (nodes[i + 1] - nodes[i]), 0.0, 1.0)


@kernel
def interpolate(W: float, a: float, kappa: float, t: Array, K: Array) -> None:
    """The gains between the nodes of the grid, trilinear, written to K, shape (4,)."""
    i, p = place(W, SPEEDS)
    j, q = place(a, DECAYS)
    k, s = place(kappa, RATIOS)
    for n in range(4):
        K[n] = 0.0
    for di in range(2):
        for dj in range(2):
            for dk in range(2):
                share = (p if di else 1.0 - p) * (q if dj else 1.0 - q) * (s if dk else 1.0 - s)
                for n in range(4):
                    K[n] += share * t[i + di, j + dj, k + dk, n]


RISE, RISING, FALLING = 0.1, 1.2, 0.5
"""Share of T_f in the stretch q, T_f in q·T at which braking curves use half of turn_share, and share of T_f in which the moment
is to fall to zero: with all of it turns would be slower than they have to be where T_f is only assumed."""

ASSUMED_FULL = 2.0  # T_f in T where not all of the actuators is declared, for braking curves alone
POSE_FILTER = 6.9, 13.8  # bandwidths of the correction of position and heading, 1/T
FROUDE = 0.06  # speed of the reference, as a Froude number, at which half of the way from the origin to the pivot is controlled
TURN_FILTER = 16.0  # bandwidth of the turns that are fed forward, 1/T
LOOSE, FAR_AHEAD = 2.0, 0.1
"""Factor by which the loops are looser where not all of the actuators is declared, or the pivot, about which turns move the
origin, is so far ahead of it, L."""

IDENTIFIED = 0.5  # doubt about identified actuators: they are those of the nearest model of a bank, and found by turns alone
FIRST_DOUBT = 0.05, 0.02, 0.1  # standard deviations of f_u, f_v and f_r at the start, in L/T² and 1/T²
FIRST_SHARE = 0.3
"""Share of the standard deviations of what lasts, at the start: an observer that has just begun gives wrong velocities."""

CENTRE, PIVOT_DOUBT = 0.5, 1.5
"""Distance of the centre of lateral damping behind the pivot in terms of x_p: half of it is midway between pivot and origin; and
what the doubt of that adds to the standard deviation of kappa, per x_p in L."""

RATIO_DOUBT, DECLARED_DOUBT = 0.1, 0.3  # standard deviations of kappa, and of the logarithm of a declared decay of the sway


def number(default: float, description: str, unit: str, symbol: str, high: float = 100.0) -> float:
    """Declare a positive dimensionless number; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=1e-4, high=high, symbol=symbol, tunable=True)


@dataclass(frozen=True)
class GuidedParameters:
    """Numbers of the law in units of the ship's length L and of the time T of its turns."""

    cross_track: float = number(0.04, "Distance from the track that is worth the full yaw moment.", "L", "e_0")
    turn_rate: float = number(0.4, "Error of the yaw rate that is worth the full yaw moment.", "1/T", "r_0")
    position_gain: float = number(1.5, "Approach speed per position error.", "1/T", "k_p")
    approach_speed: float = number(0.5, "Largest approach speed.", "L/T", "v_max")
    approach_braking: float = number(0.08, "Deceleration of the approach.", "L/T²", "a_p")
    integral_gain: float = number(0.11, "Integral gain on the position error.", "1/T²", "k_i")
    surge_gain: float = number(4.0, "Surge acceleration per error of the surge velocity.", "1/T", "k_u")
    approach_angle: float = number(0.8, "Largest angle at which a track is approached.", "rad", "theta", math.pi / 2)
    turn_share: float = number(
        0.4, "Share of the largest yaw acceleration that braking curves use, of instant actuators.", "", "a_s", 1.0
    )
    velocity_noise: float = number(0.007, "Standard deviation of measured velocities over T/20.", "L/T", "n_u")
    yaw_rate_noise: float = number(0.01, "Standard deviation of measured yaw rates over T/20.", "1/T", "n_r")
    surge_walk: float = number(0.23, "Change of the surge disturbance in T, as a standard deviation.", "L/T²", "q_u")
    sway_walk: float = number(0.005, "Change of the sway disturbance in T, as a standard deviation.", "L/T²", "q_v")
    yaw_walk: float = number(0.2, "Change of the yaw disturbance in T, as a standard deviation.", "1/T²", "q_r")
    sway_decay: float = number(2.0, "Decay rate of the sway where it is not declared.", "1/T", "a_0")
    sway_doubt: float = number(1.4, "Standard deviation of its natural logarithm.", "", "s_a")
    surge_decay_doubt: float = number(0.7, "Decay rate of the surge velocity, expected and its standard deviation.", "1/T", "s_b")
    current_doubt: float = number(0.03, "Standard deviation of each component of a current.", "sqrt(g·L)", "s_c")
    return_rate: float = number(
        0.02, "Rate at which sway damping and current, unobserved, return to what was expected.", "1/T", "w_0"
    )
    actuator_identification: bool = parameter(
        True,
        "Whether lag, dead time and rate of the actuators are identified while the ship turns, and replace the declared"
        " ones where these do not explain its motion.",
    )


def gains(p: GuidedParameters, vessel: KnownVessel, period: float, identified: bool = False) -> Gains:
    """The constants of the law for a ship, whose actuators may be those that were identified, and a control period, s."""
    T, L, inputs = unit_time(vessel), vessel.length, dynamics(vessel)
    both = inputs.surge, inputs.yaw
    q = 1.0 + max(each.remaining + each.dead_time + RISE * each.full for each in both) / T
    least = 0.0 if inputs.declared else ASSUMED_FULL
    fall = FALLING * max(least, inputs.yaw.full / T)
    early = 1.0 / (1.0 + (max(least, *(each.full / T for each in both)) / (q * RISING)) ** 2)
    units = vessel.surge_inertia * L / T**2, vessel.yaw_inertia / T**2
    limits = vessel.surge_force_limit, vessel.yaw_moment_limit
    surge, yaw = (
        channel(limit / unit, each.lag, each.remaining, each.rate / unit, each.dead_time, period)
        for each, limit, unit in zip(both, limits, units, strict=True)
    )
    h = period / T
    doubt = min(max(pivot(vessel), 0.0) / FAR_AHEAD, 1.0) if inputs.declared else 1.0
    p = loosened(p, max(doubt, IDENTIFIED) if identified else doubt)
    return Gains(
        L=L, T=T, force=units[0], moment=units[1], h=h,
        x_p=pivot(vessel), x_d=CENTRE * pivot(vessel), U_s=FROUDE * math.sqrt(GRAVITY * L) * T / L,
        k_p=p.position_gain / q**2, v_max=p.approach_speed / q, a_p=p.approach_braking / q**2,
        k_i=p.integral_gain / q**2, k_u=p.surge_gain / q, theta=p.approach_angle, q=q,
        a_max=p.turn_share * early, r_max=(0.4 + early) / q, a_r=1.0 / fall if fall > 0.0 else math.inf,
        R_u=p.velocity_noise**2 * 0.05 / h, R_r=p.yaw_rate_noise**2 * 0.05 / h, **prior(p, vessel, T),  # type: ignore[arg-type]
        z_p=math.exp(-POSE_FILTER[0] * h), z_h=math.exp(-POSE_FILTER[1] * h), step_f=-math.expm1(-TURN_FILTER * h / q),
        surge=surge, yaw=yaw, table=table(p.cross_track, p.turn_rate),
    )  # fmt: skip


def loosened(p: GuidedParameters, doubt: float) -> GuidedParameters:
    """The numbers for a ship of whose actuators, or turns, as much is in doubt, from 0 to 1: each loop is slower."""
    loose = 1.0 + (LOOSE - 1.0) * doubt
    return replace(
        p,
        cross_track=p.cross_track * loose,
        turn_rate=p.turn_rate * math.sqrt(loose),
        position_gain=p.position_gain / math.sqrt(loose),
        surge_walk=p.surge_walk / loose,
        velocity_noise=p.velocity_noise * loose,
    )


def pivot(vessel: KnownVessel) -> float:
    """The distance x_p of the pivot ahead of the origin, in L."""
    return vessel.ahead / vessel.length if isinstance(vessel, ControlledVessel) else 0.0


def prior(p: GuidedParameters, vessel: KnownVessel, T: float) -> dict[str, Array | float]:
    """What the filter expects of a ship: m, x_0, P_0, Q and w_0 of `Gains`.

    A state that is expected with the standard deviation s and returns to that at the rate w_0 has the noise Q = 2·w_0·s².
    """
    ratio = vessel.coriolis_ratio if vessel.coriolis_ratio >= 0.0 else min(vessel.surge_inertia / vessel.sway_inertia, 1.1)
    declared = vessel.sway_damping_rate >= 0.0
    decay = vessel.sway_damping_rate * T if declared else p.sway_decay
    current = p.current_doubt * math.sqrt(GRAVITY * vessel.length) * T / vessel.length
    coupling = RATIO_DOUBT + PIVOT_DOUBT * pivot(vessel)
    lasting = DECLARED_DOUBT if declared else p.sway_doubt, coupling, p.surge_decay_doubt, current, current
    walks = p.surge_walk, p.sway_walk, p.yaw_walk
    return {
        "m": 1.0 / ratio,
        "x_0": np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, math.log(max(decay, 1e-3)), ratio, p.surge_decay_doubt, 0.0, 0.0]),
        "P_0": np.square(
            [p.velocity_noise, p.velocity_noise, p.yaw_rate_noise, *FIRST_DOUBT, *(FIRST_SHARE * s for s in lasting)]
        ),
        "Q": np.array([1e-5, 1e-6, 1e-5, *(w * w for w in walks), *(2.0 * p.return_rate * s * s for s in lasting)]),
        "w_0": p.return_rate,
    }
