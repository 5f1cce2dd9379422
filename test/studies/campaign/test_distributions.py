"""Distributions of drawn parameters: their inverses, and the truncation to the range of a parameter."""

import math

import numpy as np
import pytest
from scipy import stats

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.studies.campaign.distributions import (
    Choice,
    Continuous,
    Grid,
    Normal,
    Uniform,
    make_drawn,
    parse_distribution,
)

U = (1e-9, 0.1, 0.5, 0.9, 1.0 - 1e-9)


@pytest.mark.parametrize(("low", "high"), [(-math.inf, math.inf), (0.0, 4.0), (2.5, math.inf), (-math.inf, -3.0), (9.0, 10.0)])
def test_a_normal_distribution_is_truncated_to_the_range(low: float, high: float) -> None:
    made = Normal(1.0, 2.0).truncated(low, high)
    assert made is not None
    expected = stats.truncnorm((low - 1.0) / 2.0, (high - 1.0) / 2.0, 1.0, 2.0)
    assert [made.quantile(u) for u in U] == pytest.approx(expected.ppf(U).tolist(), rel=1e-7)
    assert all(low <= made.quantile(u) <= high for u in (0.0, *U, 1.0))


def test_a_tail_far_from_the_mean_keeps_its_shape() -> None:
    made = Normal(0.0, 1.0).truncated(20.0, 30.0)
    assert made is not None
    values = [made.quantile(u) for u in U]
    assert values == sorted(values)
    assert len(set(values)) == len(U)


def test_a_lognormal_distribution_has_its_median_and_stays_in_the_range() -> None:
    assert Normal(math.log(3.0), 0.5, logarithmic=True).quantile(0.5) == pytest.approx(3.0)
    made = Normal(math.log(3.0), 0.5, logarithmic=True).truncated(2.0, 4.0)
    assert made is not None
    assert made.quantile(0.0) == pytest.approx(2.0)
    assert made.quantile(1.0) == pytest.approx(4.0)


@pytest.mark.parametrize("distribution", [Uniform(0.0, 1.0), Normal(0.0, 0.01), Normal(0.0, 0.001, logarithmic=True)])
def test_a_distribution_outside_of_the_range_has_no_value(distribution: Uniform | Normal) -> None:
    assert distribution.truncated(5.0, 6.0) is None
    assert distribution.truncated(-6.0, -5.0) is None


def test_the_values_of_a_choice_are_equally_likely() -> None:
    values = [Choice(("a", "b", "c")).quantile(u) for u in np.linspace(0.0, 1.0, 301)[:-1]]
    assert [values.count(name) for name in "abc"] == [100, 100, 100]


def test_a_grid_includes_its_ends() -> None:
    assert parse_distribution({"grid": [0, 0.3, 4]}) == (Grid((0.0, 0.1, 0.2, 0.3)), False)


@pytest.mark.parametrize(
    ("drawn", "expected"), [((0.5, 1.5, 2.5, 3.5), [1, 2, 3, 4]), ((0.49, 1.51, 2.0), [0, 2, 2]), ((6.5, 7.5), [7, 8])]
)
def test_the_values_of_an_integer_halfway_between_two_are_each_rounded_up_so_that_a_grid_repeats_none(
    drawn: tuple[float, ...], expected: list[int]
) -> None:
    made = make_drawn("vessel_sim.seed", {"grid": [0.5, 2.5, 3]}, load_scenario("case2_tracking"))
    assert [made.value(value) for value in drawn] == expected


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (3.0, r"must be one of \{uniform: \[low, high\], loguniform"),
        ({"triangle": [1, 2]}, "must be one of {uniform"),
        ({"uniform": [1, 2], "normal": [1, 2]}, "must be one of {uniform"),
        ({"relative": True}, "must be one of {uniform"),
        ({"uniform": [1, 2, 3]}, r"uniform must be \[low, high\].*got \[1, 2, 3\]"),
        ({"uniform": [2, 1]}, "with low <= high"),
        ({"uniform": ["a", 1]}, "finite numbers"),
        ({"uniform": [True, 1]}, "finite numbers"),
        ({"uniform": 3}, r"must be \[low, high\]"),
        ({"normal": [0, 0]}, "deviation > 0"),
        ({"lognormal": [-1, 1]}, "above 0"),
        ({"choice": []}, "at least one value"),
        ({"grid": [0, 1]}, r"must be \[start, stop, count\]"),
        ({"grid": [0, 1, 1]}, "count from 2"),
        ({"grid": [0, 1, 2.5]}, "integer count"),
        ({"uniform": [1, 2], "relative": 1}, "relative must be true or false .got 1"),
    ],
)
def test_another_form_is_refused_with_the_allowed_one(given: object, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        parse_distribution(given)


HEADING = "reference_ship.lawnmower.heading"


@pytest.mark.parametrize("base", [3.0, -3.0])
@pytest.mark.parametrize(
    ("given", "low", "high"),
    [
        ({"uniform": [0.5, 1.5]}, 0.5, 1.5),
        ({"uniform": [0.5, 4.0]}, 0.5, 2.1),
        ({"uniform": [-4.0, 1.0]}, -2.1, 1.0),
        ({"loguniform": [0.25, 4.0]}, 0.25, 2.1),
        ({"normal": [1.0, 2.0]}, -2.1, 2.1),
        ({"lognormal": [1.0, 2.0]}, 0.0, 2.1),
    ],
)
def test_factors_on_a_base_value_of_either_sign_stay_in_the_range_of_the_parameter(
    base: float, given: dict[str, list[float]], low: float, high: float
) -> None:
    """The parameter takes -6.3 to 6.3."""
    drawn = make_drawn(HEADING, {**given, "relative": True}, load_scenario("case2_tracking", {HEADING: base}))
    assert isinstance(drawn.distribution, Continuous)
    ends = [drawn.value(drawn.distribution.quantile(u)) for u in (0.0, 1.0)]
    assert ends == pytest.approx([base * low, base * high])
    values = [drawn.value(drawn.distribution.quantile(u)) / base for u in U]
    assert values == sorted(values)
    assert len(set(values)) == len(U)
