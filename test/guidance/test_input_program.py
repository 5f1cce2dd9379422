import math

import pytest

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.guidance.programs import (
    RampParameters,
    SineParameters,
    StepsParameters,
    input_rates,
    input_value,
    program,
)
from vessel_hsmc_ros.simulation.offline import load_scenario

NO_SINE, NO_STEPS, NO_RAMP = SineParameters(), StepsParameters(), RampParameters()


def test_with_default_groups_an_input_is_its_constant() -> None:
    p = program(7.0, NO_SINE, NO_STEPS, NO_RAMP)
    for time in (0.0, 1.0, 1e6):
        assert input_value(p, 0.0, time) == 7.0
        assert input_rates(p, time) == (0.0, 0.0)


def test_a_sine_with_its_phase() -> None:
    p = program(0.0, SineParameters(1e6, 0.05, math.pi / 2), NO_STEPS, NO_RAMP)
    assert input_value(p, 0.0, 0.0) == pytest.approx(1e6)
    assert input_value(p, 0.0, math.pi / 0.05) == pytest.approx(-1e6)


def test_a_step_holds_from_its_instant_on_whatever_the_rounding() -> None:
    p = program(0.0, NO_SINE, StepsParameters((0.01, 0.29), (5.0, 2.0)), NO_RAMP)
    assert [input_value(p, 0.0, k * 0.01) for k in (0, 1, 28, 29, 1000)] == [0.0, 5.0, 5.0, 2.0, 2.0]
    assert all(
        input_value(program(0.0, NO_SINE, StepsParameters((k / 100,), (1.0,)), NO_RAMP), 0.0, k * 0.01) for k in range(1000)
    )


def test_a_ramp_interpolates_its_points_and_is_constant_outside() -> None:
    p = program(0.0, NO_SINE, NO_STEPS, RampParameters((10.0, 20.0, 40.0), (1.0, 3.0, -1.0)))
    assert [input_value(p, 0.0, t) for t in (0.0, 10.0, 15.0, 20.0, 30.0, 40.0, 99.0)] == pytest.approx([1, 1, 2, 3, 1, -1, -1])
    assert [input_rates(p, t)[0] for t in (0.0, 10.0, 15.0, 20.0, 30.0, 40.0)] == pytest.approx([0, 0.2, 0.2, -0.2, -0.2, 0])


def test_constant_sine_steps_and_ramp_add_up() -> None:
    p = program(
        1.0, SineParameters(2.0, 0.5), StepsParameters((0.0, 4.0), (10.0, 20.0)), RampParameters((0.0, 10.0), (0.0, 100.0))
    )
    assert input_value(p, 0.0, 3.0) == pytest.approx(1.0 + 2.0 * math.sin(1.5) + 10.0 + 30.0)
    assert input_value(p, 0.0, 5.0) == pytest.approx(1.0 + 2.0 * math.sin(2.5) + 20.0 + 50.0)


@pytest.mark.parametrize("time", [0.3, 7.0, 12.5])
def test_rates_are_the_derivatives(time) -> None:
    p = program(1.0, SineParameters(0.35, 0.8, 0.2), NO_STEPS, RampParameters((0.0, 10.0, 20.0), (0.0, 2.0, 3.0)))
    h = 1e-4
    before, now, after = (input_value(p, 0.0, time + k * h) for k in (-1, 0, 1))
    assert input_rates(p, time) == pytest.approx(((after - before) / (2 * h), (after - 2 * now + before) / h**2), abs=1e-6)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"yaw_moment_steps.times": [0.0, 5.0]},
            r"yaw_moment_steps\.times must be as many as .*yaw_moment_steps\.values = \[0\.0\].*\(got \[0\.0, 5\.0\]\)",
        ),
        (
            {"surge_force_ramp.times": [5.0, 5.0], "surge_force_ramp.values": [0.0, 1.0]},
            r"surge_force_ramp\.times must increase \(got \[5\.0, 5\.0\]\)",
        ),
        ({"yaw_moment_steps.times": [], "yaw_moment_steps.values": []}, "at least one"),
        ({"yaw_moment_sine.amplitude": math.inf}, "finite"),
    ],
)
def test_an_inconsistent_input_is_rejected_with_its_name(changes, message) -> None:
    with pytest.raises(ParameterError, match=message):
        load_scenario("case2_tracking", {f"reference_ship.{name}": value for name, value in changes.items()})
