"""Confidence intervals against published values and by their coverage; sensitivity indices of functions with known ones."""

import math

import numpy as np
import pytest

from vessel_hsmc_ros.studies.campaign.results import FEWEST, at_most, clopper_pearson, exceedance, influences, paired, quantile


# Clopper and Pearson's interval in textbooks: 4 of 20, 10 of 100, none of 10 and all of 10.
@pytest.mark.parametrize(
    ("failures", "runs", "low", "high"),
    [(4, 20, 0.0573, 0.4366), (10, 100, 0.0490, 0.1762), (0, 10, 0.0, 0.3085), (10, 10, 0.6915, 1.0), (0, 0, 0.0, 1.0)],
)
def test_the_interval_of_a_probability_is_the_published_one(failures: int, runs: int, low: float, high: float) -> None:
    assert clopper_pearson(failures, runs) == pytest.approx((low, high), abs=5e-5)


def test_without_a_failure_the_bound_follows_the_rule_of_three() -> None:
    assert at_most(0, 10_000) == pytest.approx(1.0 - 0.05**1e-4, rel=1e-9)
    assert at_most(0, 29_956) < 1e-4 < at_most(0, 29_955)
    assert at_most(3, 3) == at_most(0, 0) == 1.0


def test_the_interval_of_a_probability_covers_it_in_at_least_95_percent_of_all_campaigns() -> None:
    runs, probability = 50, 0.07
    intervals = [clopper_pearson(failures, runs) for failures in range(runs + 1)]
    chances = [math.comb(runs, k) * probability**k * (1.0 - probability) ** (runs - k) for k in range(runs + 1)]
    covered = [chance for chance, (low, high) in zip(chances, intervals, strict=True) if low <= probability <= high]
    assert 0.95 <= sum(covered) < 0.99


# Order statistics that enclose the median with 95 %: Conover, Practical Nonparametric Statistics, table A3.
@pytest.mark.parametrize(("n", "lower", "upper"), [(10, 2, 9), (20, 6, 15), (6, 1, 6)])
def test_the_bounds_of_a_median_are_the_tabulated_order_statistics(n: int, lower: int, upper: int) -> None:
    values = np.arange(1.0, n + 1.0)
    assert quantile(values, 0.5) == (math.ceil(n / 2), lower, upper)


def test_the_bounds_of_a_quantile_cover_it_in_at_least_95_percent_of_all_campaigns() -> None:
    random = np.random.default_rng(2)
    true = -math.log(0.1)  # of the exponential distribution
    found = [quantile(random.exponential(size=120), 0.9) for _ in range(2000)]
    assert np.mean([low <= true <= high for _, low, high in found]) >= 0.95


def test_a_bound_for_which_the_sample_is_too_small_is_infinite() -> None:
    values = np.arange(71.0)
    assert quantile(values, 0.95).high == math.inf
    assert quantile(np.arange(72.0), 0.95).high == 71.0
    assert quantile(values, 0.01).low == -math.inf
    assert math.isnan(quantile(np.zeros(0), 0.5).value)


