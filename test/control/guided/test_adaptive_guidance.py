"""Adaptive line-of-sight guidance, the option `guidance: alos` of los_pid."""

import math
from typing import Any

import pytest

from vessel_hsmc_ros.control.laws import make_controller
from vessel_hsmc_ros.control.laws.los_pid import line_of_sight
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion
from vessel_hsmc_ros.core.metrics import position_error, rms
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate

AHEAD = Motion(0.0, 0.0, 0.0, 2.0, 0.0, 0.0)


def aim(guidance: str, y: float, integral: float, ahead: float = 1.0) -> Any:
    gains = {"lookahead_distance": 12.0, "lookahead_time": 4.0, "integral_gain": 0.45, "adaptation_gain": 0.45 * 2.0 / 144.0}
    law: Any = make_controller("los_pid", 0.1, guidance=guidance, **gains)
    return line_of_sight(AHEAD._replace(y=y), AHEAD._replace(u=2.0 * ahead), integral, law.constants)


def test_near_the_line_it_equals_integral_guidance() -> None:
    lookahead = 12.0
    adaptive, integral = aim("alos", 1e-3, 0.02), aim("ilos", 1e-3, 0.02 * lookahead)
    assert adaptive.offset == pytest.approx(integral.offset, rel=1e-3)
    assert adaptive.integral_rate == pytest.approx(integral.integral_rate / lookahead, rel=1e-3)
    assert adaptive.speed == integral.speed


def test_far_from_the_line_it_adapts_at_a_bounded_rate() -> None:
    assert aim("alos", 1e6, 0.0).integral_rate == pytest.approx(0.45 * 2.0 / 12.0)
    assert aim("ilos", 1e6, 0.0).integral_rate < 1e-4


def test_the_drift_angle_is_bounded_but_may_return() -> None:
    assert aim("alos", 10.0, 0.5).integral_rate == aim("alos", -10.0, -0.5).integral_rate == 0.0
    assert aim("alos", -10.0, 0.5).integral_rate < 0.0


def test_the_drift_angle_is_subtracted_from_the_heading_and_astern_added() -> None:
    assert aim("alos", 0.0, 0.1).offset == pytest.approx(-0.1)
    assert aim("alos", 0.0, 0.1, ahead=-1.0).offset == pytest.approx(0.1)


def test_in_a_current_it_finds_the_drift_angle_of_a_straight_line() -> None:
    rates = {f"{node}.rate_hz": 10.0 for node in ("vessel_sim", "reference_ship", "controller")}
    changes = {"controller.law": "los_pid", "controller.los_pid.guidance": "alos", "vessel_sim.disturbance.current.north": 0.3}
    run = simulate(load_scenario("case2_straight", {**rates, **changes, "vessel_sim.duration": 240.0}))
    assert rms(position_error(run.state, run.reference)[-300:]) < 0.2
    assert math.isfinite(run.wrench.sum())


def test_a_step_returns_the_command_of_the_chosen_guidance() -> None:
    far = AHEAD._replace(y=20.0)
    still = Acceleration(0.0, 0.0, 0.0)
    one, other = (make_controller("los_pid", 0.1, guidance=name, surge_force_limit=1e9) for name in ("ilos", "alos"))
    for law in (one, other):
        for _ in range(50):
            _, terms = law.step(far, AHEAD, still)
        assert -math.pi / 2 < terms.commanded_heading < 0.0
    assert one.step(far, AHEAD, still)[0] != other.step(far, AHEAD, still)[0]
