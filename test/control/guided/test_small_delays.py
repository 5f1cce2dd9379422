"""The guided law with small lags and dead times that are declared, on a small, the paper's and a large ship, at three rates."""

import pytest
from compiling import only_compiled
from durations import rest_long
from ship_family import ShipFamily, expand

from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.studies.batch import simulate_one

LAGS, DEAD_TIMES = (0.005, 0.02, 0.05, 0.1, 0.3), (0.005, 0.02, 0.05, 0.1, 0.3)
"""Of both inputs, in T."""

DELAYS = [*((lag, 0.0) for lag in LAGS), *((0.0, dead_time) for dead_time in DEAD_TIMES)]

RATES, LENGTHS = (10.0, 50.0, 100.0), (1.2, 32.0, 300.0)

LIMIT = 0.002
"""Largest rms position error of the last quarter, in lengths."""


def error(lag: float, dead_time: float, rate: float, length: float, declared: float = 1.0) -> float:
    """The rms position error of the last quarter on a straight line, in lengths; the start is a fifth of a length off."""
    family = ShipFamily(
        length=length,
        has_lag=lag > 0.0,
        lag=lag,
        has_dead_time=dead_time > 0.0,
        dead_time=dead_time,
        declares_lag=True,
        declares_rate=True,
        declares_dead_time=True,
        declared_lag=declared,
        declared_dead_time=declared,
        reference="straight",
        control_rate_hz=rate,
        start_heading=0.3,
    )
    outcome = simulate_one(load_scenario("case2_tracking", {"controller.law": "guided", **expand(family)}))
    assert outcome.metrics is not None
    return outcome.metrics.position_error_rms_last_quarter / length


@only_compiled
@pytest.mark.parametrize(("lag", "dead_time"), rest_long(DELAYS, 2))
def test_a_small_delay_that_is_declared_exactly_costs_no_accuracy(lag: float, dead_time: float) -> None:
    # Each delay with all rates and all lengths, and all pairs of these with three delays.
    place = DELAYS.index((lag, dead_time))
    cases = [(rate, LENGTHS[(k + place) % 3]) for k, rate in enumerate(RATES)]
    errors = {(rate, length): error(lag, dead_time, rate, length) for rate, length in cases}
    assert {case: found for case, found in errors.items() if not found <= LIMIT} == {}


@pytest.mark.parametrize("declared", [0.5, 1.5])
@pytest.mark.parametrize("lag", LAGS)
def test_a_small_lag_may_be_declared_half_or_one_and_a_half_times_as_large(lag: float, declared: float) -> None:
    rate = RATES[(LAGS.index(lag) + (declared > 1.0)) % 3]
    assert error(lag, 0.0, rate, 32.0, declared) <= LIMIT


@pytest.mark.parametrize("mode", ["circle", "straight"])
def test_a_rate_that_is_declared_too_slow_costs_no_ship(mode: str) -> None:
    """5.5 s to full declared, no limit in truth, a dead time of 0.4 s: 33 m before."""
    changes: dict[str, object] = {f"{node}.rate_hz": 20.0 for node in ("vessel_sim", "reference_ship", "controller")}
    changes |= {"controller.law": "guided", "vessel_sim.duration": 400.0, "reference_ship.mode": mode}
    for node in ("vessel_sim.actuators", "controller.vessel"):
        changes |= {f"{node}.surge_force_limit": 2e5, f"{node}.yaw_moment_limit": 3e6}
        changes |= {
            f"{node}.{axis}_{what}": value for axis in ("surge", "yaw") for what, value in (("lag", 0.0), ("dead_time", 0.4))
        }
    changes |= {"controller.vessel.surge_force_rate": 2e5 / 5.5, "controller.vessel.yaw_moment_rate": 3e6 / 5.5}
    metrics = simulate_one(load_scenario("case2_tracking", changes)).metrics
    assert metrics
    assert metrics.position_error_rms_last_quarter < 0.02