@pytest.mark.parametrize("n", [20, 25, 100])
def test_a_share_of_the_sample_is_not_raised_by_its_binary_fraction(n: int) -> None:
    percents = range(1, 100)
    found = [quantile(np.arange(1.0, n + 1.0), percent / 100.0).value for percent in percents]
    assert found == [-(-percent * n // 100) for percent in percents]


def test_a_quantile_among_runs_that_ended_early_is_infinite() -> None:
    values = np.array([1.0] * 90 + [math.inf] * 10)
    assert quantile(values, 0.9).value == 1.0
    assert quantile(values, 0.95).value == math.inf


def test_a_quantile_is_not_moved_by_the_rounding_of_its_place() -> None:
    assert quantile(np.arange(1.0, 21.0), 0.95).value == 19.0


def test_laws_are_compared_draw_by_draw() -> None:
    first = np.array([1.0, 2.0, 3.0, math.inf, 5.0, math.inf])
    second = np.array([2.0, 4.0, 2.0, 1.0, math.inf, math.inf])
    found = paired(first, second)
    assert (found.better, found.worse, found.equal) == (3, 2, 1)
    assert found.share == clopper_pearson(3, 5)
    assert found.ratio.value == 0.5
    assert paired(np.array([1.0, math.inf, math.inf]), np.array([2.0, 1.0, 1.0])).ratio.value == 0.5, "of draws with two values"
    assert paired(np.array([3.0, 1.0, 1.0]), np.array([2.0, math.inf, math.inf])).ratio.value == 1.5, "of draws with two values"


def test_the_share_of_runs_above_a_value_counts_those_that_ended_early() -> None:
    values, share, low, high = exceedance(np.array([1.0, 2.0, 3.0, math.inf]))
    assert values.tolist() == [1.0, 2.0, 3.0]
    assert share.tolist() == [0.75, 0.5, 0.25]
    assert (low[0], high[0]) == pytest.approx(clopper_pearson(3, 4))


def test_the_largest_value_has_an_upper_bound_of_its_share_and_no_lower_one() -> None:
    values, share, low, high = exceedance(np.random.default_rng(3).exponential(size=5000), points=100)
    assert (share[-1], low[-1]) == (0.0, 0.0)
    assert high[-1] == pytest.approx(clopper_pearson(0, 5000).high)
    assert len(values) <= 100
    assert np.all(np.diff(values) > 0.0)
    assert np.all((low <= share) & (share <= high))


def test_no_runs_have_no_curve() -> None:
    assert [len(part) for part in exceedance(np.zeros(0))] == [0, 0, 0, 0]


def test_the_sensitivity_indices_of_a_sum_are_its_shares_of_the_variance() -> None:
    random = np.random.default_rng(4)
    drawn = {name: random.normal(size=4000) for name in ("weak", "strong", "none")}
    found = influences(drawn, 2.0 * drawn["strong"] - drawn["weak"])
    assert [entry.parameter for entry in found] == ["strong", "weak", "none"]
    # Of ranks, which for a normal sum differ from the values' own 0.8, 0.2 and 0 by some hundredths.
    assert [entry.first_order for entry in found] == pytest.approx([0.8, 0.2, 0.0], abs=0.05)
    assert [entry.clear for entry in found] == [True, True, False]
    assert [round(entry.correlation, 1) for entry in found] == [0.9, -0.4, 0.0]


def test_an_influence_without_a_direction_has_an_index_but_no_correlation() -> None:
    random = np.random.default_rng(5)
    drawn = {"angle": random.uniform(-1.0, 1.0, 2000), "other": random.uniform(size=2000)}
    strongest = influences(drawn, drawn["angle"] ** 2)[0]
    assert strongest.parameter == "angle"
    assert strongest.first_order > 0.95
    assert abs(strongest.correlation) < 0.1


def test_a_choice_of_texts_and_a_grid_have_indices() -> None:
    fine, coarse = np.meshgrid(np.linspace(0.0, 1.0, 40), np.arange(25.0))
    drawn = {"fine": fine.ravel(), "coarse": coarse.ravel(), "law": np.array(["a", "b"] * 500)}
    values = drawn["fine"] + np.where(drawn["law"] == "a", 1.0, 0.0)
    by_name = {entry.parameter: entry for entry in influences(drawn, values)}
    assert math.isnan(by_name["law"].correlation)
    assert by_name["law"].first_order > 0.6
    assert not by_name["coarse"].clear


def test_too_few_runs_or_equal_ones_have_no_indices() -> None:
    random = np.random.default_rng(6)
    few = random.normal(size=FEWEST - 1)
    assert influences({"x": few}, few) == []
    assert influences({"x": random.normal(size=200)}, np.ones(200)) == []
