"""Inputs of the virtual ship changed while it moves."""

from dataclasses import replace

import numpy as np
import pytest

from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.guidance.programs import ReferenceShip, SineParameters, StepsParameters, VirtualShipParameters

PERIOD = 0.01
SINE = VirtualShipParameters(yaw_moment=0.0, yaw_moment_sine=SineParameters(1e6, 0.5))


def sail(parameters: VirtualShipParameters, steps: int) -> ReferenceShip:
    ship = ReferenceShip(parameters, PERIOD)
    for _ in range(steps):
        ship.advance()
    return ship


def test_a_changed_force_acts_from_the_next_step_on() -> None:
    ship = sail(VirtualShipParameters(), 10)
    before = ship.acceleration()
    ship.retune(VirtualShipParameters(surge_force=2e5))
    np.testing.assert_array_equal(ship.acceleration(), before)
    ship.advance()
    assert ship.acceleration()[0] == pytest.approx(before[0] + 1e5 / VirtualShipParameters().vessel.coefficients().m11, rel=1e-2)


def test_each_change_of_both_frequencies_leaves_both_sines_continuous() -> None:
    ship = sail(VirtualShipParameters(surge_force=0.0, yaw_moment=0.0), 0)
    for surge, yaw in ((0.7, 0.3), (0.0, 0.9), (1.1, 0.2), (0.4, 0.0)):
        before = ship.memory.tau
        ship.retune(
            VirtualShipParameters(
                surge_force=0.0,
                yaw_moment=0.0,
                surge_force_sine=SineParameters(1e5, surge),
                yaw_moment_sine=SineParameters(1e6, yaw),
            )
        )
        ship.advance()
        if any(before):
            assert ship.memory.tau == pytest.approx(before, abs=0.0, rel=0.2)
        for _ in range(130):
            ship.advance()


def test_an_inconsistent_input_is_rejected_and_the_old_one_stays() -> None:
    ship = sail(SINE, 10)
    with pytest.raises(ParameterError, match=r"yaw_moment_steps\.times"):
        ship.retune(replace(SINE, surge_force=0.0, yaw_moment_steps=StepsParameters(times=(0.0, 1.0))))
    other = sail(SINE, 10)
    for each in (ship, other):
        each.advance()
    np.testing.assert_array_equal(ship.acceleration(), other.acceleration())


def test_after_a_reset_the_changed_inputs_restart_at_time_zero() -> None:
    ship = sail(SINE, 1000)
    changed = replace(SINE, yaw_moment_sine=SineParameters(1e6, 5.0))
    ship.retune(changed)
    ship.reset()
    fresh = ReferenceShip(changed, PERIOD)
    for _ in range(5):
        np.testing.assert_array_equal(ship.acceleration(), fresh.acceleration())
        ship.advance()
        fresh.advance()
