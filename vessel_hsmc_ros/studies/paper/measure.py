"""Measure the numbers to which the claims of the paper refer, from the arrays of a run of either form of the law."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vessel_hsmc_ros.control.interface.network import NetworkParameters, activations
from vessel_hsmc_ros.control.laws.hierarchical_parameters import Gains
from vessel_hsmc_ros.control.laws.hierarchical_printed import HierarchicalPrintedParameters
from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.core.kinematics import GRAVITY
from vessel_hsmc_ros.core.metrics import heading_error, position_error, rms
from vessel_hsmc_ros.core.run_data import Run
from vessel_hsmc_ros.plant.dynamics import Vessel
from vessel_hsmc_ros.studies.paper.numbers import NAN, Numbers
from vessel_hsmc_ros.studies.paper.reduced import ON_SURFACES, growth_rate, reduced_error

EARLY = 50.0  # time of the first position error of case 3 that the errata quote, s
SETTLED_DEG, SETTLED = 1.0, 0.1  # tolerances of the settling times of heading and surge error, degrees and m
REACHED = 0.01  # a surface is reached when it stays below this fraction of its initial value


class Repaired(NamedTuple):
    """The constants of the repaired law and its networks."""

    gains: Gains
    network: NetworkParameters


LawNumbers = HierarchicalPrintedParameters | Repaired | None
"""The parameters of the law as printed, the constants of the repaired one, or None for a run with another law."""


def measure(run: Run, vessel: Vessel, law: LawNumbers, reduced: tuple[Array, Array] | None = None) -> Numbers:
    """Measure all numbers of a run.

    `run`: a run of at least two samples, evenly spaced. `reduced`: what `reduced_error` gives for a run of the law as printed,
    if it is known already. Returns the numbers; those of surfaces and networks are NaN for another law.
    """
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
