import math

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.interface.law import Terms
from vessel_hsmc_ros.control.laws import construct, make_controller
from vessel_hsmc_ros.control.laws.course import PdParameters
from vessel_hsmc_ros.control.laws.los_pid import LosPidParameters
from vessel_hsmc_ros.control.loop.control_loop import LONGEST_AGE, ControlLoop, ages
from vessel_hsmc_ros.control.loop.control_period import controlled_point_of
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.control.loop.observer_model import ObserverParameters
from vessel_hsmc_ros.control.safety.parameters import Reason, SafetyParameters
from vessel_hsmc_ros.control.safety.supervision import Authority, Supervision
from vessel_hsmc_ros.core.kinematics import Acceleration, Motion, as_motion
from vessel_hsmc_ros.core.timing import RateGrid

STATE, REFERENCE = Motion(0.0, 0.0, 0.2, 0.0, 0.0, 0.0), Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
NONE = Acceleration(0.0, 0.0, 0.0)


@pytest.fixture
def loop() -> ControlLoop:
    return ControlLoop(make_controller("hierarchical_printed", 0.01), RateGrid(100.0))


def step(loop: ControlLoop, milliseconds: int, heading: float = STATE.psi) -> Terms:
    return loop.step(milliseconds * 1_000_000, STATE._replace(psi=heading), REFERENCE, NONE)


def test_a_period_is_served_once(loop: ControlLoop) -> None:
    assert loop.due(0)
    step(loop, 0)
    assert not loop.due(9_999_999)
    assert loop.due(10_000_000)


def test_missed_periods_are_counted(loop: ControlLoop) -> None:
    for milliseconds in (0, 10, 25, 61):
        step(loop, milliseconds)
    assert loop.missed_periods == 3  # those that began at 30, 40 and 50 ms


def test_a_clock_that_is_set_back_misses_no_period(loop: ControlLoop) -> None:
    for milliseconds in (500, 510, 100, 110, 140):
        step(loop, milliseconds)
    assert loop.missed_periods == 2  # those that began at 120 and 130 ms


def test_periods_that_are_counted_anew_miss_none_across_the_step(loop: ControlLoop) -> None:
    for milliseconds in (0, 10, 30):
        step(loop, milliseconds)
    loop.begin()
    assert loop.due(30_000_000), "a period of the new count"
    for milliseconds in (9_000, 9_010, 9_040):
        step(loop, milliseconds)
    assert loop.missed_periods == 3  # those that began at 20, 9020 and 9030 ms


@pytest.mark.parametrize("order", ["standby", "stop", "fault"])
def test_the_observer_predicts_with_the_wrench_that_is_commanded_whatever_the_law_gives(order: str) -> None:
    loop, observer = ControlLoop(make_controller("hierarchical_printed", 0.01), RateGrid(100.0), observed()), observed()
    if order != "fault":
        getattr(loop.supervision, order)()
    reason = Reason.JUMP if order == "fault" else Reason.NONE
    for milliseconds in range(0, 200, 10):
        terms = loop.step(milliseconds * 1_000_000, STATE, REFERENCE, NONE, reason=reason)
        assert loop.wrench == (0.0, 0.0)
        expected = observer.update(milliseconds * 1_000_000, STATE, (0.0, 0.0))
    assert terms.yaw_surface
    np.testing.assert_array_equal(loop.estimate, expected)


def test_a_period_without_inputs_is_served_with_a_zero_wrench_and_is_not_missed(loop: ControlLoop) -> None:
    first = step(loop, 0, 0.3)
    for milliseconds in range(10, 2000, 10):
        assert loop.due(milliseconds * 1_000_000)
        loop.skip(milliseconds * 1_000_000)
        assert loop.wrench == (0.0, 0.0)
    after = step(loop, 2000, 0.1)
    assert after.lyapunov != first.lyapunov
    assert after.lyapunov_rate == 0.0, "over the gap it has none"
    assert loop.missed_periods == 0
    loop.skip(2_040_000_000)
    assert loop.missed_periods == 3  # a skipped period excuses only itself


def test_a_disabled_loop_commands_zero_and_resets_the_law(loop: ControlLoop) -> None:
    step(loop, 0)
    assert any(loop.wrench)
    loop.supervision.standby()
    step(loop, 10)
    assert loop.wrench == (0.0, 0.0)
    loop.supervision.activate()
    assert not step(loop, 20).yaw_weights.any()
    assert step(loop, 30).yaw_weights.any()


