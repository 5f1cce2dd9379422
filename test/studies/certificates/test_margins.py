"""The margins of laws, against the loop itself in compiled runs of the circle."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from durations import rest_long

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.studies.batch import simulate_many
from vessel_hsmc_ros.studies.margins import PHASE_MARGIN_DEG, ship_about, shortcomings, study

INPUTS = ("surge", "yaw")
LAW, PLANT = "controller.vessel", "vessel_sim.actuators"
FAST: dict[str, object] = {
    **{f"{LAW}.{name}_{what}": 0.0 for name in INPUTS for what in ("lag", "dead_time")},
    f"{LAW}.surge_force_rate": math.inf,
    f"{LAW}.yaw_moment_rate": math.inf,
}
LAG: dict[str, object] = {f"{node}.{name}_lag": 2.0 for node in (LAW, PLANT) for name in INPUTS}
RATES: dict[str, object] = {
    f"{node}.{name}": value for node in (LAW, PLANT) for name, value in (("surge_force_rate", 2e4), ("yaw_moment_rate", 3e5))
}
SETS: dict[str, dict[str, object]] = {"fast": FAST, "slow": FAST | LAG, "not declared": {}}

LOWEST_DB = 4.5
"""Change of the gain at which the law is tried; with half the gain and actuators with a lag of 2 s it is lost."""

CONVERGED = 0.5
"""Largest rms position error over the last quarter of a run, m; an unstable loop is off by 20 m and more."""


def circle(**changes: object) -> Scenario:
    rates = {f"{node}.rate_hz": 20.0 for node in ("vessel_sim", "reference_ship", "controller")}
    return load_scenario("case2_tracking", {"controller.law": "guided", "vessel_sim.duration": 250.0, **rates, **changes})


def perturbed(scenario: Scenario, gain: float = 1.0, delays: Sequence[float] = (0.0, 0.0)) -> Scenario:
    """The same law on a ship that moves as before, by a wrench that is worth `gain` times as much and comes later.

    Args:
        scenario: The law and its ship.
        gain: The factor.
        delays: Further dead times of surge force and yaw moment, s.
    """
    sim = scenario.vessel_sim
    of_hull = [name for name in vars(sim.vessel) if "inertia" in name or "damping" in name]
    changes: dict[str, object] = {f"vessel_sim.vessel.{name}": getattr(sim.vessel, name) / gain for name in of_hull}
    changes[f"controller.{scenario.controller.law}.actuator_identification"] = False  # it would find the dead time
    for name, more in zip(INPUTS, delays, strict=True):
        changes[f"{PLANT}.{name}_dead_time"] = getattr(sim.actuators, f"{name}_dead_time") + more
    return scenario.changed(changes)


@pytest.mark.parametrize("name", rest_long(["slow", "fast", "not declared"]))
def test_the_loop_converges_within_its_margins(name: str) -> None:
    scenario = circle(**SETS[name])
    found = study(scenario).loops
    loops = [found[each] for each in ("surge force", "yaw moment")]
    assert all(loop.stable for loop in loops)
    gain_db, phase = min(loop.gain_db for loop in loops), min(loop.phase_deg for loop in loops)
    # No more than the margins that are aimed for, and a little less than the computed ones, where it would converge slowly.
    factor = 10.0 ** (min(0.75 * gain_db, LOWEST_DB) / 20.0)
    lag = math.radians(min(0.9 * phase, PHASE_MARGIN_DEG))
    late = [lag / loop.crossover for loop in loops]
    cases = [(1.0, (0.0, 0.0)), (factor, (0.0, 0.0)), (1.0 / factor, (0.0, 0.0)), (1.0, late)]
    errors = [
        outcome.metrics.position_error_rms_last_quarter if outcome.metrics else math.inf
        for outcome in simulate_many(perturbed(scenario, *case) for case in cases)
    ]
    assert max(errors) < CONVERGED


@pytest.mark.parametrize("gain_db", [-4.0, 4.0])
def test_with_rate_limits_the_loop_converges_within_two_thirds_of_the_margin(gain_db: float) -> None:
    """Rates are not in the linear loop: with half the gain, inputs that take 10 s to full no longer settle in time."""
    outcome = next(iter(simulate_many([perturbed(circle(**(FAST | LAG | RATES)), 10.0 ** (gain_db / 20.0))])))
    assert outcome.metrics is not None
    assert outcome.metrics.position_error_rms_last_quarter < CONVERGED


def test_the_hull_about_a_path_is_that_of_the_papers_ship() -> None:
    ship = ship_about(circle(), 2.0)
    # dv = -(m11/m22)·U·r - d_v/m22·v, and m33·dr = (m11 - m22)·U·v - d_r·r.
    assert ship.slopes[1] == pytest.approx([0.0, -147e3 / 177.9e3, -2.0 * 120e3 / 177.9e3], rel=1e-3, abs=1e-9)
    assert ship.slopes[2] == pytest.approx([0.0, 2.0 * (120e3 - 177.9e3) / 636e5, -802e4 / 636e5], rel=1e-3, abs=1e-9)
    assert ship.gains == pytest.approx(np.array([[1.0 / 120e3, 0.0], [0.0, 0.0], [0.0, 1.0 / 636e5]]), rel=1e-9)


def test_a_law_that_is_not_a_kernel_has_no_margins() -> None:
    with pytest.raises(ParameterError, match=r"controller\.law must be a law with a kernel, .*got nmpc"):
        study(circle(**{"controller.law": "nmpc", "vessel_sim.duration": 20.0}))


@pytest.mark.parametrize(
    ("changes", "reported"),
    rest_long(
        [
            ({}, ""),
            ({"reference_ship.yaw_moment": 3.5e6}, "it needs a yaw moment of 3.5 MN·m, but the limit is 3 MN·m"),
            ({"reference_ship.yaw_moment_sine.amplitude": 1e6, f"{LAW}.yaw_moment_rate": 1e4}, "a yaw moment that changes by"),
            ({"reference_ship.surge_force_sine.amplitude": 1e5, f"{LAW}.surge_force_rate": 1e3}, "a surge force that changes by"),
            (
                {"reference_ship.yaw_moment_sine.amplitude": 1e6, "reference_ship.yaw_moment_sine.frequency": 3.0},
                "a yaw moment that varies at",
            ),
        ],
        3,
    ),
)
def test_a_ship_too_slow_for_its_reference_is_reported(changes: dict[str, object], reported: str) -> None:
    # What the reference needs is found in the first circles, and of any law; that of los_pid has few states to linearise.
    quick = {"controller.law": "los_pid", "vessel_sim.duration": 100.0}
    scenario = circle(**{f"{LAW}.yaw_lag": 0.0, **quick, **changes})
    slow = [line for line in shortcomings(scenario, study(scenario)) if "too slow" in line]
    assert any(reported in line for line in slow) if reported else not slow
