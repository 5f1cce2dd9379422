"""Every number that is measured in a run of the paper, from arrays of unlike values."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.network import NetworkParameters, activations
from vessel_hsmc_ros.control.laws.hierarchical_parameters import HierarchicalParameters, gains
from vessel_hsmc_ros.control.laws.hierarchical_printed import HierarchicalPrintedParameters
from vessel_hsmc_ros.core.metrics import Run
from vessel_hsmc_ros.plant.hull_parameters import VesselParameters
from vessel_hsmc_ros.studies.paper import reproduction
from vessel_hsmc_ros.studies.paper.cases import PRINTED, REPAIRED, Check, Claim, Numbers
from vessel_hsmc_ros.studies.paper.measure import Repaired, growth_rate, measure

VESSEL = replace(VesselParameters(), surge_damping_quadratic=7.0, surge_damping_cubic=3.0).coefficients()
GAINS = replace(
    HierarchicalPrintedParameters(),
    sway_weight=0.25,
    heading_weight=8.0,
    yaw_switching_gain=0.5,
    surge_switching_gain=0.125,
    network=replace(NetworkParameters(), width=3.0),
)
TIME = np.arange(101.0)
SECOND, LATE, HALF = (TIME >= 25.0) & (TIME <= 50.0), TIME >= 75.0, TIME >= 50.0


def unlike(*scales: float, seed: int) -> Any:
    """Columns of unlike size and sign, which change all the time."""
    return np.random.default_rng(seed).uniform(0.5, 1.5, (len(TIME), len(scales))) * np.array(scales)


SIZES = {
    "sway_error": -6.0,
    "sway_surface": 0.5,
    "heading_surface": -0.75,
    "lyapunov": 2.0,
    "surge_estimate": -0.375,
    "sway_estimate": 0.625,
    "yaw_estimate": 0.875,
}
CONTROL: dict[str, Any] = {
    "time": TIME,
    **{name: unlike(size, seed=k)[:, 0] for k, (name, size) in enumerate(SIZES.items())},
    "surge_error": np.where(TIME < 33.0, 4.0, 0.05),
    "yaw_surface": np.where(TIME < 61.0, -9.0, 1e-5 * TIME),
    "surge_surface": np.where(TIME < 47.0, 7.0, 2e-5 * TIME),
    **{f"{name}_weights": np.zeros((len(TIME), count)) for name, count in (("surge", 2), ("sway", 3), ("yaw", 5))},
    "commanded": unlike(1.0, 2.0, seed=20),
}


@pytest.fixture(scope="module")
def run() -> Run:
    state = unlike(30.0, -40.0, 0.3, 2.0, -0.7, 0.05, seed=30)
    reference = unlike(50.0, 60.0, -0.2, 1.3, 0.4, -0.08, seed=31)
    state[TIME >= 90.0, 2] = reference[TIME >= 90.0, 2] + np.radians(0.5)
    state[-1, 2] = reference[-1, 2] - np.radians(0.25)
    wrench = unlike(3e5, -7e6, seed=32)
    accelerations = unlike(0.1, -0.2, 0.3, seed=33), unlike(0.04, 0.05, -0.06, seed=34)
    return Run(TIME, state, state, reference, wrench, *accelerations, CONTROL)


def rms(values: Any) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def last_above(values: Any, limit: float) -> float:
    return float(TIME[np.flatnonzero(np.abs(values) >= limit)[-1] + 1])


def test_every_number_of_a_run_is_that_of_its_own_column_and_time(run: Run) -> None:
    found = measure(run, VESSEL, GAINS, (np.empty(0), np.empty(0)))
    error = run.state - run.reference
    distance, angle = np.hypot(error[:, 0], error[:, 1]), np.degrees(error[:, 2])
    u = np.abs(run.state[LATE, 3])
    more = (7.0 * u + 3.0 * u * u) / (VESSEL.d_u + 7.0 * u + 3.0 * u * u)
    c, steps = CONTROL, np.diff(run.wrench[LATE], axis=0)
    x, y, psi = run.reference[:, :3].T
    z1, z2 = np.max(np.abs(x * np.cos(psi) + y * np.sin(psi))), np.max(np.abs(y * np.cos(psi) - x * np.sin(psi)))
    ship_x, ship_y, heading = run.state[:, :3].T
    d1, d2, d3 = np.abs(run.disturbance).max(axis=0)
    known = (run.unforced_acceleration + run.disturbance)[LATE].T
    H = np.array([activations(row, GAINS.network.centers(), 3.0) for row in run.state[[0, 100], 3:]])
    expected = {
        "duration": 100.0,
        "position_error_start": distance[0],
        "position_error_early": distance[50],
        "position_error_second_quarter": rms(distance[SECOND]),
        "position_error_late": rms(distance[LATE]),
        "position_error_final": distance[-1],
        "position_error_smallest": distance.min(),
        "heading_error_rms_deg": rms(angle),
        "heading_error_second_half_deg": rms(angle[HALF]),
        "heading_error_late_deg": rms(angle[LATE]),
        "heading_error_final_deg": -0.25,
        "heading_settling_time": last_above(angle, 1.0),
        "heading_reference_second_half_deg": rms(np.degrees(run.reference[HALF, 2])),
        "yaw_rate_d_late": rms(run.reference[LATE, 5]),
        "surge_force_peak": run.wrench[:, 0].max(),
        "yaw_moment_peak": -run.wrench[:, 1].min(),
        "surge_velocity_error_late": rms(error[LATE, 3]),
        "sway_velocity_error_late": rms(error[LATE, 4]),
        "surge_peak_in_g": run.wrench[:, 0].max() / VESSEL.m11 / 9.81,
        "surge_force_step": rms(steps[:, 0]),
        "yaw_moment_step": rms(steps[:, 1]),
        "nonlinear_damping_share": np.mean(more),
        "surge_error_late": rms(c["surge_error"][LATE]),
        "surge_error_settling_time": 33.0,
        "sway_error_late": rms(c["sway_error"][LATE]),
        "sway_error_on_surfaces": c["sway_error"][20],
        "sway_error_final": c["sway_error"][-1],
        "yaw_surface_start": 9.0,
        "yaw_surface_late": rms(c["yaw_surface"][LATE]),
        "yaw_surface_reaching_time": 61.0,
        "surge_surface_start": 7.0,
        "surge_surface_late": rms(c["surge_surface"][LATE]),
        "surge_surface_reaching_time": 47.0,
        "weighted_sway_surface_late": 0.25 * rms(c["sway_surface"][LATE]),
        "weighted_heading_surface_late": 8.0 * rms(c["heading_surface"][LATE]),
        "lyapunov_rising_share": np.mean(c["lyapunov"][1:] > np.maximum(c["lyapunov"][:-1], 5.0 * (0.5**2 + 0.125**2))),
        **{
            f"{name}_estimate_error": rms(c[f"{name}_estimate"][LATE] - truth) / rms(truth)
            for name, truth in zip(("surge", "sway", "yaw"), known, strict=True)
        },
        "weights": 10.0,
        "activation_spread": np.max(np.ptp(H, axis=0)),
        "singularity_share": 0.25 / 8.0 * np.max(np.abs(ship_x * np.cos(heading) + ship_y * np.sin(heading))),
        "yaw_switching_gain": 0.5,
        "yaw_switching_gain_needed": 0.25 * (d2 + z1 * d3) + 8.0 * d3,
        "surge_switching_gain": 0.125,
        "surge_switching_gain_needed": d1 + z2 * d3,
        "growth_rate": growth_rate(rms(run.reference[LATE, 5]), rms(run.reference[LATE, 4]), VESSEL),
    }
    for name, value in expected.items():
        assert getattr(found, name) == pytest.approx(value, rel=2e-3), name
    none = {name for name in Numbers.__dataclass_fields__ if np.isnan(getattr(found, name))}
    assert none == set(Numbers.__dataclass_fields__) - set(expected)


def test_the_numbers_of_the_repaired_law_have_its_own_gains_and_bounds(run: Run) -> None:
    g = gains(HierarchicalParameters(), KnownVessel(), 0.01)._replace(eta1=0.5, eta2=0.125, l0=3.0, T_a=4.0)
    found, printed = measure(run, VESSEL, Repaired(g, GAINS.network)), measure(run, VESSEL, GAINS)
    d1, d2, d3 = np.abs(run.disturbance).max(axis=0)
    ahead = np.hypot(3.0, 4.0 * np.max(np.hypot(run.reference[:, 3], run.reference[:, 4])))
    assert found.yaw_switching_gain_needed == pytest.approx(d2 + ahead * d3)
    assert found.surge_switching_gain_needed == pytest.approx(d1)
    assert (found.yaw_switching_gain, found.surge_switching_gain) == (0.5, 0.125)
    assert found.weighted_sway_surface_late == pytest.approx(rms(CONTROL["sway_surface"][LATE]))
    assert np.isnan(found.growth_rate)
    for name in ("position_error_late", "yaw_surface_late", "lyapunov_rising_share", "sway_estimate_error", "weights"):
        assert getattr(found, name) == getattr(printed, name), name


def test_a_prediction_is_compared_with_the_lateral_error_at_its_own_times(run: Run) -> None:
    times = np.array([20.0, 40.0, 99.0])
    predicted = CONTROL["sway_error"][[20, 40, 99]] + np.array([0.5, -0.75, 0.25])
    found = measure(run, VESSEL, GAINS, (times, predicted))
    assert found.reduced_sway_error_final == predicted[-1]
    assert found.reduced_deviation == pytest.approx(0.75 / np.max(np.abs(CONTROL["sway_error"][[20, 40, 99]])))


def test_a_thinned_run_keeps_first_and_last_samples_of_each_array() -> None:
    count, periods = 3 * reproduction.STRIDE + reproduction.FIRST + 2, reproduction.FIRST + 2 * reproduction.STRIDE + 3
    rows = np.arange(float(count))
    wide = np.column_stack([rows] * 6)
    control = {"time": np.arange(float(periods)), "weights": np.zeros((periods, 2))}
    found = reproduction.thinned(Run(rows, wide, wide, wide, wide[:, :2], wide[:, :3], wide[:, :3], control))
    assert list(found.control) == ["time"]
    for values, last in ((found.time, count - 1), (found.reference[:, 5], count - 1), (found.control["time"], periods - 1)):
        assert values[: reproduction.FIRST].tolist() == list(range(reproduction.FIRST))
        assert values[-1] == last
        assert set(range(0, last, reproduction.STRIDE)) <= {*values.tolist()}
        assert np.all(np.diff(values) > 0.0)


RESULTS = {name: Numbers(duration=value, ended_at=2.0 * value) for name, value in (("a", 4.0), ("b", 10.0), ("c", 7.0))}


def test_the_best_of_several_runs_is_the_smallest_below_a_threshold_and_the_largest_above() -> None:
    below = Check("time", "b", "duration", below=5.0, unit=" s", also=("a", "c"))
    above = Check("time", "a", "duration", above=8.0, unit=" s", also=("b", "c"))
    assert (below.value(RESULTS), above.value(RESULTS)) == (4.0, 10.0)
    assert (below.required, below.measured(RESULTS)) == ("time best ≤ 5 s", "10, 4, 7 s")
    assert (above.required, above.measured(RESULTS)) == ("time best ≥ 8 s", "4, 10, 7 s")
    ratio = Check("ratio", "a", "duration", below=0.3, above=0.1, over=("b", "ended_at"))
    assert ratio.value(RESULTS) == 0.2
    assert (ratio.required, ratio.measured(RESULTS)) == ("ratio ≤ 0.3 and ≥ 0.1", "0.2")


def test_a_claim_is_narrow_by_the_checks_that_decide_it() -> None:
    met, narrow, missed = (Check("x", "b", "duration", below=limit) for limit in (100.0, 11.0, 1.0))
    near = Check("x", "b", "duration", below=9.0)
    answers = {
        (met,): "yes",
        (met, narrow): "yes, narrowly",
        (narrow, near): "no, narrowly",
        (near, missed): "no",
        (narrow, missed): "no",
    }
    for checks, answer in answers.items():
        assert Claim("", "", checks).answer(RESULTS, PRINTED) == answer
    assert Claim("", "", (met,), by_construction=(PRINTED,)).answer(RESULTS, PRINTED) == "by construction"
    assert Claim("", "", (met,), by_construction=(PRINTED,)).answer(RESULTS, REPAIRED) == "yes"
    assert Claim("", "", (missed,), by_construction=(PRINTED,)).answer(RESULTS, PRINTED) == "no"
