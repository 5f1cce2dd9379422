"""The diagrams of a report: what they show, their limits and their help."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from records import record

from vessel_hsmc_ros.control.interface.known_vessel import INSTANT
from vessel_hsmc_ros.core.metrics import position_error
from vessel_hsmc_ros.report import Record
from vessel_hsmc_ros.report.figures import jitter_intervals
from vessel_hsmc_ros.report.panels import HELP, Panel, panels
from vessel_hsmc_ros.report.record import Limit, Mark, limits, on_legs, planned
from vessel_hsmc_ros.scenario.scenario import load_scenario
from vessel_hsmc_ros.simulation.offline import simulate

GUIDED: dict[str, Any] = {"controller.law": "guided"}


def simulated(scenario: str = "case2_tracking", duration: float = 5.0, **changes: Any) -> Record:
    found = load_scenario(scenario, {"vessel_sim.duration": duration, **changes})
    return Record("run", simulate(found), scenario=found)


def by_title(record: Record) -> dict[str, Panel]:
    return {panel.title: panel for panel in panels(record)}


def test_the_error_in_the_body_frame_is_as_large_as_the_position_error_far_from_the_origin() -> None:
    far: dict[str, Any] = {
        "vessel_sim.initial_pose": (5000.0, -7000.0, 0.0),
        "reference_ship.initial_pose": (5003.0, -7000.0, 1.0),
    }
    made = simulated(**{**GUIDED, **far})
    forward, port = by_title(made)["position error in the body frame"].lines
    assert np.hypot(forward.values, port.values) == pytest.approx(position_error(made.run.state, made.run.reference))
    assert forward.values[0] == pytest.approx(-3.0)
    assert port.values[0] == pytest.approx(0.0, abs=1e-9)


def test_the_error_variables_of_the_paper_are_shown_for_the_law_that_uses_them() -> None:
    paper = by_title(simulated())["z_e of (11)"]
    assert paper.group == "Error variables of the paper's law"
    assert [line.name for line in paper.lines] == ["z₁ₑ", "z₂ₑ"]
    assert "z_e of (11)" not in by_title(simulated(**GUIDED))


def test_network_estimate_and_truth_are_the_same_quantity_in_a_large_disturbance() -> None:
    load: dict[str, Any] = {
        f"vessel_sim.disturbance.periodic.{name}": value for name, value in (("surge_force", 3e4), ("sway_force", 2e4))
    }
    # A network that knows its actuators does not learn them.
    load |= {f"controller.vessel.{name}": value for name, value in INSTANT.items()}
    made = simulated(duration=25.0, **GUIDED, **load)
    for axis in ("surge dynamics f_u", "sway dynamics f_v"):
        estimate, truth = by_title(made)[f"{axis} and disturbance"].lines
        assert (estimate.name, truth.name) == ("estimate", "truth")
        assert abs(estimate.values[-1] - truth.values[-1]) < 0.1 * np.abs(made.run.disturbance[-1, :2]).min()


def test_limits_are_those_of_actuators_and_law_by_name() -> None:
    def surge(**changes: object) -> tuple[Limit, ...]:
        return limits(load_scenario("case2_tracking", changes))[0]

    actuator = "vessel_sim.actuators.surge_force_limit"
    assert surge() == ()
    assert surge(**GUIDED) == (Limit(2e5, "law"),)
    assert surge(**GUIDED, **{actuator: 3e5}) == (Limit(3e5, "actuator"), Limit(2e5, "law"))
    assert surge(**GUIDED, **{actuator: 2e5}) == (Limit(2e5, "actuator and law"),)
    assert limits(None) == ((), ())


def test_the_panels_of_the_wrench_have_the_limits() -> None:
    made = simulated(**GUIDED)
    shown = by_title(made)
    assert (shown["surge force"].limits, shown["yaw moment"].limits) == limits(made.scenario)


def test_every_panel_has_help_and_no_help_is_without_a_panel() -> None:
    noisy, paper = simulated("realistic"), simulated()
    for made in (noisy, paper):
        steps = len(made.run.control["time"])
        made.run.control["compute_time"] = np.full(steps, 3e-5)
        made.run.control["time"] = made.run.control["time"] + 1e-4 * (np.arange(steps) % 2)
    path = simulated("waypoints")
    legs = replace(path, track_errors=on_legs(path.run, planned(path.scenario), path.run.time)[0])
    shown = {**by_title(noisy), **by_title(paper), **by_title(legs)}
    assert shown.keys() == HELP.keys()
    assert all(1 <= panel.help.count(".") <= 4 for panel in shown.values())


def test_a_pause_is_no_control_interval() -> None:
    made = record("run", 1.0)
    times: Any = np.arange(250) * 0.02 + np.where(np.arange(250) % 2, 1e-4, 0.0)
    times[125:] += 5.0
    made.run.control.update(time=times, compute_time=np.full(250, 4e-5))
    paused = replace(made, marks=(Mark(2.3, "pause", "paused"), Mark(7.4, "resume", "resumed")))
    assert by_title(made)["control interval"].lines[0].values.max() > 5.0
    assert by_title(paused)["control interval"].lines[0].values.max() < 0.03
    found = jitter_intervals(paused)
    assert found is not None
    assert len(found) < 249
    assert found.max() < 0.03


def test_a_pause_without_an_end_lasts_until_the_end_of_the_run() -> None:
    made = record("run", 1.0)
    made.run.control.update(time=0.02 * np.arange(250.0), compute_time=np.full(250, 4e-5))
    assert jitter_intervals(replace(made, marks=(Mark(0.0, "pause", "paused"),))) is None
