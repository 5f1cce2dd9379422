"""Pairs of the fixes of two antennas: of one epoch, whatever order, rates, losses and small differences their stamps have."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vessel_hsmc_ros.boats.epochs import Epochs

MILLISECOND = 1_000_000
START = 1_700_000_000_000_000_000
Pair = tuple[int, int]


def arrivals(
    periods: Pair, counts: Pair, delays: list[Pair], lost: set[Pair], jitter: list[Pair], offset: int = START
) -> list[tuple[int, int, int]]:
    """Messages in the order of their arrival: source, true time of the epoch, ns, and stamp."""
    found = []
    for source in (0, 1):
        at = 0
        for k in range(counts[source]):
            epoch, number = offset + k * periods[source] * MILLISECOND, k % len(delays)
            if (source, k) in lost:
                continue
            at = max(at + 1, epoch + delays[number][source] * MILLISECOND)  # a source keeps its own order
            found.append((at, source, epoch, epoch + jitter[k % len(jitter)][source] * MILLISECOND))
    return [(source, epoch, stamp) for _, source, epoch, stamp in sorted(found)]


def paired(given: list[tuple[int, int, int]], epochs: Epochs[int] | None = None) -> list[Pair]:
    """The true times of the pairs."""
    epochs = epochs or Epochs(500 * MILLISECOND)
    return [pair for source, epoch, stamp in given if (pair := epochs.take(source, stamp, epoch)) is not None]


DELAY = st.tuples(st.integers(0, 300), st.integers(0, 300))


@pytest.mark.long
@settings(max_examples=150, deadline=None)
@given(
    st.sampled_from([(50, 50), (100, 100), (200, 200), (1000, 1000), (50, 200), (200, 50), (100, 200), (50, 100)]),
    st.lists(DELAY, min_size=1, max_size=7),
)
def test_every_common_epoch_is_paired_and_no_other_in_any_order_at_any_rate(periods: Pair, delays: list[Pair]) -> None:
    counts = (6000 // periods[0], 6000 // periods[1])
    found = paired(arrivals(periods, counts, delays, set(), [(0, 0)]))
    assert all(first == second for first, second in found)
    common = min(counts[0] * periods[0], counts[1] * periods[1]) // max(periods)
    assert len(found) >= common - 1
    assert found == sorted(set(found))


@settings(max_examples=100, deadline=None)
@given(
    st.sampled_from([50, 100, 200]),
    st.lists(DELAY, min_size=1, max_size=7),
    st.sets(st.tuples(st.integers(0, 1), st.integers(3, 99)), max_size=25),
    st.integers(0, 2**32 - 1),
)
def test_with_lost_messages_and_stamps_of_the_receipt_no_neighbouring_epochs_are_paired(
    period: int, delays: list[Pair], lost: set[Pair], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    jitter = [(int(a), int(b)) for a, b in rng.integers(0, period // 5, (13, 2))]
    found = paired(arrivals((period, period), (100, 100), delays, lost, jitter))
    assert all(first == second for first, second in found)
    assert len(found) >= 100 - 2 * len(lost) - 10


def test_a_clock_that_is_set_back_begins_anew_and_a_silent_antenna_is_noticed() -> None:
    epochs: Epochs[int] = Epochs(500 * MILLISECOND)
    assert not epochs.is_single(START)
    for offset in (START, START - 10**12, START):
        given = arrivals((100, 100), (10, 10), [(0, 50)], set(), [(0, 0)], offset)
        assert len(paired(given, epochs)) == 10
        last = given[-1][2]
        assert not epochs.is_single(last + 400 * MILLISECOND)
        assert epochs.is_single(last + 600 * MILLISECOND)


@pytest.mark.parametrize("source", [0, 1])
def test_what_never_finds_a_partner_is_not_kept(source: int) -> None:
    epochs: Epochs[int] = Epochs(500 * MILLISECOND)
    for k in range(1000):
        assert epochs.take(source, START + k * 50 * MILLISECOND, k) is None
    assert len(epochs._waiting[source]) <= 11
    assert epochs.is_single(START + 1000 * 50 * MILLISECOND)
