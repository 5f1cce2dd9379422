"""Parameters of the connections with an autopilot: lists that fit each other, and the wrench of shares of thrust."""

import re
from typing import Any

import pytest

from vessel_hsmc_ros.boats.autopilot import SURFACE_MODES
from vessel_hsmc_ros.boats.parameters import MODES, MavlinkParameters
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError

TWIN: dict[str, Any] = {
    "form": "channels",
    "vessel.thrusters.names": ["left", "right"],
    "vessel.thrusters.y": [0.5, -0.25],
    "vessel.thrusters.x": [-2.0],
    "vessel.thrusters.thrust_ahead": [100.0, 80.0],
    "vessel.thrusters.thrust_astern": [50.0, 30.0],
}


def built(**values: Any) -> MavlinkParameters:
    return schema.build(MavlinkParameters, {**TWIN, **values}, "mavlink")


@pytest.mark.parametrize("name", ["channels", "servos", "stick_channels"])
@pytest.mark.parametrize("numbers", [[1.0, 1.0], [1.0, 2.5]])
def test_a_channel_that_two_thrusters_would_have_or_that_is_between_two_is_refused(name: str, numbers: list[float]) -> None:
    """Of two commands on one channel only the last would be sent."""
    with pytest.raises(ParameterError, match=re.escape(f"mavlink.{name} must be different whole numbers (got {numbers})")):
        built(**{name: numbers})
    built(**{name: [4.0, 2.0]})


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"channels": [1.0]}, "mavlink.channels must be 2 numbers, one for each thruster (got [1.0])"),
        ({"servos": [1.0]}, "mavlink.servos must be 2 numbers, or none (got [1.0])"),
        ({"radio_range": [1900.0, 1100.0]}, "mavlink.radio_range must be increasing widths (got [1900.0, 1100.0])"),
        ({"vessel.thrusters.kinds": ["azimuth"]}, "mavlink.form must be manual or guided with thrusters that turn"),
        (
            {"vessel.thrusters.kinds": ["azimuth"], "form": "manual"},
            "mavlink.servos must be [] with thrusters that turn (got [1.0, 3.0])",
        ),
    ],
)
def test_lists_that_do_not_fit_the_thrusters_are_refused_with_what_does(values: dict[str, Any], reason: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(reason)):
        built(**values)
    built(servos=[])


@pytest.mark.parametrize("left", [1.0, 0.0, -0.6])
@pytest.mark.parametrize("right", [0.5, 0.0, -1.0])
def test_each_share_is_one_of_the_thrust_in_its_own_direction(left: float, right: float) -> None:
    port, starboard = left * (100.0 if left > 0.0 else 50.0), right * (80.0 if right > 0.0 else 30.0)
    assert built().applied_wrench((left, right)) == pytest.approx((port + starboard, -0.5 * port + 0.25 * starboard))
    plain = MavlinkParameters(surge_force_limit=300.0, yaw_moment_limit=70.0)
    assert plain.applied_wrench((left, right)) == pytest.approx((150.0 * (left + right), 35.0 * (right - left)))


@pytest.mark.parametrize("form", MODES)
def test_the_mode_is_that_of_the_form_unless_another_is_given(form: str) -> None:
    assert built(form=form).mode_number == SURFACE_MODES["GUIDED" if form == "guided" else "MANUAL"]
    assert built(form=form, mode="STEERING").mode_number == SURFACE_MODES["STEERING"]
