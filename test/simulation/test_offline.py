"""The offline loop; its results are tested in `test_golden_offline.py` and `test_errata.py`."""

import numpy as np
import pytest

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT
from vessel_hsmc_ros.core.exceptions import ScenarioError, SimulationError
from vessel_hsmc_ros.core.metrics import Run, position_error
from vessel_hsmc_ros.simulation.offline import load_scenario, simulate


def run_of(seconds: float, **changes: object) -> Run:
    changes = {name.replace("__", "."): value for name, value in changes.items()}
    return simulate(load_scenario("case2_tracking", {"vessel_sim.duration": seconds, **changes}))


def test_a_run_has_one_row_for_each_odometry_message() -> None:
    run = run_of(2.0)
    assert [a.shape for a in (run.time, run.state, run.reference, run.wrench, run.disturbance)] == [
        (201,),
        (201, 6),
        (201, 6),
        (201, 2),
        (201, 3),
    ]
    np.testing.assert_allclose(np.diff(run.time), 0.01)
    assert run.control["yaw_surface"].shape == (201,)
    np.testing.assert_allclose(run.disturbance[0], [11e2 / 120e3, 26e2 / 177.9e3, 950e2 / 636e5])


def test_two_runs_of_a_scenario_are_bit_identical() -> None:
    first, second = run_of(3.0), run_of(3.0)
    np.testing.assert_array_equal(first.state, second.state)
    np.testing.assert_array_equal(first.wrench, second.wrench)


def test_the_law_receives_measurements_and_the_run_contains_state_and_measurements() -> None:
    run = run_of(0.5, vessel_sim__sensors__position_noise=0.1)
    errors = run.measured - run.state
    assert 0.05 < errors[:, :2].std() < 0.2
    assert not errors[:, 2:].any()
    other_seed = run_of(0.5, vessel_sim__sensors__position_noise=0.1, vessel_sim__seed=1)
    assert not np.array_equal(run.wrench, other_seed.wrench)
    perfect = run_of(0.5)
    np.testing.assert_array_equal(perfect.measured, perfect.state)
    assert not np.array_equal(run.wrench, perfect.wrench)


def test_the_recorded_accelerations_add_up_to_the_change_of_velocity() -> None:
    run = run_of(2.0, vessel_sim__disturbance__current__north=0.5, vessel_sim__disturbance__earth_fixed__east_force=2e4)
    inertia = np.array([120e3, 636e5])
    forced = np.column_stack((run.wrench[:, 0] / inertia[0], np.zeros(len(run.time)), run.wrench[:, 1] / inertia[1]))
    acceleration = run.unforced_acceleration + run.disturbance + forced
    change = np.diff(run.state[:, 3:], axis=0) / 0.01
    np.testing.assert_allclose(acceleration[50:-1], change[50:], rtol=0.05, atol=0.01)


@pytest.mark.long
@pytest.mark.parametrize("law", ["guided", "los_pid"])
def test_with_the_observer_a_law_tracks_from_noisy_poses_alone(law: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A position at 5 Hz that is off by half a metre, a heading at 10 Hz off by 0.3°, no velocity at all."""
    if law == "los_pid":  # to compile it with the observer takes longer than the run
        monkeypatch.setenv("VESSEL_HSMC_INTERPRETED", "1")
    sensors = {
        "position_noise": 0.5,
        "heading_noise": 0.005,
        "measures_velocity": False,
        "position_rate_hz": 5.0,
        "heading_rate_hz": 10.0,
    }
    run = run_of(
        150.0,
        vessel_sim__rate_hz=50.0,
        reference_ship__rate_hz=50.0,
        vessel_sim__actuators__surge_force_limit=2e5,
        vessel_sim__actuators__yaw_moment_limit=3e6,
        controller__law=law,
        controller__rate_hz=25.0,
        controller__observer__enabled=True,
        **{f"controller__vessel__{name}": value for name, value in INSTANT.items()},
        **{f"vessel_sim__sensors__{name}": value for name, value in sensors.items()},
    )
    late = run.time >= 100.0
    assert np.max(position_error(run.state, run.reference)[late]) < 1.0
    error = run.control["estimate"] - run.state[::2]
    error[:, 2] = (error[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    deviation = np.sqrt(np.mean(error[late[::2]] ** 2, axis=0))
    assert np.all(deviation < [0.3, 0.3, 0.004, 0.1, 0.1, 0.003]), deviation
    assert not run.measured[:, 3:].any()


def test_the_wrench_stays_within_the_actuator_limits() -> None:
    run = run_of(5.0, vessel_sim__actuators__surge_force_limit=2e5, vessel_sim__actuators__yaw_moment_limit=3e6)
    assert np.max(np.abs(run.wrench), axis=0) == pytest.approx([2e5, 3e6])


def test_a_slower_law_holds_its_wrench_between_its_updates() -> None:
    slow = {
        "controller__hierarchical_printed__yaw_reaching_gain": 20.0,
        "controller__hierarchical_printed__surge_reaching_gain": 20.0,
    }
    run = run_of(1.0, controller__rate_hz=20.0, **slow)
    assert len(run.control["time"]) == 21
    np.testing.assert_array_equal(run.wrench[5:10], np.tile(run.wrench[5], (5, 1)))
    assert not np.array_equal(run.wrench[9], run.wrench[10])


def test_a_scenario_without_a_duration_is_refused() -> None:
    with pytest.raises(ScenarioError, match="duration must be above 0 s offline"):
        run_of(0.0)


def test_a_diverging_loop_raises_simulation_error() -> None:
    with pytest.raises(SimulationError, match="no longer finite"):
        run_of(400.0, controller__hierarchical_printed__sway_weight=30.0)


def test_progress_is_reported_up_to_the_last_sample() -> None:
    progress: list[tuple[int, int]] = []
    scenario = load_scenario("case2_tracking", {"vessel_sim.duration": 1200.0})
    simulate(scenario, lambda done, total: progress.append((done, total)))
    assert len(progress) > 2
    assert progress == sorted(set(progress))
    assert progress[-1] == (120001, 120001)
