"""Identification in a steady current: it is estimated with the hull, one a run, and does not go into the hull data."""

import math

import pytest
from compiling import only_compiled
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from otter_runs import OTTER, otter

from vessel_hsmc_ros.studies.identification.estimate import identify
from vessel_hsmc_ros.studies.identification.page import HeldOut, explanations, parameters_table, steady_load, towards
from vessel_hsmc_ros.studies.identification.types import DIAGONAL_INERTIA, WINDOW, Identified, model, predict

currents = st.builds(
    lambda speed, direction: (speed * math.cos(direction), speed * math.sin(direction)),
    st.floats(0.0, 0.4),
    st.floats(-math.pi, math.pi),
)


def held_out(found: Identified, current: tuple[float, float]) -> HeldOut:
    """Another run of the Otter, judged as a run that was not used."""
    run = otter(7, 10.0, rich=True, held=True, current=current)._replace(name="other")
    prediction = predict(found.values, run, WINDOW, found.inputs)
    return HeldOut(run, prediction, None, steady_load(found.values, run, WINDOW, found.inputs))


@pytest.mark.long
@only_compiled
# The same draws each time: of many estimates, some lie beyond three standard errors.
@settings(max_examples=4, derandomize=True, phases=[Phase.generate])
@given(currents, currents, st.integers(0, 100), st.lists(st.floats(0.7, 1.4), min_size=6, max_size=6))
def test_the_hull_and_the_current_of_each_run_are_found_together(
    first: tuple[float, float], second: tuple[float, float], seed: int, factors: list[float]
) -> None:
    names = [*DIAGONAL_INERTIA, "surge_damping", "sway_damping", "yaw_damping"]
    hull = OTTER | {name: factor * OTTER[name] for name, factor in zip(names, factors, strict=True)}
    runs = [otter(seed + k, 10.0, rich=True, held=True, current=each, hull=hull) for k, each in enumerate((first, second))]
    found = identify(runs, model("coupled"))
    for name in (*DIAGONAL_INERTIA, "surge_damping"):
        assert abs(found.values[name] - hull[name]) < 3.0 * found.standard_errors[name]
        assert found.values[name] == pytest.approx(hull[name], rel=0.04)
    for current, flow in zip((first, second), found.currents, strict=True):
        assert flow[:2] == pytest.approx(current, abs=0.005)


@pytest.mark.long
@only_compiled
def test_a_current_neither_changes_the_hull_nor_is_it_part_of_the_vessel() -> None:
    still, moving = (identify([otter(0, 10.0, rich=True, held=True, current=(0.0, y))], model("coupled")) for y in (0.0, 0.3))
    for name in (*DIAGONAL_INERTIA, "surge_damping"):
        assert abs(moving.values[name] - still.values[name]) < 3.0 * moving.standard_errors[name]
    assert not any("residuals" in line for line in (*still.warnings, *moving.warnings))
    (line,) = [line for line in parameters_table(moving) if line[0].startswith("current")]
    assert line[0] == "current of run 1"
    assert line[1] == towards(*moving.currents[0][:2], "m/s")
    assert moving.currents[0][:2] == pytest.approx((0.0, 0.3), abs=0.005)
    assert not any("current" in name for name in (*moving.vessel_values(), *moving.inputs, *moving.parameters))
    assert still.currents[0][:2] == (0.0, 0.0)  # a current that explains little is not estimated

    judged = [held_out(moving, current) for current in ((0.0, 0.0), (0.0, -0.25))]
    (sentence,) = explanations(moving, judged)
    assert sentence.startswith("other: a steady current of 0.2")
    assert "towards -90° from x explains the position error" in sentence
    assert (judged[1].load.x, judged[1].load.y) == pytest.approx((0.0, -0.25), abs=0.01)
