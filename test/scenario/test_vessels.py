import math
from pathlib import Path

import pytest

from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError, VesselHsmcError
from vessel_hsmc_ros.core.schema import entries
from vessel_hsmc_ros.scenario.parameters import MarkerParameters, ReferenceParameters
from vessel_hsmc_ros.scenario.scenario import Scenario, dump_scenario, load_scenario, parse_scenario
from vessel_hsmc_ros.scenario.vessels import read_vessel, vessel_names, with_vessel
from vessel_hsmc_ros.scenario.warnings import check_scenario

CALM = "case3_calm"

BOAT = """\
vessel:
  {length: 3.0, beam: 1.2, surge_inertia: 300.0, sway_inertia: 400.0, yaw_inertia: 200.0,
   surge_damping: 60.0, sway_damping: 200.0, yaw_damping: 100.0, surge_force_limit: 250.0, yaw_moment_limit: 80.0}
"""


def scenario(section: str, node: str = "/**") -> Scenario:
    return parse_scenario(
        f"{node}:\n  ros__parameters:\n    {section}\n/**/reference_ship: {{ros__parameters: {{mode: goal}}}}", "s"
    )


def boat(folder: Path, text: str = BOAT) -> Path:
    path = folder / "boat.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("section", ["vessel: otter", "vessel: {name: otter}", "vessel.name: otter"])
def test_a_vessel_by_name_gives_its_hull_to_every_node(section: str) -> None:
    otter = scenario(section)
    assert otter.vessel_sim.vessel.sway_yaw_inertia == otter.controller.vessel.sway_yaw_inertia == 11.0
    assert otter.reference_ship.vessel.surge_damping == 77.554
    assert otter.vessel_sim.actuators.surge_force_limit == otter.controller.vessel.surge_force_limit == 239.36
    assert otter.vessel_sim.actuators.surge_lag == 0.1
    assert {node.vessel.name for node in (otter.vessel_sim, otter.reference_ship, otter.controller)} == {"otter"}


def test_the_dead_times_of_a_vessel_are_those_of_its_actuators_and_known_to_the_law(tmp_path: Path) -> None:
    path = boat(tmp_path, BOAT.replace("length", "surge_dead_time: 0.4, yaw_dead_time: 0.2, length"))
    slow = scenario(f"vessel: {path}")
    for found in (slow.vessel_sim.actuators, slow.controller.vessel):
        assert (found.surge_dead_time, found.yaw_dead_time) == (0.4, 0.2)


def test_what_a_vessel_leaves_out_is_zero_and_not_of_the_papers_ship() -> None:
    otter = scenario("vessel: otter")
    assert otter.vessel_sim.vessel.sway_damping_cubic == 0.0
    assert otter.vessel_sim.vessel.as_printed is False


def test_explicit_values_override_those_of_the_vessel_wherever_they_are_given() -> None:
    longer = scenario("vessel: {name: otter, length: 2.1, surge_force_limit: 100.0}")
    assert longer.vessel_sim.vessel.length == 2.1
    assert longer.vessel_sim.actuators.surge_force_limit == longer.controller.vessel.surge_force_limit == 100.0
    assert load_scenario(CALM, {"vessel.length": 2.1, "vessel": "otter"}).vessel_sim.vessel.length == 2.1
    assert load_scenario(CALM, {"vessel": "otter", "vessel_sim.actuators.surge_lag": 0.3}).vessel_sim.actuators.surge_lag == 0.3


def test_the_papers_ship_by_name_is_the_ship_without_a_name() -> None:
    named, default = load_scenario(CALM, {"vessel": "paper_ship"}), load_scenario(CALM)
    assert named.changed({"vessel.name": ""}) == default


def test_a_changed_scenario_takes_over_nothing_of_its_former_vessel() -> None:
    changed = load_scenario(CALM, {"vessel": "otter"}).changed({"vessel": "heron"})
    assert changed == load_scenario(CALM, {"vessel": "heron"})
    assert changed.vessel_sim.vessel.sway_yaw_inertia == 0.0
    assert changed.changed({"vessel": "wam_v_16"}).vessel_sim.actuators.surge_lag == 0.0


def test_the_values_of_a_vessel_count_as_given() -> None:
    given = load_scenario(CALM, {"vessel": "otter"}).given
    assert {"vessel_sim.vessel.sway_yaw_inertia", "controller.vessel.yaw_moment_limit"} <= given


@pytest.mark.parametrize("name", vessel_names())
def test_every_vessel_of_the_library_is_a_complete_ship(name: str) -> None:
    loaded = load_scenario(CALM, {"vessel": name, "controller.law": "guided"})
    assert not [line for line in check_scenario(loaded) if "hull" in line]
    vessel = read_vessel(name)
    assert vessel.mass
    assert {"citation"} <= vessel.source.keys()
    assert vessel.verified


def test_a_resolved_scenario_needs_the_vessel_file_no_more(tmp_path: Path) -> None:
    path = boat(tmp_path)
    loaded = load_scenario(CALM, {"vessel": str(path)})
    path.unlink()
    again = parse_scenario(dump_scenario(loaded), CALM)
    assert again == loaded
    assert again.vessel_sim.vessel.name == str(path.resolve())


