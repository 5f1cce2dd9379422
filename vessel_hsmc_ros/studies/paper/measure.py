"""Measure the numbers to which the claims of the paper refer, and predict a run by its reduced dynamics.

S1 = 0 and S2 = 0 are two linear equations for the surge and the yaw velocity,

    (b - a·z1)·r = b·(r_d - c2·z3e) - a·(c1·z2e + v - dz2d)
    u = dz1d - c3·z1e - z2·r

so position, heading and sway velocity remain as states of (6), without an input. With the printed weights, b/a = 1e5, the first
equation is dz3e = -c2·z3e up to a relative error of 1e-5: the heading converges to its reference, and so does z1e; then
u = u_d - r_d·z2e and, to first order in z2e and with r = r_d,

    ddz2e + (d_v/m22)·dz2e - (m11/m22)·r²·z2e = tau_vw

which is marginally stable on a straight line and unstable in every turn, and in which a constant disturbance lets
the error grow without bound.

| symbol | meaning | unit | equation |
|---|---|---|---|
| z1e, z2e, z3e | tracking errors | m, m, rad | (11) |
| a, b, c1, c2, c3 | weights and slopes of the surfaces | - | (12), (17), (20), (23) |
| u, v, r | velocities of the ship | m/s, m/s, rad/s | (6) |
| tau_vw | disturbance in sway | m/s² | (6) |
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.network import NetworkParameters, activations
from vessel_hsmc_ros.control.laws.hierarchical_parameters import Gains
from vessel_hsmc_ros.control.laws.hierarchical_printed import HierarchicalPrintedParameters
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import GRAVITY, Motion, tracking_error, transform, transform_rate
from vessel_hsmc_ros.core.metrics import Run, heading_error, position_error, rms
from vessel_hsmc_ros.plant.dynamics import Vessel, unforced_acceleration
from vessel_hsmc_ros.studies.paper.cases import NAN, Numbers

ON_SURFACES, STRIDE = 20.0, 10
"""Time from which a run is compared with the reduced dynamics, s, and half the step of the comparison in samples."""

RUNAWAY = 1e6  # a position, heading or velocity beyond this is not physical


class Surfaces(NamedTuple):
    """The constants of both surfaces, by the paper's symbols: slopes c1, c2, c3 and weights a, b."""

    c1: float
    c2: float
    c3: float
    a: float
    b: float


def on_surfaces(x: float, y: float, psi: float, v: float, desired: Motion, g: Surfaces) -> tuple[float, float, float]:
    """Velocities that keep S1 = S2 = 0, and the lateral error. Returns u [m/s], r [rad/s], z2e [m]."""
    z, z_d = transform(Motion(x, y, psi, 0.0, v, 0.0)), transform(desired)
    dz_d = transform_rate(z_d, desired)
    z_e = tracking_error(z, z_d)
    r = (g.b * (dz_d.z3 - g.c2 * z_e.z3) - g.a * (g.c1 * z_e.z2 + v - dz_d.z2)) / (g.b - g.a * z.z1)
    return dz_d.z1 - g.c3 * z_e.z1 - z.z2 * r, r, z_e.z2


class Reduced(NamedTuple):
    """State of the reduced dynamics, or its time derivative."""

    x: float
    y: float
    psi: float
    v: float


def rate(state: Reduced, desired: Motion, tau_vw: float, g: Surfaces, vessel: Vessel) -> Reduced:
    """The time derivative of the state. `vessel`: coefficients of (6)."""
    u, r, _ = on_surfaces(state.x, state.y, state.psi, state.v, desired, g)
    f_v = unforced_acceleration(u, state.v, r, vessel)[1]
    c, s = math.cos(state.psi), math.sin(state.psi)
    return Reduced(u * c - state.v * s, u * s + state.v * c, r, f_v + tau_vw)


def moved(state: Reduced, step: float, rate: Reduced) -> Reduced:
    """The state moved by a step at a rate."""
    return Reduced(state.x + step * rate.x, state.y + step * rate.y, state.psi + step * rate.psi, state.v + step * rate.v)


