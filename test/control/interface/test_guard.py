"""Calls of a law's code: what it does wrong becomes one line with its name, file and line."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros import Acceleration, Law, Motion, Terms, parameter
from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import guarded, guarded_step
from vessel_hsmc_ros.core.exceptions import ControlError, LawError, ParameterError

REST = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
STILL = Acceleration(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Gains:
    gain: float = parameter(2.0, "A gain.")


class Returns(Law[Gains]):
    """A law that returns a given value, or raises it."""

    name = "returns"

    def __init__(self, value: Any) -> None:
        super().__init__(Gains(), KnownVessel(), 0.01)
        self.value = value

    def step(self, *_: object) -> Any:
        if isinstance(self.value, BaseException):
            raise self.value
        return self.value


def step(value: Any) -> tuple[tuple[float, float], Terms]:
    return guarded_step(Returns(value), REST, REST, STILL)


def test_values_of_numpy_become_plain_floats_and_flags() -> None:
    terms = Terms(heading_error=np.float32(0.5), yaw_saturated=np.True_, yaw_weights=[1, 2])  # type: ignore[arg-type]
    wrench, plain = step((np.array([1.0, 2.0]), terms))
    assert wrench == (1.0, 2.0)
    assert all(type(value) is float for value in wrench)
    assert plain.heading_error == 0.5
    assert type(plain.heading_error) is float
    assert plain.yaw_saturated is True
    assert plain.yaw_weights.dtype == np.float64


WRONG: list[Any] = [None, 3.0, (1.0, 2.0), ((1.0, 2.0, 3.0), Terms()), ((1.0, 2.0), {}), ((1.0, 2.0), ()), (("a", 2.0), Terms())]
WRONG += [((1.0, 2.0), Terms(sway_error=text)) for text in ("a", "1")]  # type: ignore[arg-type]
WRONG += [(("1", "2"), Terms()), ((10**400, 2.0), Terms())]


@pytest.mark.parametrize("wrong", WRONG, ids=repr)
def test_a_result_of_another_form_is_an_error_that_names_the_law_and_the_form(wrong: Any) -> None:
    with pytest.raises(LawError, match=r"law returns returned .*: step returns \(surge force, yaw moment\), Terms\(...\)"):
        step(wrong)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_wrench_that_is_not_finite_is_an_error_that_names_the_law(value: float) -> None:
    with pytest.raises(ControlError, match=rf"command of law returns must be finite numbers .got {value} N and 2.0 N·m") as error:
        step(((value, 2.0), Terms()))
    assert not isinstance(error.value, LawError)


def test_an_exception_in_step_names_law_file_line_and_reason_in_one_line() -> None:
    with pytest.raises(LawError, match=r"^law returns failed at .*test_guard\.py:\d+: ZeroDivisionError: a b$"):
        step(ZeroDivisionError("a\nb"))


def test_an_exit_in_step_is_an_error_too_and_not_the_end_of_the_program() -> None:
    with pytest.raises(LawError, match=r"^law returns failed at .*test_guard\.py:\d+: SystemExit: 0$"):
        step(SystemExit(0))


def inner() -> float:
    return float(np.linalg.inv(np.zeros((2, 2)))[0, 0])  # fails here, in a file that is not the law's


class Calls(Returns):
    """A law whose step fails in a function of its own file, by a library."""

    def step(self, *_: object) -> Any:
        return (inner(), 0.0), Terms()


def test_the_line_of_an_exception_is_the_last_one_of_the_laws_own_file_that_led_to_it() -> None:
    line = inner.__code__.co_firstlineno + 1
    with pytest.raises(LawError, match=rf"^law returns failed at .*test_guard\.py:{line}: LinAlgError: Singular matrix$"):
        guarded_step(Calls(None), REST, REST, STILL)


def test_an_error_of_this_package_passes_unchanged() -> None:
    with pytest.raises(ControlError, match=r"^undefined here$"):
        step(ControlError("undefined here"))


def test_an_exception_in_the_construction_refuses_the_parameters() -> None:
    with (
        pytest.raises(ParameterError, match=r"law returns failed at .*: KeyError: 'a'$"),
        guarded(Returns, ParameterError),
    ):
        raise KeyError("a")
