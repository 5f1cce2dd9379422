"""The model of the observer: vessel dynamics in a current, with damping and disturbances as states, and the wave motion.

| symbol | meaning | unit |
|---|---|---|
| p, psi | low-frequency position and heading, without the wave motion | m, rad |
| nu = (u, v, r) | body velocities over ground | m/s, m/s, rad/s |
| u_r, v_r | body velocities through the water, (u, v) - R(psi)ᵀ·c | m/s |
| b | body-fixed disturbance: damping beyond d_1 to d_3, errors of the inertia | m/s², rad/s² |
| d_1, d_2, d_3 | linear damping of u_r, v_r, r, by its natural logarithm, so that it stays positive | 1/s |
| c_E, c_N | current, and what wind and wave drift do as if they were one | m/s |
| xi, dxi | states of the wave filter; dxi is the wave-frequency part of position and heading | s·m, s·rad; m, rad |
| omega_0, zeta | frequency and damping ratio of the wave filter | rad/s, - |
| tau_1, tau_2 | commanded wrench after the known limits, dead times, lags and rates | N, N·m |
| m11, m22, m_p | known inertia in surge and sway, and that which the yaw moment accelerates | kg, kg, kg·m² |
| x_p | distance of the known centre of percussion ahead of the origin | m |

The model is Newton's second law in the body-fixed frame, with the Coriolis forces and the Munk moment of the known inertia,

    dp = R(psi)·(u, v)   du = v·r  + k_u·v_r·r + tau_1/m11     - d_1·u_r + b_u      db, dc, d(ln d) = noise
    dpsi = r             dv = -u·r + k_v·u_r·r - x_p·tau_2/m_p - d_2·v_r + b_v
                         dr = k_r·u_r·v_r      + tau_2/m_p     - d_3·r   + b_r
    measured: p + dxi_p + noise, psi + dxi_psi + noise       ddxi = -omega_0²·xi - 2·zeta·omega_0·dxi + noise

with k_u = m22/m11 - 1, k_v = 1 - m11/m22, k_r = (m11 - m22)/m_p: the current is constant in the earth-fixed frame, so that the
rotation of the body frame acts on nu, and what added mass adds to it on the velocity through the water.

The states are in the order p, psi, u, v, r, b, ln d, c and, with waves, xi, dxi. The wrench that reaches the hull
follows from the commands by limit, dead time, lag and rate limit.

How the covariance of the observer's states goes from one time to the next, with the symbols of `observer_model`.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.actuators import dynamics
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.core.kernel import Array, clip, kernel
from vessel_hsmc_ros.core.schema import parameter
from vessel_hsmc_ros.core.timing import seconds


def tuning(default: float, description: str, unit: str) -> float:
    """Declare a standard deviation or noise intensity of the filter; the arguments are those of `parameter`."""
    return parameter(default, description, unit=unit, low=1e-9, high=1e6)


def walk(what: str, unit: str) -> float:
    """Declare the process noise of a state; -1, the default, derives it from the ship's inertia and limits."""
    return parameter(
        -1.0,
        f"Process noise of {what}: standard deviation of the change in one second; -1: derived from the vessel.",
        unit=unit,
        low=-1.0,
        high=1e6,
    )


def wave(what: str, unit: str) -> float:
    """Declare the standard deviation of the wave-frequency motion; -1, the default, derives it from period and length."""
    return parameter(
        -1.0,
        f"Standard deviation of the wave-frequency motion in {what}; -1: that of a fully developed sea of the wave period.",
        unit=unit,
        low=-1.0,
        high=1e6,
    )


def decay(what: str, symbol: str) -> float:
    """Declare the linear damping of a velocity; -1, the default, estimates it."""
    return parameter(-1.0, f"Decay rate of {what} without inputs; -1: estimated.", unit="1/s", low=-1.0, high=1e2, symbol=symbol)


@dataclass(frozen=True)
class ObserverParameters:
    """What the filter assumes of sensors, hull, disturbances and waves."""

    enabled: bool = parameter(False, "Give the law the state estimated from the measured pose instead of the measured state.")
    position_noise: float = tuning(0.5, "Standard deviation of a sample of x and of y.", "m")
    heading_noise: float = tuning(0.005, "Standard deviation of a sample of the heading.", "rad")
    surge_decay: float = decay("a surge velocity", "d_1")
    sway_decay: float = decay("a sway velocity", "d_2")
    yaw_decay: float = decay("a yaw rate", "d_3")
    actuator_lag: float = parameter(
        -1.0,
        "Time constant of the first-order lag of both actuators; -1: those declared of the vessel.",
        unit="s",
        low=-1.0,
        high=1e3,
        symbol="T_l",
    )
    velocity_walk: float = walk("surge and sway velocity", "m/s")
    yaw_rate_walk: float = walk("the yaw rate", "rad/s")
    force_walk: float = walk("the body-fixed disturbance", "m/s²")
    moment_walk: float = walk("the yaw disturbance", "rad/s²")
    current_walk: float = walk("the current, which stands for wind and wave drift too", "m/s")
    wave_period: float = parameter(
        0.0, "Peak period of the waves to filter out; 0 for no wave filter.", unit="s", low=0.0, high=60.0
    )
    wave_damping: float = parameter(0.1, "Damping ratio of the wave filter.", low=0.01, high=0.9)
    wave_position: float = wave("x and in y", "m")
    wave_heading: float = wave("heading", "rad")


