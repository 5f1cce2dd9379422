"""The compiled loop against the interpreted one: bit-identical in everything that a run and its messages contain."""

from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from compiling import only_compiled
from durations import rest_long
from hulls import COUPLING

from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.control.laws.course import PdController, PdParameters
from vessel_hsmc_ros.core.exceptions import ControlError, SimulationError
from vessel_hsmc_ros.report.record import measured
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario, scenario_names
from vessel_hsmc_ros.simulation.compile import compilable_laws
from vessel_hsmc_ros.simulation.compiled_loop import CompiledLoop, make_loop
from vessel_hsmc_ros.simulation.loop import InterpretedLoop
from vessel_hsmc_ros.simulation.offline import ClosedLoop, simulate
from vessel_hsmc_ros.studies.batch import simulate_many, simulate_one

SECONDS = 3.0
GENTLE = {"controller.hierarchical_printed.yaw_reaching_gain": 5.0, "controller.hierarchical_printed.surge_reaching_gain": 5.0}
"""Gains that are stable at the low rate of the realistic scenario."""

ROUGH = {
    "vessel_sim.sensors.position_noise": 0.1,
    "vessel_sim.sensors.heading_noise": 0.002,
    "vessel_sim.sensors.position_rate_hz": 5.0,
    "vessel_sim.disturbance.waves.significant_height": 0.5,
    "vessel_sim.disturbance.earth_fixed.east_force": 2e4,
    "vessel_sim.disturbance.earth_fixed.gust_deviation": 5e3,
    "vessel_sim.disturbance.current.north": 0.3,
    "vessel_sim.actuators.yaw_lag": 0.5,
    "vessel_sim.substeps": 2,
}


def scenario_of(name: str, law: str, **changes: object) -> Scenario:
    return load_scenario(name, {**GENTLE, "controller.law": law, "vessel_sim.duration": SECONDS, **changes})


def same(first: Any, second: Any) -> bool:
    """Whether two arrays have the same type, shape and bits, but for the kind of NaN."""
    if first is None or second is None:
        return first is second
    return first.dtype == second.dtype and np.array_equal(first, second, equal_nan=first.dtype.kind == "f")


def assert_same_run(scenario: Scenario) -> None:
    loops = [ClosedLoop(scenario, interpreted=interpreted) for interpreted in (False, True)]
    for loop in loops:
        loop.run()
    for results in ([loop.result() for loop in loops], [loop.published() for loop in loops]):
        first, second = results
        for field in fields(first):
            if field.name != "control":
                assert same(getattr(first, field.name), getattr(second, field.name)), field.name
        assert first.control.keys() == second.control.keys()
        for name in first.control:
            assert same(first.control[name], second.control[name]), name
    assert simulate_one(scenario).metrics == measured(loops[1].result(), scenario)


@pytest.mark.parametrize("name", scenario_names())
def test_a_scenario_runs_compiled_to_the_same_bits(name: str) -> None:
    assert_same_run(load_scenario(name, {"vessel_sim.duration": SECONDS}))


@pytest.mark.parametrize("law", rest_long(compilable_laws()))
@pytest.mark.parametrize("changes", rest_long([{}, ROUGH]), ids=["calm", "rough"])
def test_a_law_runs_compiled_to_the_same_bits(law: str, changes: dict[str, object]) -> None:
    assert_same_run(scenario_of("case2_tracking", law, **changes))


def test_a_coupled_ship_runs_compiled_to_the_same_bits() -> None:
    assert_same_run(scenario_of("figure_eight", "guided", **{f"vessel.{name}": value for name, value in COUPLING.items()}))


def test_with_the_observer_a_law_runs_compiled_to_the_same_bits() -> None:
    assert_same_run(scenario_of("realistic", "guided"))


@pytest.mark.parametrize("law", ["guided", "los_pid"])
def test_with_an_outboard_a_law_runs_compiled_to_the_same_bits(law: str) -> None:
    limits = {"vessel.surge_force_limit": 2e5, "vessel.yaw_moment_limit": 3e6}
    assert_same_run(scenario_of("figure_eight", law, **limits, **{"vessel.steering_loss": 0.9, "vessel.steering_speed": 6.0}))


