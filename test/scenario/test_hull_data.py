"""Hull data are given once, and every node takes those that it declares."""

import math
import re

import pytest

from vessel_hsmc_ros.core.exceptions import InstabilityError, ParameterError, SimulationError
from vessel_hsmc_ros.core.hull import DrawnHull, Hull
from vessel_hsmc_ros.plant.hull_parameters import ShipParameters
from vessel_hsmc_ros.plant.simulator import within
from vessel_hsmc_ros.scenario.scenario import load_scenario, parse_scenario, scenario_names
from vessel_hsmc_ros.scenario.warnings import SHIPS, check_scenario
from vessel_hsmc_ros.simulation.offline import simulate

SHARED = "/**: {ros__parameters: {vessel: {surge_inertia: 500, sway_damping: 50.0, surge_force_limit: 300.0, length: 4.0}}}\n"
LAW = "controller: {ros__parameters: {law: guided}}\n"


def test_a_shared_section_sets_each_node_that_declares_the_name() -> None:
    s = parse_scenario(SHARED + LAW, "s")
    assert {n.vessel.surge_inertia for n in (s.vessel_sim, s.reference_ship, s.controller)} == {500.0}
    assert {n.vessel.surge_force_limit for n in (s.vessel_sim, s.reference_ship, s.controller)} == {300.0}
    assert {n.vessel.sway_damping for n in (s.vessel_sim, s.reference_ship)} == {50.0}
    assert s.vessel_sim.vessel.length == 4.0


def test_a_nodes_own_section_overrides_the_shared_one_and_stays_strict() -> None:
    own = "vessel_sim: {ros__parameters: {vessel: {surge_inertia: 600.0}}}\n"
    s = parse_scenario(SHARED + own + LAW, "s")
    assert (s.vessel_sim.vessel.surge_inertia, s.controller.vessel.surge_inertia) == (600.0, 500.0)
    with pytest.raises(ParameterError, match=r"controller\.vessel\.sway_damping is not a parameter: did you mean"):
        parse_scenario("controller: {ros__parameters: {vessel: {sway_damping: 1.0}}}", "s")


def test_a_change_of_vessel_holds_for_every_node() -> None:
    s = load_scenario("waypoints", {"vessel.surge_inertia": 110e3, "vessel.length": 30.0})
    assert {n.vessel.surge_inertia for n in (s.vessel_sim, s.reference_ship, s.controller)} == {110e3}
    assert s.vessel_sim.vessel.length == 30.0


@pytest.mark.parametrize("text", ["", "/**: {ros__parameters: {vessel: {sway_inerta: 5.0}}}"])
def test_hull_data_that_no_node_declares_are_an_error_with_a_suggestion(text: str) -> None:
    with pytest.raises(ParameterError, match=r"vessel\.sway_inerta is not a parameter of any node: did you mean vessel\.sway_in"):
        parse_scenario(text + "\n" + LAW, "s", {} if text else {"vessel.sway_inerta": 5.0})


def test_of_two_limits_the_tighter_one_holds() -> None:
    s = load_scenario("goal", {"vessel_sim.vessel.surge_force_limit": 1e5, "vessel_sim.vessel.yaw_moment_limit": 9e6})
    limits = within(s.vessel_sim.actuators, s.vessel_sim.vessel)
    assert (limits.surge_force_limit, limits.yaw_moment_limit) == (1e5, 3e6)
    assert within(load_scenario("case2_tracking").vessel_sim.actuators, ShipParameters()).surge_force_limit == math.inf


def test_waves_act_on_the_dimensions_of_the_ship_unless_others_are_given() -> None:
    sea = {"vessel_sim.disturbance.waves.significant_height": 0.5, "vessel_sim.duration": 1.0}
    own = "vessel_sim.disturbance.waves.hull_"

    def end(changes: dict[str, object]) -> list[float]:
        return list(simulate(load_scenario("waypoints", {**sea, **changes})).state[-1])

    # Of the plant alone: the law's gains follow from its own length.
    hull: dict[str, object] = {"vessel_sim.vessel.length": 8.0, "vessel_sim.vessel.draught": 0.5}
    assert end(hull) == end({f"{own}length": 8.0, f"{own}draught": 0.5})
    assert end(hull) != end({})