PSI, U, V, R, BU, BV, BR, D1, D2, D3, CE, CN = range(2, 14)  # indices of the states after the position
XI, DXI = 14, 17  # indices of the first states of xi and dxi, three each


WIDEST = 20.0  # ln d is limited to this magnitude where it is used, so that its exponential stays finite
FASTEST, FASTEST_TURN = 100.0, 10.0
"""Largest estimated velocities, m/s and rad/s: measurements that jump about would otherwise drive the products of velocities in
the model to infinity."""


class Model(NamedTuple):
    """The constants of the model by its symbols, and whether it has waves."""

    k_u: float
    k_v: float
    k_r: float
    omega_0: float
    zeta: float
    waves: bool


def model(p: ObserverParameters, vessel: KnownVessel) -> Model:
    """The constants of the model; without waves omega_0 is 0."""
    waves = p.wave_period > 0.0
    omega_0 = 2.0 * math.pi / p.wave_period if waves else 0.0
    m11, m22 = vessel.surge_inertia, vessel.sway_inertia
    k_r = (m11 - m22) / vessel.as_controlled().yaw_inertia
    return Model(m22 / m11 - 1.0, 1.0 - m11 / m22, k_r, omega_0, p.wave_damping, waves)


@kernel
def through_water(x: Array) -> tuple[float, float]:
    """u_r and v_r."""
    u_c, v_c = rotated(-float(x[PSI]), float(x[CE]), float(x[CN]))
    return float(x[U]) - u_c, float(x[V]) - v_c


@kernel
def propagate(x: Array, surge: float, yaw: float, dt: float, m: Model) -> None:
    """Advance the states of the vessel model by dt, with b, d and c constant, and those of the wave filter; in place.

    The velocities are integrated in the earth-fixed frame, where the terms v·r and -u·r vanish: integrated by Euler steps in
    the body frame, they would add kinetic energy in a turn. `x`: states, shape (14,), with waves (20,). `surge`, `yaw`:
    accelerations by the wrench, tau_1/m11 [m/s²] and tau_2/m_p [rad/s²]. `dt`: time step, s.
    """
    psi, u, v, r = float(x[PSI]), float(x[U]), float(x[V]), float(x[R])
    u_r, v_r = through_water(x)
    decay_u, decay_v, decay_r = decays(x, dt)
    # decay/dt·velocity is the mean deceleration of an exponential decay over dt.
    turn = yaw + float(x[BR]) + m.k_r * u_r * v_r - decay_r / dt * r
    middle, end = psi + 0.5 * dt * r, psi + dt * r + 0.5 * dt * dt * turn
    east, north = rotated(psi, u, v)
    along = surge + float(x[BU]) + m.k_u * v_r * r - decay_u / dt * u_r
    aside = float(x[BV]) + m.k_v * u_r * r - decay_v / dt * v_r
    force_east, force_north = rotated(middle, along, aside)
    change_east, change_north = dt * force_east, dt * force_north
    x[0] += dt * (east + 0.5 * change_east)
    x[1] += dt * (north + 0.5 * change_north)
    x[PSI], x[R] = end, clip(r + dt * turn, FASTEST_TURN)
    # Back into the body frame at the new heading.
    along, aside = rotated(-end, east + change_east, north + change_north)
    x[U], x[V] = clip(along, FASTEST), clip(aside, FASTEST)
    if m.waves:
        a, b, c, d = wave_transition(dt, m)
        for i in range(3):
            xi, dxi = float(x[XI + i]), float(x[DXI + i])
            x[XI + i], x[DXI + i] = a * xi + b * dxi, c * xi + d * dxi


@kernel
def decays(x: Array, dt: float) -> tuple[float, float, float]:
    """Fractions by which linear damping reduces u_r, v_r and r within dt."""
    d_1, d_2 = math.exp(clip(float(x[D1]), WIDEST)), math.exp(clip(float(x[D2]), WIDEST))
    d_3 = math.exp(clip(float(x[D3]), WIDEST))
    return -math.expm1(-d_1 * dt), -math.expm1(-d_2 * dt), -math.expm1(-d_3 * dt)


