"""The thrust curve of a speed controller, its inverse, and what is no curve."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.boats.parameters import PulseParameters
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.thruster_layout import thrust_curve

MEASURED = thrust_curve(1490.0, 30.0, (1100.0, 1300.0, 1700.0, 1900.0), (-40.0, -10.0, 12.0, 50.0), "drive.pwm")


@given(st.floats(-40.0, 50.0))
def test_the_pulse_of_a_thrust_gives_that_thrust(thrust: float) -> None:
    assert MEASURED.thrust(MEASURED.pulse(thrust)) == pytest.approx(thrust, abs=1e-9)


@given(st.floats(-40.0, 50.0).filter(bool))
def test_a_thrust_is_never_commanded_within_the_deadband(thrust: float) -> None:
    assert abs(MEASURED.pulse(thrust) - 1490.0) >= 30.0


def test_no_thrust_is_neutral_and_thrusts_beyond_the_measured_ones_are_limited() -> None:
    assert (MEASURED.pulse(0.0), MEASURED.pulse(1e3), MEASURED.pulse(-1e3)) == (1490.0, 1900.0, 1100.0)
    assert (MEASURED.thrust(1510.0), MEASURED.thrust(2000.0), MEASURED.thrust(1000.0)) == (0.0, 50.0, -40.0)


@pytest.mark.parametrize(
    ("changes", "allowed"),
    [
        ({"curve_thrusts": (1.0,)}, "must have one element for each of 2 curve_pulses"),
        ({"curve_pulses": (1900.0, 1100.0)}, "increasing numbers from 1000 to 2000 µs"),
        ({"curve_thrusts": (50.0, -40.0)}, "must be increasing finite numbers"),
        ({"curve_pulses": (1510.0, 1900.0)}, "must be negative below 1475 µs, positive above 1525 µs .* .got -40 N at 1510 µs"),
        ({"curve_pulses": (1600.0, 1900.0)}, "exchanges ahead and astern"),
        ({"reversed": (0.5,)}, "values of 1 or -1"),
        ({"thrusters": ("port", "port")}, r"drive.pwm.thrusters must name each thruster once \(got \['port', 'port'\]\)"),
        ({"reversed": (1.0, 1.0, 1.0)}, "one or 2 values of 1 or -1"),
    ],
)
def test_what_is_no_curve_is_refused(changes: dict[str, tuple[float, ...]], allowed: str) -> None:
    with pytest.raises(ParameterError, match=allowed):
        PulseParameters(**changes)  # type: ignore[arg-type]