def test_the_drawn_hull_is_the_ships_unless_another_is_given() -> None:
    assert DrawnHull().of(Hull(4.0, 1.5)) == Hull(4.0, 1.5)
    assert DrawnHull(length=5.0).of(Hull(4.0, 1.5)) == Hull(5.0, 1.5)


@pytest.mark.parametrize("name", scenario_names())
def test_the_scenarios_of_the_package_give_no_warning(name: str) -> None:
    assert check_scenario(load_scenario(name)) == []


def test_a_part_of_a_hull_is_warned_of_with_what_remains_of_the_papers_ship() -> None:
    hull, disturbance = check_scenario(parse_scenario(SHARED + LAW, "s"))
    assert "vessel.yaw_inertia = 6.36e+07 kg·m²" in hull
    assert "controller.vessel.yaw_moment_limit = 3e+06 N·m" in hull
    assert "vessel.sway_damping =" not in hull
    assert "surge_force = 1100 N, sway_force = 2600 N, yaw_moment = 95000 N·m" in disturbance


@pytest.mark.parametrize("node", SHIPS)
def test_another_ship_of_one_node_alone_is_warned_of_with_what_the_others_keep(node: str) -> None:
    found = check_scenario(load_scenario("case3_calm", {f"{node}.vessel.yaw_inertia": 5e8}))
    (hull,) = (line for line in found if line.startswith("only a part of the hull is given"))
    assert "vessel.sway_inertia = 177900 kg" in hull
    assert [other for other in SHIPS if f"{other}.vessel.yaw_inertia = 6.36e+07 kg·m²" in hull] == [
        other for other in SHIPS if other != node
    ]


def test_a_variation_of_the_papers_ship_is_not_another_ship() -> None:
    changes: dict[str, object] = {"vessel.surge_inertia": 144e3, "vessel.surge_damping": 10750.0}
    assert check_scenario(load_scenario("case2_tracking", changes)) == []


def test_a_declared_sway_with_which_the_hierarchical_law_loses_the_path_is_warned_of_with_the_ratio() -> None:
    declared = {"controller.vessel.sway_damping_rate": 0.02, "controller.vessel.coriolis_ratio": 1.2}
    (line,) = check_scenario(load_scenario("case2_tracking", {**declared, "controller.law": "hierarchical"}))
    assert re.search(r"the Routh ratio of the path error must be above 1 \(got -?\d", line)
    assert check_scenario(load_scenario("case2_tracking", {**declared, "controller.law": "guided"})) == []


def test_a_scenario_without_a_law_is_warned_of() -> None:
    (line,) = check_scenario(parse_scenario("vessel_sim: {ros__parameters: {duration: 1.0}}", "s"))
    assert line.startswith("controller.law is not given: it is hierarchical")


def test_the_error_of_a_diverging_ship_names_the_time_and_what_it_has_of_the_papers_ship() -> None:
    changes: dict[str, object] = {
        "vessel.surge_inertia": 50.0,
        "vessel.sway_inertia": 70.0,
        "reference_ship.surge_force": 0.0,
        "reference_ship.yaw_moment": 0.0,
    }
    with pytest.raises(
        SimulationError, match=r"ship is no longer finite at t = [\d.]+ s .* remain in .*vessel\.sway_damping = 147000"
    ):
        simulate(parse_scenario(LAW + "vessel_sim: {ros__parameters: {duration: 5.0}}", "s", changes))


def test_the_error_of_a_diverging_papers_ship_names_no_hull_data() -> None:
    with pytest.raises(SimulationError) as raised:
        simulate(
            load_scenario("case2_tracking", {"vessel_sim.initial_velocity": [900.0, 900.0, 900.0], "controller.law": "guided"})
        )
    assert "remain" not in str(raised.value)


def test_the_error_of_an_unstable_gain_names_the_defaults() -> None:
    text = "controller: {ros__parameters: {rate_hz: 50.0, law: hierarchical_printed}}"
    with pytest.raises(InstabilityError, match=r"; controller\.hierarchical_printed\.yaw_reaching_gain is a default$"):
        parse_scenario(text, "s")
    with pytest.raises(InstabilityError) as raised:
        load_scenario("case2_tracking", {"controller.rate_hz": 50.0})
    assert "default" not in str(raised.value)
