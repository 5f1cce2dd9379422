"""Errors against the legs and turns of a plan: each metric has its own samples, and is none where there are none of these."""

import numpy as np
import pytest

from vessel_hsmc_ros.core.metrics import NO_LEG, TrackErrors, TrackMetrics, per_leg, summarise

LEGS = ([0, 0, 2], [3.0, -4.0, 1.0], [-6.0, 8.0, 2.0])
"""Numbers of legs, errors across and along."""

TURNS = ([0, 2, 2], [-5.0, 12.0, 0.5], [50.0, 60.0, 70.0])
NOWHERE = ([NO_LEG, NO_LEG], [np.nan, np.nan], [np.nan, np.nan])


def errors_of(legs: bool, turns: bool, nowhere: bool, order: int = 1) -> TrackErrors:
    parts = [part for part, wanted in ((LEGS, legs), (TURNS, turns), (NOWHERE, nowhere)) if wanted]
    leg, cross, along = (np.array([value for part in parts for value in part[k]]) for k in range(3))
    turn = np.array([part is TURNS for part in parts for _ in part[0]], bool)
    return TrackErrors(leg.astype(np.int64)[::order], turn[::order], cross.astype(float)[::order], along.astype(float)[::order])


def rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("nowhere", [False, True])
@pytest.mark.parametrize("turns", [False, True])
@pytest.mark.parametrize("legs", [False, True])
def test_each_metric_counts_its_own_samples_alone(legs: bool, turns: bool, nowhere: bool, order: int) -> None:
    found = summarise(errors_of(legs, turns, nowhere, order))
    of_legs = (rms(LEGS[1]), 4.0, rms(LEGS[2])) if legs else (None, None, None)
    for value, expected in zip(found, (*of_legs, rms(TURNS[1]) if turns else None), strict=True):
        assert value == (None if expected is None else pytest.approx(expected))


def test_without_a_plan_there_is_no_metric() -> None:
    assert summarise(None) == TrackMetrics()


@pytest.mark.parametrize("turns", [False, True])
def test_each_leg_with_samples_has_its_errors_without_those_of_its_turn(turns: bool) -> None:
    first, second = per_leg(errors_of(True, turns, True))
    assert [*first] == [0, pytest.approx(rms([3.0, -4.0])), 4.0, pytest.approx(rms([-6.0, 8.0]))]
    assert [*second] == [2, 1.0, 1.0, 2.0]
    assert list(per_leg(errors_of(False, turns, True))) == []