@pytest.mark.parametrize("law", ["guided", "hierarchical_printed"])
def test_at_the_pivot_a_law_runs_compiled_to_the_same_bits(law: str) -> None:
    assert_same_run(scenario_of("case2_tracking", law, **{"controller.vessel.sway_yaw_inertia": 6e5}))


@pytest.mark.parametrize(
    "changes",
    [{"guided.cross_track": 0.1}, {"vessel.surge_force_limit": 5e3, "vessel.yaw_moment_limit": 1e5}],
    ids=["along the leg", "little force"],
)
def test_other_settings_of_the_guided_law_run_compiled_to_the_same_bits(changes: dict[str, float]) -> None:
    """Its kernel is compared in these loops only: on its own it would have to be compiled once more."""
    assert_same_run(scenario_of("case2_tracking", "guided", **{f"controller.{name}": value for name, value in changes.items()}))


def test_every_law_but_model_predictive_control_is_compiled() -> None:
    assert {*LAWS} - {*compilable_laws()} <= {"nmpc", *LAWS.others}


@only_compiled
def test_a_law_of_ones_own_runs_interpreted() -> None:
    class Own(PdController):
        name = "own"

    scenario = scenario_of("case1_pd", "pd")
    law = Own(PdParameters(), scenario.controller.vessel, 0.01)
    assert isinstance(make_loop(scenario, 10), CompiledLoop)
    assert isinstance(make_loop(scenario, 10, law), InterpretedLoop)
    assert isinstance(make_loop(scenario, 10, interpreted=True), InterpretedLoop)


FAILING: list[tuple[type[Exception], dict[str, Any]]] = [
    (SimulationError, {"controller.hierarchical_printed.sway_weight": 30.0, "vessel_sim.duration": 400.0}),
    (ControlError, {"reference_ship.surge_force": 9e8, "vessel_sim.duration": 400.0}),
    (ControlError, {"vessel_sim.initial_pose": (3.0, 0.0, 0.0), "controller.hierarchical_printed.sway_weight": 100.0 / 3.0}),
]


@pytest.mark.parametrize(("kind", "changes"), FAILING)
def test_a_run_that_ends_early_ends_at_the_same_step_with_the_same_error(kind: type[Exception], changes: dict[str, Any]) -> None:
    scenario = load_scenario("case2_tracking", changes)
    ends = []
    for interpreted in (False, True):
        loop = ClosedLoop(scenario, interpreted=interpreted)
        with pytest.raises(kind) as caught:
            loop.run()
        ends.append((str(caught.value), loop.done, len(loop.result().time), len(loop.published().stamp)))
    assert ends[0] == ends[1]
    assert simulate_one(scenario).failure == ends[0][0]


def test_an_interrupt_leaves_the_steps_so_far() -> None:
    loop = ClosedLoop(load_scenario("case2_tracking", {"vessel_sim.duration": 600.0}))

    def interrupt(done: int, _total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        loop.run(interrupt)
    assert 0 < loop.done < loop.samples
    assert len(loop.result().control["time"]) == len(loop.result().time) == loop.done


def test_a_batch_has_the_metrics_of_single_runs_in_any_number_of_processes() -> None:
    scenarios = [scenario_of("case2_tracking", "guided", **ROUGH, **{"vessel_sim.seed": seed}) for seed in range(5)]
    scenarios.append(load_scenario("case2_tracking", FAILING[0][1]))
    single = [simulate_one(scenario, index) for index, scenario in enumerate(scenarios)]
    seen: list[int] = []
    assert simulate_many(scenarios, on_result=lambda outcome: seen.append(outcome.index)) == single
    assert seen == [0, 1, 2, 3, 4, 5]
    assert simulate_many(scenarios, workers=2) == single
    assert len({outcome.metrics for outcome in single[:5]}) == 5
    assert single[5].failure.startswith("the motion of the ship is no longer finite")


def test_of_chosen_runs_a_batch_keeps_every_kth_row() -> None:
    scenario = scenario_of("case2_tracking", "hierarchical_printed")
    kept = simulate_many([scenario, scenario], keep={1}, every=10)
    assert kept[0].run is None
    assert kept[0].metrics == kept[1].metrics
    whole = simulate(scenario)
    assert kept[1].run is not None
    assert same(kept[1].run.state, whole.state[::10])
    assert same(kept[1].run.control["yaw_weights"], whole.control["yaw_weights"][::10])
