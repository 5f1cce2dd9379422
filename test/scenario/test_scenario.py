from pathlib import Path

import pytest
import yaml

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.parameters_file import read_yaml
from vessel_hsmc_ros.scenario.scenario import dump_scenario, for_nodes, load_scenario, scenario_names, scenario_text


def test_every_scenario_of_the_package_loads() -> None:
    assert "case2_tracking" in scenario_names()
    for name in scenario_names():
        assert load_scenario(name).name == name


def test_case_2_has_the_parameters_of_the_paper() -> None:
    s = load_scenario("case2_tracking")
    assert (s.reference_ship.surge_force, s.reference_ship.yaw_moment) == (1e5, 1e6)
    assert s.vessel_sim.initial_pose == pytest.approx((5.0, 1.0, 0.785398163))
    assert s.reference_ship.initial_pose == (15.0, 15.0, 0.0)
    law = s.controller.hierarchical_printed
    assert (law.sway_surface_slope, law.heading_surface_slope, law.surge_surface_slope) == (0.3, 0.3, 0.3)
    assert (law.sway_weight, law.heading_weight) == (0.001, 100.0)
    assert (law.yaw_reaching_gain, law.surge_reaching_gain) == (100.0, 100.0)
    assert (law.yaw_switching_gain, law.surge_switching_gain) == (0.001, 0.001)
    assert (law.network.center, law.network.width) == (0.5, 5.0)