@kernel
def rotated(angle: float, along: float, across: float) -> tuple[float, float]:
    """A horizontal vector rotated counter-clockwise."""
    c, s = math.cos(angle), math.sin(angle)
    return along * c - across * s, along * s + across * c


@kernel
def wave_transition(dt: float, m: Model) -> tuple[float, float, float, float]:
    """Transition matrix of the wave filter ddxi = -omega_0²·xi - 2·zeta·omega_0·dxi, in closed form.

    An Euler step would add energy to the oscillation. `dt`: time step, s. `m`: constants of the model, with zeta below 1.
    Returns matrix for (xi, dxi) of one component, shape (2, 2), row by row.
    """
    omega, decay = m.omega_0 * math.sqrt(1.0 - m.zeta * m.zeta), math.exp(-m.zeta * m.omega_0 * dt)
    c, s = decay * math.cos(omega * dt), decay * math.sin(omega * dt) / omega
    return c + m.zeta * m.omega_0 * s, s, -m.omega_0 * m.omega_0 * s, c - m.zeta * m.omega_0 * s


Wrench = tuple[float, float]

CAPACITY = 1024  # number of commands kept: 10 s at 100 Hz; of a longer one the oldest of them is taken


class Actuators(NamedTuple):
    """What is known of the actuators, in each field of the surge force and of the yaw moment."""

    limit: Wrench  # largest magnitude, N, N·m
    # dead_time, lag: s; 0 for none
    dead_time: Wrench
    lag: Wrench
    rate: Wrench  # largest rate of change, N/s, N·m/s


class Commands(NamedTuple):
    """The latest commands, written in place as a ring: when and what, shapes (n,) and (n, 2), and how many there were, (1,)."""

    at: NDArray[np.int64]
    wrench: Array
    number: NDArray[np.int64]


def actuators(p: ObserverParameters, vessel: KnownVessel) -> Actuators:
    """The actuators as the laws take them: declared, or assumed where nothing is."""
    surge, yaw = (each if p.actuator_lag < 0.0 else each._replace(lag=p.actuator_lag) for each in dynamics(vessel)[:2])
    return Actuators(
        (vessel.surge_force_limit, vessel.yaw_moment_limit),
        (surge.dead_time, yaw.dead_time),
        (surge.lag, yaw.lag),
        (surge.rate, yaw.rate),
    )


def no_commands() -> Commands:
    """An empty ring."""
    return Commands(np.zeros(CAPACITY, np.int64), np.zeros((CAPACITY, 2)), np.zeros(1, np.int64))


@kernel
def actuated(last: Wrench, stamp: int, command: Wrench, dt: float, ring: Commands, c: Actuators) -> Wrench:
    """The wrench at the end of dt.

    Args:
        last: The wrench at its beginning, N, N·m.
        stamp: Time of its beginning, ns.
        command: Wrench commanded then, N, N·m.
        dt: Time step, s.
        ring: The latest commands; written in place.
    """
    i = int(ring.number[0]) % len(ring.at)
    ring.at[i], ring.wrench[i, 0], ring.wrench[i, 1] = stamp, command[0], command[1]
    ring.number[0] += 1
    surge, yaw = effective(0, stamp, ring, c), effective(1, stamp, ring, c)
    return followed(0, last[0], surge, dt, c), followed(1, last[1], yaw, dt, c)


@kernel
def effective(j: int, stamp: int, ring: Commands, c: Actuators) -> float:
    """The command to input j that takes effect now: the latest that is at least a dead time old; 0 before the first one.

    `j`: 0 for the surge force, 1 for the yaw moment. `stamp`: present time, ns.
    """
    n, count = len(ring.at), int(ring.number[0])
    for k in range(min(n, count)):
        i = (count - 1 - k) % n
        if seconds(stamp - int(ring.at[i])) >= c.dead_time[j]:
            return float(ring.wrench[i, j])
    return float(ring.wrench[count % n, j]) if count >= n else 0.0


@kernel
def followed(j: int, last: float, command: float, dt: float, c: Actuators) -> float:
    """Input j at the end of dt, by a first-order lag of limited rate towards the limited command.

    `j`: 0 for the surge force, 1 for the yaw moment. `last`: the input at the beginning, N or N·m. `command`: the command, N or
    N·m. `dt`: time step, s.
    """
    goal = clip(command, c.limit[j])
    if c.lag[j] == 0.0 and not math.isfinite(c.rate[j]):
        return goal
    change = goal - last if c.lag[j] == 0.0 else -math.expm1(-dt / c.lag[j]) * (goal - last)
    if math.isfinite(c.rate[j]):
        change = clip(change, c.rate[j] * dt)
    return last + change


