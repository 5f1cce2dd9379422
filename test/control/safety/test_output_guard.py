"""The output guard, the bounded change of a command, and the codes of their reasons."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vessel_hsmc_ros.control.safety.parameters import Operation, Reason, SafetyParameters, check_safety
from vessel_hsmc_ros.control.safety.supervision import towards, violation
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.scenario.parameters import ControllerParameters
from vessel_hsmc_ros.scenario.scenario import load_scenario

LIMITS, FREE = (100.0, 40.0), (math.inf, math.inf)
numbers = st.floats(-1e12, 1e12)
rates = st.floats(1e-3, 1e12)


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        ((100.0, -40.0), Reason.NONE),
        ((math.nan, 0.0), Reason.COMMAND_NOT_FINITE),
        ((0.0, -math.inf), Reason.COMMAND_NOT_FINITE),
        ((100.1, 0.0), Reason.COMMAND_LIMIT),
        ((-100.1, 0.0), Reason.COMMAND_LIMIT),
        ((0.0, -40.1), Reason.COMMAND_LIMIT),
    ],
)
def test_the_guard_finds_what_is_not_finite_or_above_a_limit(command: tuple[float, float], reason: Reason) -> None:
    assert violation(command, (0.0, 0.0), LIMITS, FREE, 0.1) is reason


def test_the_guard_finds_a_change_above_a_rate_in_either_component() -> None:
    assert violation((10.0, 4.0), (0.0, 0.0), LIMITS, (100.0, 40.0), 0.1) is Reason.NONE
    assert violation((10.1, 0.0), (0.0, 0.0), LIMITS, (100.0, 40.0), 0.1) is Reason.COMMAND_RATE
    assert violation((0.0, -4.1), (0.0, 0.0), LIMITS, (100.0, 40.0), 0.1) is Reason.COMMAND_RATE


@given(numbers, numbers, rates, st.floats(1e-3, 1.0))
def test_a_handover_never_exceeds_its_rate_and_never_overshoots(start: float, end: float, rate: float, period: float) -> None:
    moved, _ = towards((start, 0.0), (end, 0.0), (rate, 1.0), period)
    assert abs(moved - start) <= rate * period
    assert min(start, end) <= moved <= max(start, end)
    assert moved == end or abs(moved - start) >= rate * period * (1.0 - 1e-6) - 1e-3 * abs(start) * 1e-12


def test_the_codes_are_those_of_the_message() -> None:
    messages = pytest.importorskip("vessel_hsmc_msgs.msg")
    constants = {name: getattr(messages.ControlState, name) for name in [*Operation.__members__, *Reason.__members__]}
    assert constants == {**Operation.__members__, **Reason.__members__}


def test_every_reason_has_a_text_and_a_level() -> None:
    assert all(reason.text and reason.level in ("ok", "warn", "error") for reason in Reason)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"action": "fallback", "law": "los_pid"},
            "fallback_law must be one of hier",
        ),
        ({"action": "fallback", "fallback_law": "no_law"}, "with law guided (got no_law)"),
        ({"fresh_samples": 0}, "fresh_samples must be an integer from 1 to 10000"),
        ({"ramp_time": 0.0}, "ramp_time must be a finite number from 0.1 to 600 s"),
        ({"action": "wait"}, "action must be one of zero, ramp, hold, brake, fallback"),
        ({"monitors.saturation_safe": 1.0}, "saturation_warning must be at most saturation_safe = 1 s"),
        *(
            ({f"monitors.{name}_warning": 50.0, f"monitors.{name}_safe": 49.0}, f"{name}_warning must be")
            for name in ("not_moving", "saturation", "innovation", "velocity", "heading")
        ),
        ({"surge_force_rate": 100.0}, "surge_force_rate must be at least 40000, at which the command"),
        ({"yaw_moment_rate": 100.0}, "yaw_moment_rate must be at least 600000, at which the command"),
        ({"yaw_moment_rate": math.nan}, "yaw_moment_rate must be a number"),
    ],
)
def test_contradictory_parameters_are_refused_in_one_line(values: dict[str, object], message: str) -> None:
    law = {"controller.law": values.pop("law", "guided")}
    with pytest.raises(ParameterError) as raised:
        load_scenario("case2_tracking", law | {f"controller.safety.{name}": value for name, value in values.items()})
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


def test_the_default_parameters_do_not_contradict_each_other() -> None:
    check_safety(SafetyParameters(action="fallback"), "guided", ("guided", "los_pid"), (1e9, 1e9))
    assert ControllerParameters().safety == SafetyParameters()
