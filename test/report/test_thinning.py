"""Decimated series keep every peak, in order and in time."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.report.diagrams import buckets, thin, thin_time


def test_a_short_series_is_not_decimated() -> None:
    values = np.arange(100.0)
    chosen = buckets(100, 100)
    assert chosen.size == 1
    assert thin(values, chosen) is values
    assert thin_time(values, chosen) is values


@pytest.mark.parametrize("samples", [101, 199, 360_001])
def test_no_more_values_than_the_limit_remain(samples: int) -> None:
    chosen = buckets(samples, 100)
    assert len(thin(np.zeros(samples), chosen)) == len(thin_time(np.zeros(samples), chosen)) <= 100


@given(
    st.lists(st.floats(allow_nan=True, allow_infinity=True, width=64), min_size=1, max_size=60),
    st.integers(min_value=2, max_value=20),
)
def test_every_bucket_keeps_its_extremes_in_their_order(samples: list[float], limit: int) -> None:
    values = np.array(samples)
    chosen = buckets(len(values), limit)
    thinned = thin(values, chosen)
    if chosen.size == 1:
        return
    for k in range(chosen.number):
        inside = values[k * chosen.size : (k + 1) * chosen.size]
        pair = thinned[2 * k : 2 * k + 2]
        known = inside[~np.isnan(inside)]
        if len(known) == 0:
            assert np.isnan(pair).all()
            continue
        assert min(pair) == min(known)
        assert max(pair) == max(known)
        at_least, at_most = np.flatnonzero(inside == min(known))[0], np.flatnonzero(inside == max(known))[0]
        assert (pair[0] == min(known)) == (at_least <= at_most) or min(known) == max(known)


def test_a_single_spike_remains_and_stays_within_its_bucket() -> None:
    time: Any = np.arange(360_001) * 0.01
    values = np.zeros(360_001)
    values[123_457] = 7e9
    chosen = buckets(len(time), 20_000)
    thinned, times = thin(values, chosen), thin_time(time, chosen)
    assert np.max(thinned) == 7e9
    assert abs(times[np.argmax(thinned)] - time[123_457]) <= chosen.size * 0.01
    assert np.all(np.diff(times) >= 0.0)