def lateral_error(time: Array, reference: Array, disturbance: Array, start: Array, g: Surfaces, vessel: Vessel) -> Array:
    """Integrate the reduced dynamics along a reference, by RK4 in steps of two samples.

    `time`: Evenly spaced, (2·n + 1,) s. `reference`: x, y, psi, u, v, r of the virtual ship at those times, (2·n + 1, 6).
    `disturbance`: tau_vw at those times, (2·n + 1,) m/s². `start`: x, y, psi, v of the ship at the first time, (4,). `vessel`:
    Coefficients of (6).

    Returns z2e at every other time, (n + 1,) m; NaN from where the motion exceeds RUNAWAY.
    """
    desired, tau_vw = [Motion(*row) for row in reference.tolist()], disturbance.tolist()
    state, T = Reduced(*start.tolist()), float(time[2] - time[0])
    errors = np.full((len(time) + 1) // 2, np.nan)
    errors[0] = on_surfaces(*state, desired[0], g)[2]
    for k in range(0, len(time) - 1, 2):
        # The reference is given at samples only, so its values at k + 1 serve the middle of a step from k to k + 2.
        k1 = rate(state, desired[k], tau_vw[k], g, vessel)
        k2 = rate(moved(state, 0.5 * T, k1), desired[k + 1], tau_vw[k + 1], g, vessel)
        k3 = rate(moved(state, 0.5 * T, k2), desired[k + 1], tau_vw[k + 1], g, vessel)
        k4 = rate(moved(state, T, k3), desired[k + 2], tau_vw[k + 2], g, vessel)
        mean = Reduced(*(a + 2.0 * b + 2.0 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)))
        state = moved(state, T / 6.0, mean)
        # Negated so that NaN ends the integration too.
        if not all(abs(value) < RUNAWAY for value in state):
            break
        errors[k // 2 + 1] = on_surfaces(*state, desired[k + 2], g)[2]
    return errors


def growth_rate(r: float, v: float, vessel: Vessel) -> float:
    """The larger root of s² + (D/m22)·s - (m11/m22)·r² = 0: the growth rate of z2e in a turn, 1/s.

    D = d_v + 2·d_v2·|v| + 3·d_v3·v² is the slope of the damping at v: a small error adds to the sway velocity of the turn. `r`:
    yaw velocity, rad/s; on a straight line the root is 0. `v`: sway velocity, m/s. `vessel`: coefficients of (6).
    """
    damping = (vessel.d_v + 2.0 * vessel.d_v2 * abs(v) + 3.0 * vessel.d_v3 * v * v) / vessel.m22
    return 0.5 * (math.sqrt(damping * damping + 4.0 * vessel.m11 / vessel.m22 * r * r) - damping)


def reduced_error(run: Run, vessel: Vessel, gains: HierarchicalPrintedParameters) -> tuple[Array, Array]:
    """Times and lateral errors that the reduced dynamics predict from ON_SURFACES on; empty for a run that ends before.

    The prediction holds only for a constant weight a: a weight of switching sign changes the surfaces at every switch.
    `vessel`: coefficients of (6). Returns times, (n,) s, and z2e, (n,) m.
    """
    rows = np.flatnonzero(run.time >= ON_SURFACES)[::STRIDE]
    # An odd number of samples, because one Runge-Kutta step spans two intervals.
    rows = rows[: len(rows) - 1 + len(rows) % 2]
    if len(rows) < 3 or gains.sway_weight_sign != "constant":
        return np.empty(0), np.empty(0)
    symbols = schema.symbols(gains)
    surfaces = Surfaces(**{name: symbols[name] for name in Surfaces._fields})
    start = run.state[rows[0], [0, 1, 2, 4]]
    error = lateral_error(run.time[rows], run.reference[rows], run.disturbance[rows, 1], start, surfaces, vessel)
    return run.time[rows[::2]], error


EARLY = 50.0  # time of the first position error of case 3 that the errata quote, s
SETTLED_DEG, SETTLED = 1.0, 0.1  # tolerances of the settling times of heading and surge error, degrees and m
REACHED = 0.01  # a surface is reached when it stays below this fraction of its initial value


class Repaired(NamedTuple):
    """The constants of the repaired law and its networks."""

    gains: Gains
    network: NetworkParameters


LawNumbers = HierarchicalPrintedParameters | Repaired | None
"""The parameters of the law as printed, the constants of the repaired one, or None for a run with another law."""


@dataclass(frozen=True)
class CaseResult:
    """The results of a case."""

    numbers: Numbers  # the measured values
    run: Run  # its arrays, thinned for drawing, without the network weights
    # times and lateral errors that the reduced dynamics predict; empty for other laws than the paper's
    reduced: tuple[Array, Array]


def measure(run: Run, vessel: Vessel, law: LawNumbers, reduced: tuple[Array, Array] | None = None) -> Numbers:
    """Measure all numbers of a run. Returns the numbers; those of surfaces and networks are NaN for another law."""
    numbers = _motion(run) | _effort(run, vessel)
    if isinstance(law, HierarchicalPrintedParameters):
        numbers |= (
            _surfaces(run, (law.yaw_switching_gain, law.surge_switching_gain))
            | _weighted_surfaces(run, law)
            | _networks(run, law.network)
            | _switching(run, law)
            | _reduced(run, vessel, reduced or reduced_error(run, vessel, law))
        )
    elif law is not None:
        g = law.gains
        numbers |= _surfaces(run, (g.eta1, g.eta2)) | _networks(run, law.network) | _repaired_switching(run, g)
    return Numbers(**numbers)


def settling_time(time: Array, values: Array, limit: float) -> float:
    """Settling time: the time from which |values| stay below a limit.

    `time`: times of the samples, (n,) s. `values`: the signal, (n,). `limit`: half the width of the tolerance band, in the unit
    of the signal. Returns time of the first sample after the last one outside of the band, s; NaN if the signal ends outside.
    """
    # Negated `<` instead of `>=`: NaN then counts as outside of the band.
    above = np.flatnonzero(~(np.abs(values) < limit))
    if len(above) == 0:
        return float(time[0])
    return float(time[above[-1] + 1]) if above[-1] + 1 < len(time) else NAN


def _quarter(time: Array, number: int) -> NDArray[np.bool_]:
    """A mask of the samples in quarter 0, 1, 2 or 3 of a run."""
    part = (time - time[0]) / (time[-1] - time[0])
    inside: NDArray[np.bool_] = (part >= 0.25 * number) & (part <= 0.25 * (number + 1))
    return inside


def _at(time: Array, values: Array, instant: float) -> float:
    # Tolerance of 1 ns for rounded times.
    index = int(np.searchsorted(time, instant - 1e-9))
    return float(values[index]) if index < len(time) else NAN


def _motion(run: Run) -> dict[str, float]:
    late = _quarter(run.time, 3)
    half = _quarter(run.time, 2) | late
    distance = position_error(run.state, run.reference)
    angle = np.degrees(heading_error(run.state, run.reference))
    return {
        "duration": float(run.time[-1]),
        "position_error_start": float(distance[0]),
        "position_error_early": _at(run.time, distance, EARLY),
        "position_error_second_quarter": rms(distance[_quarter(run.time, 1)]),
        "position_error_late": rms(distance[late]),
        "position_error_final": float(distance[-1]),
        "position_error_smallest": float(np.min(distance)),
        "heading_error_rms_deg": rms(angle),
        "heading_error_second_half_deg": rms(angle[half]),
        "heading_error_late_deg": rms(angle[late]),
        "heading_error_final_deg": float(angle[-1]),
        "heading_settling_time": settling_time(run.time, angle, SETTLED_DEG),
        "heading_reference_second_half_deg": rms(np.degrees(run.reference[half, 2])),
        "yaw_rate_d_late": rms(run.reference[late, 5]),
    }


def _effort(run: Run, vessel: Vessel) -> dict[str, float]:
    late = _quarter(run.time, 3)
    u = np.abs(run.state[late, 3])
    nonlinear = vessel.d_u2 * u + vessel.d_u3 * u * u
    peak = np.max(np.abs(run.wrench), axis=0)
    step = np.diff(run.wrench[late], axis=0)
    return {
        "surge_force_peak": float(peak[0]),
        "yaw_moment_peak": float(peak[1]),
        "surge_velocity_error_late": rms(run.state[late, 3] - run.reference[late, 3]),
        "sway_velocity_error_late": rms(run.state[late, 4] - run.reference[late, 4]),
        "surge_peak_in_g": float(peak[0]) / vessel.m11 / GRAVITY,
        "surge_force_step": rms(step[:, 0]),
        "yaw_moment_step": rms(step[:, 1]),
        "nonlinear_damping_share": float(np.mean(nonlinear / (vessel.d_u + nonlinear))),
    }


def _surfaces(run: Run, switching_gains: tuple[float, float]) -> dict[str, float]:
    control = run.control
    time, S1, S2 = control["time"], control["yaw_surface"], control["surge_surface"]
    late = _quarter(time, 3)
    steps = (time[1] - time[0]) * np.array(switching_gains)
    floor = 5.0 * float(np.dot(steps, steps))  # a sampled sgn overshoots by up to one step, eta·T
    return {
        "surge_error_late": rms(control["surge_error"][late]),
        "surge_error_settling_time": settling_time(time, control["surge_error"], SETTLED),
        "sway_error_late": rms(control["sway_error"][late]),
        "sway_error_on_surfaces": _at(time, control["sway_error"], ON_SURFACES),
        "sway_error_final": float(control["sway_error"][-1]),
        "yaw_surface_start": abs(float(S1[0])),
        "yaw_surface_late": rms(S1[late]),
        "yaw_surface_reaching_time": settling_time(time, S1, REACHED * abs(float(S1[0]))),
        "surge_surface_start": abs(float(S2[0])),
        "surge_surface_late": rms(S2[late]),
        "surge_surface_reaching_time": settling_time(time, S2, REACHED * abs(float(S2[0]))),
        "lyapunov_rising_share": float(np.mean(control["lyapunov"][1:] > np.maximum(control["lyapunov"][:-1], floor))),
    }


def _weighted_surfaces(run: Run, gains: HierarchicalPrintedParameters) -> dict[str, float]:
    late = _quarter(run.control["time"], 3)
    return {
        "weighted_sway_surface_late": gains.sway_weight * rms(run.control["sway_surface"][late]),
        "weighted_heading_surface_late": gains.heading_weight * rms(run.control["heading_surface"][late]),
    }


def _networks(run: Run, network: NetworkParameters) -> dict[str, float]:
    """Errors of the network outputs relative to the rms of what they approximate: f plus the disturbance."""
    control = run.control
    late = _quarter(run.time, 3)
    # The networks compensate what the law does not know: unforced dynamics and disturbance together.
    truth = (run.unforced_acceleration[late] + run.disturbance[late]).T
    names = ("surge", "sway", "yaw")
    outputs = [control[f"{name}_estimate"][_quarter(control["time"], 3)] for name in names]
    errors = {f"{n}_estimate_error": rms(o - f) / rms(f) for n, o, f in zip(names, outputs, truth, strict=True)}
    mu, delta = network.centers(), network.width
    # Every hundredth sample suffices for the range of the activations.
    H = np.array([activations(Z, mu, delta) for Z in run.state[::100, 3:]])
    weights = sum(control[f"{name}_weights"].shape[-1] for name in names)
    return {**errors, "weights": float(weights), "activation_spread": float(np.max(np.ptp(H, axis=0)))}


def _switching(run: Run, gains: HierarchicalPrintedParameters) -> dict[str, float]:
    """The switching gains and their lower bounds by (34) on the reference, for networks without errors."""
    d1, d2, d3 = np.max(np.abs(run.disturbance), axis=0)
    # (34) must hold at the farthest point of the reference: that of a ship which is lost would count its error as a demand.
    farthest_1, farthest_2 = _farthest(run.reference)
    return {
        "singularity_share": float(gains.sway_weight * _farthest(run.state)[0] / gains.heading_weight),
        "yaw_switching_gain": gains.yaw_switching_gain,
        "yaw_switching_gain_needed": float(gains.sway_weight * (d2 + farthest_1 * d3) + gains.heading_weight * d3),
        "surge_switching_gain": gains.surge_switching_gain,
        "surge_switching_gain_needed": float(d1 + farthest_2 * d3),
    }


def _repaired_switching(run: Run, g: Gains) -> dict[str, float]:
    """As `_switching`, where S1 is the sway velocity of the point at the distance l ahead, and its weight of sigma1 is 1."""
    d1, d2, d3 = np.max(np.abs(run.disturbance), axis=0)
    ahead = np.hypot(g.l0, g.T_a * np.max(np.hypot(*run.reference[:, 3:5].T)))
    late = _quarter(run.control["time"], 3)
    return {
        "weighted_sway_surface_late": rms(run.control["sway_surface"][late]),
        "yaw_switching_gain": g.eta1,
        "yaw_switching_gain_needed": float(d2 + ahead * d3),
        "surge_switching_gain": g.eta2,
        "surge_switching_gain_needed": float(d1),
    }


def _farthest(poses: Array) -> tuple[float, float]:
    """Largest |z1| and |z2| of (9) along a motion, m."""
    x, y, psi = poses[:, :3].T
    z1, z2 = x * np.cos(psi) + y * np.sin(psi), -x * np.sin(psi) + y * np.cos(psi)
    return float(np.max(np.abs(z1))), float(np.max(np.abs(z2)))


def _reduced(run: Run, vessel: Vessel, reduced: tuple[Array, Array]) -> dict[str, float]:
    v, r = (rms(run.reference[_quarter(run.time, 3), column]) for column in (4, 5))
    growth = {"growth_rate": growth_rate(r, v, vessel)}
    time, predicted = reduced
    if len(time) == 0:
        return growth
    actual = np.interp(time, run.control["time"], run.control["sway_error"])
    deviation = float(np.max(np.abs(predicted - actual)) / np.max(np.abs(actual)))
    return {**growth, "reduced_sway_error_final": float(predicted[-1]), "reduced_deviation": deviation}