def test_reset_clears_count_and_wrench(loop: ControlLoop) -> None:
    step(loop, 500)
    step(loop, 900)
    loop.reset()
    assert loop.missed_periods == 0
    assert loop.due(900_000_000)
    assert loop.wrench == (0.0, 0.0)


def test_weight_norms_and_lyapunov_function_are_added_to_the_terms(loop: ControlLoop) -> None:
    first, second, late = step(loop, 0, 0.3), step(loop, 10, 0.2), step(loop, 40, 0.1)
    assert first.lyapunov > second.lyapunov > late.lyapunov
    for terms in (first, second, late):
        assert terms.lyapunov == pytest.approx(0.5 * (terms.yaw_surface**2 + terms.surge_surface**2))
        assert terms.yaw_weight_norm == pytest.approx(np.linalg.norm(terms.yaw_weights))
    assert first.lyapunov_rate == 0.0
    assert second.lyapunov_rate == pytest.approx((second.lyapunov - first.lyapunov) / 0.01)
    assert late.lyapunov_rate == pytest.approx((late.lyapunov - second.lyapunov) / 0.03)
    assert math.isnan(first.commanded_heading)


def test_the_law_receives_the_estimate_of_the_observer() -> None:
    observer = observed()
    law = make_controller("hierarchical_printed", 0.01)
    loop = ControlLoop(make_controller("hierarchical_printed", 0.01), RateGrid(100.0), observed())
    wrench = (0.0, 0.0)
    for milliseconds in (0, 10, 20):
        measured = as_motion(np.array(STATE) + 1e-3 * milliseconds)
        step = loop.step(milliseconds * 1_000_000, measured, REFERENCE, NONE)
        estimate = observer.update(milliseconds * 1_000_000, measured, wrench)
        expected, terms = law.update(1e-3 * milliseconds, estimate, REFERENCE, NONE)
        wrench = float(expected[0]), float(expected[1])
        np.testing.assert_array_equal(loop.estimate, estimate)
        assert loop.wrench == wrench
        assert step.yaw_surface == terms.yaw_surface
    loop.forget()
    assert loop.estimate is None
    loop.step(30_000_000, measured, REFERENCE, NONE)
    assert loop.estimate is not None
    np.testing.assert_allclose(loop.estimate, [*measured[:3], 0.0, 0.0, 0.0])


def test_the_observer_predicts_to_the_time_of_the_measurement() -> None:
    early, late = (ControlLoop(make_controller("hierarchical_printed", 0.01), RateGrid(100.0), observed()) for _ in range(2))
    for milliseconds in (0, 10, 20):
        moved = as_motion(np.array(STATE) + 1e-3 * milliseconds)
        early.step(milliseconds * 1_000_000, moved, REFERENCE, NONE)
        late.step((milliseconds + 4) * 1_000_000, moved, REFERENCE, NONE, milliseconds * 1_000_000)
    np.testing.assert_array_equal(early.estimate, late.estimate)


def test_the_observer_takes_the_command_of_the_time_of_the_measurement() -> None:
    loop, observer = ControlLoop(make_controller("pd", 0.01), RateGrid(100.0), observed()), observed()
    commands = [(0.0, 0.0)]
    for k in range(8):
        late = min(k, 3)
        moved = as_motion(np.array(STATE) + 1e-2 * (k - late))
        loop.step(k * 10_000_000, moved, REFERENCE, NONE, (k - late) * 10_000_000, 0.01 * late)
        # The command in force before the measurement is the one after that of the step before it.
        estimate = observer.update((k - late) * 10_000_000, moved, commands[k - late])
        np.testing.assert_array_equal(loop.estimate, estimate)
        commands.append(loop.wrench)
    assert len(set(commands)) > 5


def test_the_command_of_a_period_without_inputs_is_that_of_its_time_for_later_measurements() -> None:
    loop, observer = ControlLoop(make_controller("pd", 0.01), RateGrid(100.0), observed()), observed()
    commands = [(0.0, 0.0)] * 4
    for k in range(3, 16):
        if k in (7, 8, 11):
            loop.skip(k * 10_000_000)
            assert loop.wrench == (0.0, 0.0)
        else:
            moved = as_motion(np.array(STATE) + 1e-2 * k)
            loop.step(k * 10_000_000, moved, REFERENCE, NONE, (k - 3) * 10_000_000, 0.03)
            np.testing.assert_array_equal(loop.estimate, observer.update((k - 3) * 10_000_000, moved, commands[k - 3]))
        commands.append(loop.wrench)
    assert len(set(commands)) > 5


