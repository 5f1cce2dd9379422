"""The closed loop with dead time in the command path and late odometry: compiled and interpreted, with and without observer."""

from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.law import Law, Terms
from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.control.laws.course import PdParameters
from vessel_hsmc_ros.core.kinematics import Acceleration, as_motion, extrapolate
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.simulation.offline import ClosedLoop, simulate

LATE = {
    "vessel_sim.duration": 3.0,
    "vessel_sim.actuators.surge_dead_time": 0.3,
    "vessel_sim.actuators.yaw_dead_time": 0.5,
    "vessel_sim.actuators.yaw_lag": 0.4,
    "vessel_sim.sensors.delay": 0.25,
    "controller.law": "guided",
}
RATES = {f"{node}.rate_hz": 20.0 for node in ("vessel_sim", "reference_ship", "controller")}


def same(first: Any, second: Any) -> bool:
    return bool(np.array_equal(first, second, equal_nan=first.dtype.kind == "f"))


@pytest.mark.parametrize("observed", [False, True])
def test_a_late_loop_runs_compiled_to_the_same_bits(observed: bool) -> None:
    changes = {"controller.observer.enabled": observed, "vessel_sim.sensors.position_noise": 0.1 * observed}
    scenario = load_scenario("case2_tracking", {**LATE, **changes})
    compiled, interpreted = (ClosedLoop(scenario, interpreted=interpreted) for interpreted in (False, True))
    compiled.run()
    interpreted.run()
    first, second = compiled.result(), interpreted.result()
    for name in (field.name for field in fields(first) if field.name != "control"):
        assert same(getattr(first, name), getattr(second, name)), name
    assert all(same(first.control[name], second.control[name]) for name in first.control)
    assert same(compiled.published().measured_at, interpreted.published().measured_at)


def test_the_applied_wrench_is_the_command_of_its_dead_time_ago() -> None:
    run = simulate(load_scenario("case2_tracking", {**LATE, **RATES, "vessel_sim.actuators.yaw_lag": 0.0}), interpreted=True)
    commanded = run.control["commanded"]
    np.testing.assert_array_equal(run.wrench[6:, 0], commanded[:-6, 0])
    np.testing.assert_array_equal(run.wrench[10:, 1], commanded[:-10, 1])
    assert not run.wrench[:6, 0].any()
    np.testing.assert_array_equal(run.measured[5:], run.state[:-5])


class Noting(Law[PdParameters]):
    """A law that notes its inputs."""

    name = "noting"
    takes_age = True

    def reset(self) -> None:
        self.seen: list[tuple[Any, ...]] = []

    def step(self, *inputs: Any) -> tuple[tuple[float, float], Terms]:
        self.seen.append(inputs)
        return (9e4, 6e5), Terms()


class NotingWithoutAge(Noting):
    name = "noting_without_age"
    takes_age = False


def noted(scenario: Scenario, law: type[Noting]) -> tuple[Any, list[tuple[Any, ...]]]:
    made = law(PdParameters(), scenario.controller.vessel, 0.05)
    return simulate(scenario, law=made), made.seen


def test_a_law_that_takes_it_gets_the_age_with_ship_and_reference_of_the_same_time() -> None:
    run, seen = noted(load_scenario("case2_tracking", {**LATE, **RATES}), Noting)
    assert [inputs[3] for inputs in seen[:8]] == pytest.approx([0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.25, 0.25])
    motion, desired, acceleration, age = seen[40]
    assert motion == as_motion(run.state[35])
    assert isinstance(acceleration, Acceleration)
    np.testing.assert_allclose(desired, run.reference[35], atol=0.01)
    # Over its age the law gets back to the present reference without a loss.
    np.testing.assert_allclose(extrapolate(desired, acceleration, age), run.reference[40], atol=1e-12)


def test_a_law_that_takes_no_age_gets_ship_and_reference_of_the_same_time() -> None:
    run, seen = noted(load_scenario("case2_tracking", {**LATE, **RATES}), NotingWithoutAge)
    motion, desired, _ = seen[40]
    assert motion == as_motion(run.state[35])
    np.testing.assert_allclose(desired, run.reference[35], atol=0.01)


def tracking_error(interpreted: bool = False, **changes: float) -> float:
    """The largest distance of the guided law from its reference in the last 20 s of 160 s; the actuators are declared ideal."""
    ideal: dict[str, Any] = {
        f"controller.vessel.{name}": 0.0 for name in ("surge_lag", "yaw_lag", "surge_dead_time", "yaw_dead_time")
    }
    ideal |= {f"controller.vessel.{name}": float("inf") for name in ("surge_force_rate", "yaw_moment_rate")}
    given = {name.replace("__", "."): value for name, value in changes.items()}
    scenario = load_scenario(
        "case2_tracking", {"controller.law": "guided", "vessel_sim.duration": 160.0, **RATES, **ideal, **given}
    )
    run = simulate(scenario, interpreted=interpreted)
    return float(np.hypot(*(run.state - run.reference)[-400:, :2].T).max())


def test_the_guided_law_tracks_with_odometry_a_second_late_as_with_prompt_odometry(monkeypatch: pytest.MonkeyPatch) -> None:
    assert tracking_error(vessel_sim__sensors__delay=1.0) < 2.0 * tracking_error()
    for taken in ("takes_age", "takes_heading"):
        monkeypatch.setattr(LAWS["guided"].controller, taken, False)
    # Identified, the age would be a dead time like any other. A law without the age would be compiled for this run alone.
    assert tracking_error(True, vessel_sim__sensors__delay=1.0, controller__guided__actuator_identification=False) > 0.3