def test_changes_override_the_file() -> None:
    assert (
        load_scenario(
            "case2_tracking", {"controller.hierarchical_printed.sway_weight": 0.1}
        ).controller.hierarchical_printed.sway_weight
        == 0.1
    )


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"controller.rate_hz": 50.0}, ParameterError, "unstable at controller.rate_hz = 50 Hz"),
        ({"controller.rate_hz": 0.0}, ParameterError, r"controller\.rate_hz must be .* from 1 to 1000 Hz .got 0\.0"),
        ({"pilot.rate_hz": 1.0}, ParameterError, r"pilot\.rate_hz is not a parameter: .* vessel_sim, reference_ship"),
        ({"vessel_sim.rate_hz": 150.0}, ScenarioError, r"controller\.rate_hz = 100 Hz does not fit vessel_sim\.rate_hz = 150 Hz"),
        ({"reference_ship.rate_hz": 50.0}, ScenarioError, r"does not fit reference_ship\.rate_hz = 50 Hz"),
    ],
)
def test_invalid_changes_are_rejected(changes: dict[str, object], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        load_scenario("case2_tracking", changes)


def test_in_real_time_the_rates_need_not_be_multiples() -> None:
    scenario = load_scenario("case2_tracking", {"vessel_sim.rate_hz": 150.0, "controller.lockstep": False})
    assert (scenario.vessel_sim.rate_hz, scenario.controller.rate_hz) == (150.0, 100.0)


def test_a_lockstep_run_with_late_odometry_cannot_ride_through_missing_inputs() -> None:
    late = {"vessel_sim.sensors.delay": 0.2, "controller.ride_through": True}
    with pytest.raises(ScenarioError, match=r"vessel_sim\.sensors\.delay must be 0 s in lockstep with .*got 0\.2 s"):
        load_scenario("case2_tracking", late)
    load_scenario("case2_tracking", late | {"controller.lockstep": False})


def test_an_unknown_scenario_is_rejected_with_the_known_names() -> None:
    with pytest.raises(ScenarioError, match=r"case9 is unknown: it must be one of .*case2_tracking"):
        load_scenario("case9")
    with pytest.raises(ScenarioError, match=r"nowhere\.yaml does not exist"):
        load_scenario("nowhere.yaml")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "cannot be read"),
        ("3", "not a ROS parameters file"),
        ("vessel_sim: {rate_hz: 3}", "section vessel_sim has no ros__parameters"),
        ("pilot: {ros__parameters: {rate_hz: 3}}", "section pilot names no node"),
    ],
)
def test_a_file_that_is_not_a_parameters_file_is_rejected(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "s.yaml"
    path.write_text(text)
    with pytest.raises(ScenarioError, match=message):
        load_scenario(path)


def test_sections_match_nodes_in_any_namespace_and_by_wildcard(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(
        "/**: {ros__parameters: {recorded: true, use_sim_time: false}}\n"
        "controller: {ros__parameters: {hierarchical_printed: {sway_weight: 2e-3}}}\n"
        "/alpha/vessel_sim: {ros__parameters: {duration: 7}}\n"
    )
    s = load_scenario(path)
    assert all(getattr(s, node).recorded for node in NODES)
    assert s.controller.hierarchical_printed.sway_weight == 0.002
    assert s.vessel_sim.duration == 7.0


def test_the_resolved_file_has_every_parameter_and_loads_as_the_same_scenario(tmp_path: Path) -> None:
    s = load_scenario("case2_tracking", {"vessel_sim.substeps": 2})
    path = tmp_path / "case2_tracking.yaml"
    path.write_text(dump_scenario(s))
    assert load_scenario(path) == s
    document = yaml.safe_load(path.read_text())
    for node, cls in NODES.items():
        tree = document[f"/**/{node}"]["ros__parameters"]
        for name in schema.entries(cls):
            branch = tree
            for part in name.split("."):
                branch = branch[part]


def test_numbers_are_parsed_as_ros_parses_them() -> None:
    assert read_yaml("[1e5, 1.0e+5, -2E-3, 1, 0x, 1_0, 1_0.5, 1:30]") == [1e5, 1e5, -0.002, 1, "0x", "1_0", "1_0.5", "1:30"]


def test_a_scenario_that_does_not_choose_a_mode_is_in_lockstep(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("vessel_sim: {ros__parameters: {duration: 1}}\n")
    assert all(getattr(load_scenario(path), node).lockstep for node in NODES)
    path.write_text("/**: {ros__parameters: {lockstep: false}}\n")
    assert not any(getattr(load_scenario(path), node).lockstep for node in NODES)


def test_the_nodes_of_a_namespace_have_frames_of_their_own() -> None:
    scenario = load_scenario("case2_tracking", for_nodes(recorded=True, real_time=True, namespace="fleet/alpha"))
    assert {getattr(scenario, node).frame_prefix for node in NODES} == {"fleet/alpha/"}


def test_the_error_for_an_unknown_parameter_lists_few_names() -> None:
    with pytest.raises(ParameterError) as raised:
        load_scenario("case2_tracking", {"controller.zzz": 1})
    assert "allowed are lockstep, recorded, frame_prefix, ride_through, real_time.*, law, rate_hz" in str(raised.value)
    assert len(str(raised.value)) < 400


def test_a_parameter_given_twice_is_refused(tmp_path: Path) -> None:
    text = scenario_text("case2_tracking")
    twice = tmp_path / "twice.yaml"
    twice.write_text(text.replace("    rate_hz: 100.0", "    rate_hz: 50.0\n    rate_hz: 100.0", 1))
    with pytest.raises(ScenarioError, match="rate_hz is given twice"):
        load_scenario(twice)


def test_a_parameter_given_in_two_forms_is_refused(tmp_path: Path) -> None:
    twice = tmp_path / "twice.yaml"
    twice.write_text("/**: {ros__parameters: {vessel: {surge_inertia: 525.0}, vessel.surge_inertia: 600.0}}\n")
    with pytest.raises(ScenarioError, match=r"section /\*\*: vessel.surge_inertia is given twice"):
        load_scenario(twice)


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ("rate_hz: -5", r"boat\.yaml, line 4: controller\.rate_hz must be .*got -5\.0"),
        ("rate_h: 5", r"boat\.yaml, line 4: controller\.rate_h is not a parameter"),
        ("law: [1,", r"boat\.yaml cannot be read: [^<]*, line "),
    ],
)
def test_an_error_in_a_file_names_the_file_and_the_line(tmp_path: Path, law: str, message: str) -> None:
    (tmp_path / "boat.yaml").write_text(f"# a boat\ncontroller:\n  ros__parameters:\n    {law}\n")
    with pytest.raises((ParameterError, ScenarioError), match=message):
        load_scenario(tmp_path / "boat.yaml")


def test_an_error_in_a_change_blames_no_file(tmp_path: Path) -> None:
    (tmp_path / "boat.yaml").write_text("controller:\n  ros__parameters:\n    rate_hz: 50.0\n")
    with pytest.raises(ParameterError, match=r"^controller\.rate_hz must be .*got -5\.0"):
        load_scenario(tmp_path / "boat.yaml", {"controller.rate_hz": -5.0})
