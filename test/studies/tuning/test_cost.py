"""The cost of a set of gains: ratios, penalties, aggregates."""

import math

import numpy as np
import pytest

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.metrics import Metrics
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.studies.batch import Outcome
from vessel_hsmc_ros.studies.tuning.plan import AGGREGATES, ERROR, FLOOR, Case, Cost, Objective, chosen_objective

METRICS = Metrics(*[1.0] * 10)


def outcome(error: float, moment: float = 1.0, failure: str = "") -> Outcome:
    metrics = METRICS._replace(position_error_rms_last_quarter=error, yaw_moment_rms=moment)
    return Outcome(0, failure, None if failure else metrics)


def test_the_cost_of_the_present_gains_is_one_without_limits() -> None:
    values = Objective().values([outcome(0.1, 5.0), outcome(20.0, 7.0)])
    scales = Objective().scales([Case("a", load_scenario("case2_tracking"))] * 2, values)
    assert Objective().cost(values, scales) == pytest.approx((1.0, 1.0, 0))
    better = Objective().values([outcome(0.05, 5.0), outcome(20.0, 28.0)])
    assert Objective().cost(better, scales) == pytest.approx((math.sqrt(0.5), 2.0, 0))


def test_a_limit_of_a_case_is_its_scale() -> None:
    values = Objective().values([outcome(0.1), outcome(0.1)])
    scenario = load_scenario("case2_tracking")
    scales = Objective().scales([Case("a", scenario, {ERROR: 0.4}), Case("b", scenario)], values)
    assert scales[:, 0].tolist() == [0.4, 0.1]


@pytest.mark.parametrize("aggregate", AGGREGATES)
def test_a_run_that_fails_costs_more_than_the_poorest_one_and_two_cost_more_than_one(aggregate: str) -> None:
    objective, scales = chosen_objective(aggregate=aggregate), np.ones((2, 2))

    def cost(*runs: Outcome) -> Cost:
        return objective.cost(objective.values(runs), scales)

    poor, failing = cost(outcome(1e9, 1e9), outcome(1.0)), cost(outcome(1.0, failure="diverged"), outcome(1e-9, 1e-9))
    both = cost(outcome(1.0, failure="diverged"), outcome(1.0, failure="diverged"))
    assert poor.cost < failing.cost < both.cost < math.inf
    assert poor.effort < failing.effort < both.effort < math.inf
    assert (poor.failed, failing.failed, both.failed) == (0, 1, 2)


def test_precision_far_below_the_scale_gains_nothing() -> None:
    costs = [Objective().cost(Objective().values([outcome(error)]), np.ones((1, 2))).cost for error in (0.01, 1e-4)]
    assert costs == pytest.approx([FLOOR, FLOOR])


def test_the_worst_run_can_be_the_cost() -> None:
    objective = chosen_objective(aggregate="worst")
    assert objective.cost(objective.values([outcome(3.0), outcome(0.1)]), np.ones((2, 2))).cost == 3.0


def test_the_sign_of_a_metric_does_not_count() -> None:
    objective = chosen_objective("heading_error_final_deg")
    values = objective.values([Outcome(0, metrics=METRICS._replace(heading_error_final_deg=-2.0))])
    assert values[0, 0] == 2.0


@pytest.mark.parametrize(
    ("metrics", "message"),
    [
        (("speed",), "--metric must be one of position_error_rms.*got speed"),
        ((ERROR, "effort"), "--second-metric must be one of.*got effort"),
        ((ERROR, ERROR), "must be another metric than that of the cost"),
    ],
)
def test_an_unknown_metric_is_named(metrics: tuple[str, ...], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        chosen_objective(*metrics)


def test_a_metric_without_a_value_in_any_run_is_refused() -> None:
    objective = chosen_objective("yaw_moment_at_limit")
    values = objective.values([Outcome(0, metrics=METRICS)])
    with pytest.raises(ParameterError, match="yaw_moment_at_limit has no value in any run"):
        objective.check(values, [""])
    chosen_objective("settling_time").check(values, [""])


def test_a_run_that_lacks_one_metric_fails_in_that_one_only() -> None:
    """For instance one that has not settled: its effort is what it is."""
    objective, scales = chosen_objective(), np.ones((2, 2))
    without_error, without_effort = np.array([[math.nan, 1.0], [1.0, 1.0]]), np.array([[1.0, math.nan], [1.0, 1.0]])
    found = objective.cost(without_error, scales)
    assert found.effort == pytest.approx(1.0)
    assert found.failed == 1
    assert found.cost > 100.0
    found = objective.cost(without_effort, scales)
    assert found.cost == pytest.approx(1.0)
    assert found.failed == 0
    assert found.effort > 100.0
