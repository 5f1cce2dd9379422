"""Inertias from much excitation and from little, with a force that is sampled while it changes."""

from functools import cache

import numpy as np
import pytest
from compiling import only_compiled
from durations import rest_long
from otter_runs import OTTER, otter

from vessel_hsmc_ros.core.kernel import Array
from vessel_hsmc_ros.studies.identification.estimate import identify
from vessel_hsmc_ros.studies.identification.measurements import few_reversals, reversals
from vessel_hsmc_ros.studies.identification.types import DELAY, DIAGONAL_INERTIA, Identified, Measurements, model, windows


@cache
def identified(seed: int, rich: bool, held: bool) -> Identified:
    return identify([otter(seed, 10.0, rich, held)], model("coupled"))


@pytest.mark.parametrize("seed", rest_long([0, 1]))
def test_from_one_turn_to_each_side_the_inertias_are_found_as_well_as_stated(seed: int) -> None:
    found = identified(seed, rich=False, held=False)
    for name in DIAGONAL_INERTIA:
        assert abs(found.values[name] - OTTER[name]) < 3.0 * found.standard_errors[name]
        assert found.standard_errors[name] < 0.4 * OTTER[name]


@pytest.mark.long
def test_too_few_reversals_are_a_warning_with_what_to_sail() -> None:
    poor, rich = (identified(0, rich=rich, held=False).warnings for rich in (False, True))
    for name, remedy in (("surge", "speed steps"), ("sway", "zig-zags"), ("yaw", "zig-zags")):
        (line,) = [line for line in poor if line.startswith(f"{name}_inertia rests on 1 reversal of")]
        assert f"sail {remedy}" in line
    assert not any("rests on" in line for line in rich)


@pytest.mark.long
@pytest.mark.parametrize("held", [False, True])
def test_a_force_may_be_held_between_samples_or_sampled_while_it_changes(held: bool) -> None:
    found = identified(0, rich=True, held=held)
    assert found.inputs.get(DELAY, 0.0) == pytest.approx(0.0 if held else -0.05, abs=0.01)
    assert found.values["yaw_inertia"] == pytest.approx(OTTER["yaw_inertia"], rel=0.03)
    assert found.values["surge_inertia"] == pytest.approx(OTTER["surge_inertia"], rel=0.015)


@pytest.mark.long
@only_compiled
def test_a_motion_that_the_wrench_does_not_explain_is_a_warning() -> None:
    run = otter(0, 10.0, rich=True, held=True)
    gust = np.where(np.sin(run.time) > 0.0, 0.3 * OTTER["yaw_damping"], 0.0)
    disturbed = run._replace(wrench=run.wrench + np.column_stack([0.0 * gust, 0.0 * gust, gust]))
    assert any("times the noise of its sensor" in line for line in identify([disturbed], model("coupled")).warnings)
    assert not any("times the noise" in line for line in identified(0, rich=True, held=True).warnings)


@pytest.mark.parametrize(
    ("force", "expected"),
    [
        ([0.0] * 4, 0),
        ([0.0, 1.0, 0.0, 1.0], 3),
        ([0.0, 0.4, 0.0, 1.0, 0.6, 1.0], 1),
        ([-1.0, 0.0, 1.0, 0.0, -1.0], 2),
    ],
)
def test_a_force_reverses_when_it_goes_from_one_end_of_its_range_to_the_other(force: list[float], expected: int) -> None:
    assert reversals(np.array(force)) == expected


def still(wrench: Array, interval: float = 0.5) -> Measurements:
    time = interval * np.arange(len(wrench), dtype=np.float64)
    return Measurements(time, np.zeros((len(time), 3)), np.zeros((len(time), 3)), wrench)


def test_a_sway_force_counts_where_there_is_one() -> None:
    wrench = np.zeros((100, 3))
    wrench[:, 0] = wrench[:, 2] = np.sign(np.sin(0.5 * np.arange(100)))
    assert few_reversals([still(wrench)], DIAGONAL_INERTIA) == []
    wrench[50:, 1] = 1.0
    (line,) = few_reversals([still(wrench)], DIAGONAL_INERTIA)
    assert line.startswith("sway_inertia rests on 1 reversal of the sway force")


def test_the_reversals_of_several_runs_add_up() -> None:
    wrench = np.zeros((100, 3))
    wrench[:, 0] = wrench[:, 2] = np.sign(np.sin(0.12 * np.arange(100)))
    assert len(few_reversals([still(wrench)], ["yaw_inertia"])) == 1, "3 in each"
    assert few_reversals([still(wrench), still(-wrench)], ["yaw_inertia"]) == []


@pytest.mark.parametrize(("delay", "expected"), [(0.0, [0, 1, 4, 9]), (-0.25, [0.5, 2.5, 6.5, 9]), (0.5, [0, 0, 1, 4])])
def test_a_delayed_force_is_the_mean_of_the_held_one_over_each_interval(delay: float, expected: list[float]) -> None:
    values = np.array([0.0, 1.0, 4.0, 9.0])
    runs = [still(np.outer(values, [1.0, 2.0, 3.0])), still(np.outer(values[::-1], [1.0, 2.0, 3.0]))]
    first, second = windows(runs, 2.0).delayed(delay)
    np.testing.assert_allclose(first, np.outer(expected, [1.0, 2.0, 3.0]), atol=1e-12)
    if delay <= 0.0:
        np.testing.assert_allclose(second[-1], 0.0, atol=1e-12)


def test_a_delayed_force_is_the_mean_over_intervals_of_unlike_lengths_too() -> None:
    wrench = np.outer([1.0, 2.0, 3.0, 4.0], [1.0, 0.0, -1.0])
    run = still(wrench)._replace(time=np.array([0.0, 1.0, 3.0, 4.0]))
    (delayed,) = windows([run], 4.0).delayed(-0.5)
    np.testing.assert_allclose(delayed, np.outer([1.5, 2.25, 3.5, 4.0], [1.0, 0.0, -1.0]), atol=1e-12)