@pytest.mark.parametrize("change", ["reset", "gains"])
def test_after_each_reset_or_change_of_gains_the_command_moves_at_the_bounded_rate(change: str) -> None:
    limits, ramp_time = (2e5, 3e6), 2.0
    supervision = Supervision(SafetyParameters(ramp_time=ramp_time), Authority(limits, (1.2e5, 6.36e7), clips=True))
    loop = ControlLoop(make_controller("pd", 0.1), RateGrid(10.0), supervision=supervision)
    for turn in range(3):
        heading = 0.5 * (-1) ** turn
        for k in range(50):
            step(loop, 10_000 * turn + 100 * k, heading)
        assert supervision.follows_law
        before = loop.wrench
        loop.forget() if change == "reset" else loop.retune(PdParameters(yaw_rate_gain=1.0 + 0.1 * turn))
        for k in range(50, 55):
            step(loop, 10_000 * turn + 100 * k, -heading)
            moved = np.abs(np.subtract(loop.wrench, before)) / limits
            assert (moved <= 1.0001 * 0.1 / ramp_time).all()
            before = loop.wrench
        assert supervision.reason is Reason.HANDOVER


def test_a_measurement_that_is_older_than_the_commands_known_takes_the_oldest_of_them() -> None:
    old, older = (ControlLoop(make_controller("pd", 0.1), RateGrid(10.0), observed()) for _ in range(2))
    for k in range(160):
        moved = as_motion(np.array(STATE) + 1e-2 * k)
        old.step(k * 100_000_000, moved, REFERENCE, NONE, k * 100_000_000, LONGEST_AGE)
        older.step(k * 100_000_000, moved, REFERENCE, NONE, k * 100_000_000, LONGEST_AGE + 0.1 * (k % 40))
        np.testing.assert_array_equal(old.estimate, older.estimate)
    assert old.wrench != (0.0, 0.0)


def test_after_a_reset_a_loop_with_late_measurements_goes_on_like_a_new_one() -> None:
    used, new = (ControlLoop(make_controller("pd", 0.01), RateGrid(100.0), observed()) for _ in range(2))

    def wrenches(loop: ControlLoop) -> list[object]:
        found: list[object] = []
        for k in range(8):
            moved = as_motion(np.array(STATE) + 1e-2 * k)
            loop.step(k * 10_000_000, moved, REFERENCE, NONE, (k - 3) * 10_000_000, 0.03)
            found.append((loop.wrench, loop.estimate))
        return found

    first = wrenches(used)
    used.reset()
    assert wrenches(used) == first == wrenches(new)


@pytest.mark.parametrize("change", ["reset", "forget"])
def test_a_loop_about_a_point_ahead_goes_on_like_a_new_one_each_time(change: str) -> None:
    vessel = KnownVessel(sway_yaw_inertia=6e5)
    used, new = (
        ControlLoop(
            construct("los_pid", LosPidParameters(), vessel.as_controlled(), 0.1),
            RateGrid(10.0),
            point=controlled_point_of(vessel, 0.1),
            supervision=Supervision(SafetyParameters(), Authority((2e5, 3e6), (1.2e5, 6e7)), active=False),
        )
        for _ in range(2)
    )

    def terms(loop: ControlLoop, seed: float) -> list[Terms]:
        """In standby, so that no handover from the command before is part of it; the law is reset in each period."""
        states = [Motion(0.3 * k, seed, 0.4 + 0.01 * k * seed, 3.0, 0.1, 0.02 * seed) for k in range(12)]
        return [loop.step(k * 100_000_000, s, s._replace(psi=0.0, y=0.0), NONE) for k, s in enumerate(states)]

    first = terms(new, 2.0)
    for seed in (-5.0, 3.0):
        terms(used, seed)
        getattr(used, change)()
        for found, expected in zip(terms(used, 2.0), first, strict=True):
            assert (found.surge_error, found.sway_error) == (expected.surge_error, expected.sway_error)
            assert found.commanded_heading == expected.commanded_heading


def observed() -> Observer:
    return Observer(ObserverParameters(), KnownVessel())


def test_the_command_of_a_measurement_is_that_of_the_nearest_period() -> None:
    measured_at = np.full(6, 5_000_000_000)
    late = np.array([0, 40, 60, 160, 300, 60_000])
    age, behind = ages(measured_at + late * 1_000_000, measured_at, 0.1)
    np.testing.assert_allclose(age, 1e-3 * late)
    assert behind.tolist() == [0, 0, 1, 2, 3, round(LONGEST_AGE / 0.1)]
