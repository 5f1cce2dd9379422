"""The controller over recorded inputs: compiled, in several spans, and interpreted it gives the same wrenches."""

from dataclasses import replace

import numpy as np
import pytest

from vessel_hsmc_ros.control.loop.control_loop import ages
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.core.exceptions import ControlError
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.scenario.control import make_control_loop
from vessel_hsmc_ros.scenario.scenario import Scenario, load_scenario
from vessel_hsmc_ros.simulation import recorded_loop
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.simulation.recorded_loop import Recorded, replay_controller


def recorded_of(scenario: Scenario) -> Recorded:
    run = simulate(scenario, interpreted=True)
    n = len(run.time)
    grid = RateGrid(scenario.vessel_sim.rate_hz)
    rates = np.gradient(run.reference[:, 3:], axis=0)
    stamps, wrench = grid.stamps(n), np.empty((n, 2))
    prompt = stamps, *ages(stamps, stamps, grid.period)
    return Recorded(stamps, np.ones(n, bool), *prompt, run.measured.copy(), run.reference.copy(), rates, wrench)


def answers(scenario: Scenario, recorded: Recorded, spans: list[range], interpreted: bool) -> np.ndarray:
    controller = scenario.controller
    loop = make_control_loop(controller)
    recorded.wrench[:] = np.nan
    for span in spans:
        replay_controller(loop, Observer(controller.observer, controller.vessel), recorded, span, interpreted)
        loop.law.retune(replace(getattr(controller, controller.law), surge_reaching_gain=50.0))
    return recorded.wrench.copy()


@pytest.mark.parametrize("coupling", [0.0, 6e5])
def test_recorded_inputs_are_answered_compiled_as_interpreted_with_a_change_in_between(
    monkeypatch: pytest.MonkeyPatch, coupling: float
) -> None:
    monkeypatch.setattr(recorded_loop, "MIN_COMPILED_STEPS", 1)
    scenario = load_scenario(
        "case2_tracking",
        {"controller.law": "hierarchical_printed", "vessel_sim.duration": 3.0, "vessel.sway_yaw_inertia": coupling},
    )
    recorded = recorded_of(scenario)
    spans = [range(120), range(120, 301)]
    compiled = answers(scenario, recorded, spans, interpreted=False)
    np.testing.assert_array_equal(compiled, answers(scenario, recorded, spans, interpreted=True))
    assert not np.array_equal(compiled, answers(scenario, recorded, [range(301)], interpreted=False))


def test_an_input_at_which_the_law_is_undefined_raises_its_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorded_loop, "MIN_COMPILED_STEPS", 1)
    scenario = load_scenario("case2_tracking", {"controller.law": "hierarchical_printed", "vessel_sim.duration": 1.0})
    recorded = recorded_of(scenario)
    slope = scenario.controller.hierarchical_printed
    recorded.motion[50, :3] = slope.heading_weight / slope.sway_weight, 0.0, 0.0
    messages = []
    for interpreted in (False, True):
        with pytest.raises(ControlError) as caught:
            answers(scenario, recorded, [range(101)], interpreted)
        messages.append(str(caught.value))
    assert messages[0] == messages[1]
