import numpy as np
import pytest

from vessel_hsmc_ros.scenario.own_ship import ship_of
from vessel_hsmc_ros.scenario.scenario import parse_scenario
from vessel_hsmc_ros.scenario.ship_rules import Scale, scale_of
from vessel_hsmc_ros.scenario.vessels import read_vessel
from vessel_hsmc_ros.simulation.offline import simulate
from vessel_hsmc_ros.studies.identification.excitation import excitation, manoeuvres, scenario_text, starts


@pytest.fixture
def otter() -> Scale:
    return scale_of(ship_of(read_vessel("otter").values))


def test_manoeuvres_use_the_whole_propulsion_to_both_sides_and_end_with_a_stop(otter: Scale) -> None:
    steps = excitation(otter)
    assert {1.0, -1.0} <= {step.yaw for step in steps}
    assert {1.0, -0.5} <= {step.surge for step in steps}
    assert all(abs(step.surge) <= 1.0 and abs(step.yaw) <= 1.0 and step.duration > 0.0 for step in steps)
    assert steps[-1][:3] == ("stop", 0.0, 0.0)
    assert sum(step.yaw * step.duration for step in steps) == pytest.approx(0.0, abs=1e-9)


def test_the_manoeuvres_last_longer_for_a_larger_ship_of_the_same_shape(otter: Scale) -> None:
    larger = otter._replace(L=16.0 * otter.L, U=4.0 * otter.U, m11=otter.m11 * 16**3, F=otter.F * 16**3, T=4.0 * otter.T)
    assert starts(excitation(larger))[-1] == pytest.approx(4.0 * starts(excitation(otter))[-1], rel=0.1)


def test_the_scenario_commands_the_manoeuvres_and_its_reference_is_the_same_ship(otter: Scale) -> None:
    steps = excitation(otter)
    text = scenario_text("mine", "otter", '    vessel: "otter"', otter, steps)
    perfect: dict[str, object] = {
        f"vessel_sim.sensors.{name}_noise": 0.0 for name in ("position", "heading", "velocity", "yaw_rate")
    }
    run = simulate(parse_scenario(text, "mine", perfect))
    times = starts(steps)
    assert run.time[-1] == times[-1]
    # The ship has a lag of 0.1 s in its inputs, which the virtual ship does not have.
    ends = [int(50.0 * time) - 1 for time in times[1:]]
    assert run.wrench[ends, 0] == pytest.approx([step.surge * otter.F for step in steps], abs=0.02 * otter.F)
    assert run.wrench[ends, 1] == pytest.approx([step.yaw * otter.N for step in steps], abs=0.02 * otter.N)
    assert np.abs(run.state - run.reference)[: ends[0], :2].max() < 0.1 * otter.L


def test_steps_of_a_manoeuvre_are_listed_as_one(otter: Scale) -> None:
    steps = excitation(otter)
    assert [steps[first].manoeuvre for first, _ in manoeuvres(steps)][:3] == ["speed steps", "coasting", "astern"]


def test_turns_of_a_slow_ship_last_until_her_drift_is_steady(otter: Scale) -> None:
    slow = otter._replace(U=0.05 * otter.U)
    two_lengths = 2.0 * slow.L / slow.U
    assert two_lengths > 5.0 * slow.T
    spiral = [step.duration for step in excitation(slow) if step.manoeuvre == "spiral"]
    assert spiral == pytest.approx([4.0 * two_lengths] * 6, abs=0.25)


@pytest.mark.parametrize(("unit", "rate"), [(10.0, 5.0), (6.0, 5.0), (5.9, 10.0), (2.0, 20.0), (1.4, 50.0), (0.1, 50.0)])
def test_the_rate_is_the_lowest_one_with_thirty_samples_in_the_unit_of_time(otter: Scale, unit: float, rate: float) -> None:
    text = scenario_text("mine", "otter", '    vessel: "otter"', otter._replace(T=unit), excitation(otter))
    assert parse_scenario(text, "mine").controller.rate_hz == rate
