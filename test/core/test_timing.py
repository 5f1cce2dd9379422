from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.core.timing import RateGrid, seconds

rates = st.floats(1.0, 1000.0).map(lambda rate: round(rate, 3))


def test_stamps_of_100_hz_are_exact() -> None:
    grid = RateGrid(100.0)
    assert [grid.stamp(k) for k in (0, 1, 7, 360_000)] == [0, 10_000_000, 70_000_000, 3_600_000_000_000]


def test_a_period_of_a_third_of_a_second_does_not_drift_in_a_year() -> None:
    grid = RateGrid(3.0)
    year = 365 * 24 * 3600
    assert grid.stamp(3 * year) == year * 1_000_000_000


@given(rates, st.integers(0, 10**9))
def test_every_instant_is_found_by_its_own_stamp(rate: float, k: int) -> None:
    grid = RateGrid(rate)
    assert grid.index(grid.stamp(k)) == k
    assert grid.index(grid.stamp(k + 1) - 1) == k


@settings(max_examples=40)
@given(rates, rates, st.integers(1, 300))
def test_arrays_of_instants_are_those_of_single_calls(rate: float, other: float, count: int) -> None:
    grid, stamps = RateGrid(rate), RateGrid(other).stamps(count)
    assert stamps.tolist() == [RateGrid(other).stamp(k) for k in range(count)]
    assert grid.indices(stamps).tolist() == [grid.index(stamp) for stamp in stamps.tolist()]


def test_a_rate_with_six_decimals_stays_exact_in_arrays() -> None:
    grid = RateGrid(999.999999)
    stamps = grid.stamps(100_000)
    assert stamps[-1] == grid.stamp(99_999)
    assert grid.indices(stamps[-3:] - 1).tolist() == [99_996, 99_997, 99_998]


def test_a_slow_grid_divides_its_integer_multiples() -> None:
    assert RateGrid(50.0).divides(RateGrid(100.0))
    assert RateGrid(30.0).divides(RateGrid(90.0))
    assert not RateGrid(30.0).divides(RateGrid(100.0))
    assert not RateGrid(100.0).divides(RateGrid(50.0))


def test_nanoseconds_are_converted_to_seconds() -> None:
    assert seconds(2_500_000_000) == 2.5