def test_a_path_in_a_scenario_starts_at_its_folder_or_at_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    boat(tmp_path)
    (tmp_path / "mine.yaml").write_text(
        "/**: {ros__parameters: {vessel: ./boat.yaml}}\n/**/reference_ship: {ros__parameters: {mode: goal}}\n", encoding="utf-8"
    )
    assert load_scenario(tmp_path / "mine.yaml").vessel_sim.vessel.sway_inertia == 400.0
    with pytest.raises(ScenarioError, match=r"vessel file boat\.yaml does not exist"):
        load_scenario(CALM, {"vessel": "boat.yaml"})
    monkeypatch.chdir(tmp_path)
    assert load_scenario(CALM, {"vessel": "boat.yaml"}).vessel_sim.vessel.draught == pytest.approx(0.24)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "boat.yaml").write_text(BOAT.replace("400.0", "555.0"), encoding="utf-8")
    monkeypatch.chdir(elsewhere)
    assert load_scenario(tmp_path / "mine.yaml").vessel_sim.vessel.sway_inertia == 400.0
    assert load_scenario(CALM, {"vessel": "boat.yaml"}).vessel_sim.vessel.sway_inertia == 555.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("vessel: [1]", "is not a vessel: it needs a section `vessel` with hull data"),
        ("{", "cannot be read"),
        (BOAT + "sources: {}\n", "sources is not a section: did you mean source?"),
        (BOAT + "source: [a book]\n", "source must be names and values"),
        (BOAT + "published: {top_speed: .nan}\n", "published.top_speed must be a finite number"),
        (BOAT.replace("sway_inertia: 400.0, ", ""), "vessel.sway_inertia is missing: it must be a finite number from 0.001"),
        (BOAT.replace("400.0", "-4.0"), "vessel.sway_inertia must be a finite number from 0.001"),
        (BOAT.replace("beam", "bean"), "vessel.bean is not a hull datum: did you mean beam?"),
        (BOAT.replace("{length", "{mass: no, length"), "vessel.mass must be a number above 0 kg"),
    ],
)
def test_an_unsuitable_vessel_file_is_one_line_that_names_it(tmp_path: Path, text: str, message: str) -> None:
    path = boat(tmp_path, text)
    with pytest.raises(VesselHsmcError) as raised:
        read_vessel(path)
    assert str(raised.value).startswith(f"vessel file {path}")
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


def test_an_unknown_vessel_is_an_error_with_the_known_ones() -> None:
    with pytest.raises(
        ScenarioError,
        match=r"vessel oter is unknown \(did you mean otter\?\): it must be one of cybership2, .*otter.* or the path",
    ):
        load_scenario(CALM, {"vessel": "oter"})
    with pytest.raises(ParameterError, match=r"vessel\.name must be a string.*got 3"):
        load_scenario(CALM, {"vessel": 3})
    with pytest.raises(ParameterError, match="differ: one of them is enough"):
        load_scenario(CALM, {"vessel": "otter", "vessel.name": "heron"})


def test_inputs_of_the_papers_virtual_ship_are_refused_for_a_smaller_one() -> None:
    with pytest.raises(
        ParameterError, match=r"surge_force must be at most .*got 100000 N\); vessel-hsmc init NAME --vessel otter"
    ):
        load_scenario("case2_tracking", {"vessel": "otter"})


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("name", ["surge_force", "yaw_moment"])
def test_an_input_of_the_virtual_ship_is_held_against_the_limit_of_its_own_axis_in_both_directions(
    name: str, side: float
) -> None:
    hull = read_vessel("otter").hull()
    limit = getattr(hull, f"{name}_limit")
    assert hull.surge_force_limit != hull.yaw_moment_limit
    still = {"vessel": "otter", "reference_ship.surge_force": 0.0, "reference_ship.yaw_moment": 0.0}
    load_scenario(CALM, {**still, f"reference_ship.{name}": side * limit})
    with pytest.raises(ParameterError, match=rf"reference_ship\.{name} must be .*got {side * 1.01 * limit:g} N.*"):
        load_scenario(CALM, {**still, f"reference_ship.{name}": side * 1.01 * limit})


def test_a_node_takes_what_it_declares() -> None:
    markers = with_vessel({"vessel.name": "otter"}, entries(MarkerParameters))
    assert markers == {"vessel.name": "otter", "vessel.length": 2.0, "vessel.beam": 1.08}
    reference = with_vessel({"vessel.name": "otter", "mode": "goal"}, entries(ReferenceParameters))
    assert reference["vessel.yaw_moment_limit"] == 52.7
    assert not any(name.startswith("actuators") for name in reference)


def test_the_papers_periodic_disturbance_does_not_act_on_another_ship_unless_it_is_given() -> None:
    assert scenario("vessel: otter").vessel_sim.disturbance.periodic.sway_force == 0.0
    assert scenario("vessel: paper_ship").vessel_sim.disturbance.periodic.sway_force > 0.0
    given = load_scenario(CALM, {"vessel": "otter", "vessel_sim.disturbance.periodic.sway_force": 2.0})
    assert given.vessel_sim.disturbance.periodic.sway_force == 2.0


def test_a_vessel_without_limits_keeps_those_of_each_node() -> None:
    unlimited = load_scenario(CALM, {"vessel": "otter"}).changed({"vessel": "paper_ship"})
    assert unlimited.vessel_sim.actuators.surge_force_limit == math.inf
    assert unlimited.controller.vessel.surge_force_limit == 2e5


def test_the_allocation_takes_the_thrusters_of_the_vessel_that_the_scenario_names() -> None:
    text = "/**: {ros__parameters: {vessel: otter}}\nvessel_sim: {ros__parameters: {actuators: {kind: thrusters}}}\n"
    text += "reference_ship: {ros__parameters: {surge_force: 50.0, yaw_moment: 5.0}}\n"
    scenario = parse_scenario(text, "s")
    assert scenario.thruster_allocation.vessel.thrusters.names == ("port", "starboard")
    assert scenario.thruster_allocation.vessel.thrusters == scenario.vessel_sim.vessel.thrusters