class Jacobian(NamedTuple):
    """The elements of G = F - I, where F is the Jacobian of `propagate`, to first order in dt.

    A name such as u_psi is the derivative of the change of u with respect to psi.
    """

    dt: float  # time step, s
    # c, s: dt·cos psi and dt·sin psi at the middle of the step
    c: float
    s: float
    # decay_u, decay_v, decay_r: fractions by which damping reduces u_r, v_r and r
    decay_u: float
    decay_v: float
    decay_r: float
    x_psi: float
    y_psi: float
    u_psi: float
    u_v: float
    u_r: float
    u_d: float
    u_ce: float
    u_cn: float
    v_psi: float
    v_u: float
    v_r: float
    v_d: float
    v_ce: float
    v_cn: float
    r_psi: float
    r_u: float
    r_v: float
    r_d: float
    r_ce: float
    r_cn: float


@kernel
def jacobian(x: Array, dt: float, m: Model) -> Jacobian:
    """The Jacobian of `propagate` at the states x before the step."""
    u, v, r = float(x[U]), float(x[V]), float(x[R])
    u_r, v_r = through_water(x)
    u_c, v_c, turn = u - u_r, v - v_r, dt * r
    middle = float(x[PSI]) + 0.5 * turn
    c, s = dt * math.cos(middle), dt * math.sin(middle)
    decay_u, decay_v, decay_r = decays(x, dt)
    loss_u, loss_v, k_u, k_v, k_r = decay_u / dt, decay_v / dt, m.k_u * r, m.k_v * r, m.k_r
    return Jacobian(
        dt,
        c,
        s,
        decay_u,
        decay_v,
        decay_r,
        -u * s - v * c,
        u * c - v * s,
        decay_u * v_c + dt * k_u * u_c,
        turn + dt * k_u,
        dt * (v + m.k_u * v_r),
        -decay_u * u_r,
        loss_u * c + k_u * s,
        loss_u * s - k_u * c,
        -decay_v * u_c - dt * k_v * v_c,
        dt * k_v - turn,
        dt * (m.k_v * u_r - u),
        -decay_v * v_r,
        -loss_v * s - k_v * c,
        loss_v * c - k_v * s,
        dt * k_r * (u_r * u_c - v_r * v_c),
        dt * k_r * v_r,
        dt * k_r * u_r,
        -decay_r * r,
        k_r * (u_r * s - v_r * c),
        -k_r * (u_r * c + v_r * s),
    )


@kernel
def change(M: Array, g: Jacobian) -> Array:
    """G·M for a matrix M with one row a state: the first six rows, because the others are zero."""
    psi, u, v, r, c_e, c_n = M[PSI], M[U], M[V], M[R], M[CE], M[CN]
    rows = np.empty((BU, M.shape[1]))
    rows[0] = g.x_psi * psi + g.c * u - g.s * v
    rows[1] = g.y_psi * psi + g.s * u + g.c * v
    rows[PSI] = g.dt * r
    own = g.u_psi * psi - g.decay_u * u + g.u_v * v + g.u_r * r + g.u_d * M[D1] + g.u_ce * c_e + g.u_cn * c_n
    rows[U] = own + g.dt * M[BU]
    own = g.v_psi * psi + g.v_u * u - g.decay_v * v + g.v_r * r + g.v_d * M[D2] + g.v_ce * c_e + g.v_cn * c_n
    rows[V] = own + g.dt * M[BV]
    own = g.r_psi * psi + g.r_u * u + g.r_v * v - g.decay_r * r + g.r_d * M[D3] + g.r_ce * c_e + g.r_cn * c_n
    rows[R] = own + g.dt * M[BR]
    return rows


@kernel
def pass_waves(M: Array, dt: float, m: Model) -> None:
    """M <- F·M in place for the rows of xi and dxi, from `wave_transition`."""
    a, b, c, d = wave_transition(dt, m)
    xi = a * M[XI:DXI] + b * M[DXI:]
    M[DXI:] = c * M[XI:DXI] + d * M[DXI:]
    M[XI:DXI] = xi


@kernel
def propagate_covariance(x: Array, P: Array, dt: float, m: Model) -> None:
    """P <- F·P·Fᵀ in place, with the Jacobian F of `propagate` at x. `P`: their covariance, symmetric."""
    if m.waves:
        pass_waves(P, dt, m)
        pass_waves(P.T, dt, m)
    # Most elements of F are those of the unit matrix: with F = I + G, F·P·Fᵀ = P + G·P + (G·P)ᵀ + G·(G·P)ᵀ.
    g = jacobian(x, dt, m)
    rows = change(P, g)
    P[:BU] += rows
    P[:, :BU] += rows.T
    P[:BU, :BU] += change(rows.T, g)
