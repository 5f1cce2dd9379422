"""The loops of the guided law are the looser, the less is known of the actuators."""

from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.guided.guidance import Gains
from vessel_hsmc_ros.control.guided.parameters import GuidedParameters, gains
from vessel_hsmc_ros.control.interface.known_vessel import INSTANT, KnownVessel

TIGHT = {"k_p": 1, "R_u": -1}
"""Numbers of a tight loop that are larger, 1, or smaller, -1, than those of a loose one."""


def of(declared: bool, identified: bool, **coupling: Any) -> Gains:
    """Gains of a ship without lags, declared or identified; undeclared ones have the same numbers but for what is assumed."""
    vessel = KnownVessel(**INSTANT if declared else {"surge_lag": 0.0, "yaw_lag": 0.0}, **coupling)
    return gains(GuidedParameters(), vessel.as_controlled(), 0.05, identified=identified)


def test_identified_actuators_are_doubted_more_than_declared_ones_and_less_than_unknown_ones() -> None:
    declared, identified, unknown = of(True, False), of(True, True), of(False, False)
    for name, sign in TIGHT.items():
        numbers = [sign * getattr(each, name) for each in (declared, identified, unknown)]
        assert numbers == sorted(numbers, reverse=True)
        assert len(set(numbers)) == 3
    surge_noise = [each.Q[3] for each in (declared, identified, unknown)]
    assert surge_noise == sorted(surge_noise, reverse=True)
    assert len(set(surge_noise)) == 3
    assert np.abs(declared.table).max() > np.abs(unknown.table).max()


def test_a_pivot_far_ahead_is_doubted_as_much_as_unknown_actuators_whether_these_are_identified_or_not() -> None:
    far: dict[str, Any] = {"sway_yaw_inertia": 0.3 * 32.0 * 177.9e3}
    assert of(True, False, **far).k_p == pytest.approx(of(False, False).k_p) == pytest.approx(of(True, True, **far).k_p)
