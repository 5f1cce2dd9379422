"""Settings that are given and have no effect are named, and no others."""

import pytest
from durations import rest_long

from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.guidance.factory import REFERENCES
from vessel_hsmc_ros.scenario.own_ship import MainData, scenario_for, scenario_text, thruster_layout
from vessel_hsmc_ros.scenario.parameters import NODES, ineffective, rules_of
from vessel_hsmc_ros.scenario.scenario import dump_scenario, load_scenario, parse_scenario, scenario_names
from vessel_hsmc_ros.scenario.vessels import read_vessel, vessel_names
from vessel_hsmc_ros.scenario.warnings import SHIPS, check_effects, check_goals

PLAIN = "/**/controller: {ros__parameters: {law: guided}}"

BOAT = MainData(length=4.0, mass=500.0, surge_force_limit=300.0, yaw_moment_limit=250.0, wind=5.0, current=0.3, lag=0.2)

NEW = {
    "any": scenario_text("new", MainData()),
    "boat": scenario_text("new", BOAT),
    "noisy": scenario_text("new", MainData(length=4.0, gps_noise=1.0)),
    "thrusters": scenario_text("new", BOAT, thruster_layout(["-1.5,0.5,100,60", "-1.5,-0.5,100,60"], 4.0)),
    **{name: scenario_for(read_vessel(name).values, name) for name in vessel_names()},
    **{f"{name} by thrusters": scenario_for(read_vessel(name).values, name, thrusters=True) for name in ("otter", "wam_v_16")},
}
"""What `init` writes."""

WITHOUT_EFFECT: list[dict[str, object]] = [
    {"vessel_sim.disturbance.waves.peak_period": 5.0},
    {"vessel_sim.disturbance.waves.direction": 1.0},
    {"vessel_sim.disturbance.earth_fixed.gust_time_constant": 30.0},
    {"vessel_sim.disturbance.earth_fixed.lever": 1.0},
    {"vessel_sim.sensors.velocity_noise": 0.1, "vessel_sim.sensors.measures_velocity": False},
    {"vessel_sim.sensors.yaw_rate_bias": 0.1, "vessel_sim.sensors.measures_velocity": False},
    *(
        {f"reference_ship.{name}": value}
        for program in ("surge_force", "yaw_moment", "course.heading")
        for name, value in {
            f"{program}_sine.frequency": 0.1,
            f"{program}_sine.phase": 1.0,
            f"{program}_steps.times": [5.0],
            f"{program}_ramp.times": [5.0],
        }.items()
    ),
    {"reference_ship.lawnmower.heading": 1.0},
    {"reference_ship.lawnmower.legs": 6, "reference_ship.lawnmower.rectangle": [0.0, 0.0, 400.0, 200.0]},
    {"reference_ship.lawnmower.leg_length": 90.0, "reference_ship.lawnmower.rectangle": [0.0, 0.0, 400.0, 200.0]},
    {"controller.open_loop.times": [5.0]},
    {"controller.observer.position_noise": 2.0},
    {"controller.safety.hold_time": 5.0},
    {"controller.safety.fallback_law": "pd"},
]
"""The first setting of each has no effect."""

WITH_EFFECT: list[dict[str, object]] = [
    {"vessel_sim.disturbance.waves.peak_period": 5.0, "vessel_sim.disturbance.waves.significant_height": 1.0},
    {"vessel_sim.disturbance.earth_fixed.lever": 1.0, "vessel_sim.disturbance.earth_fixed.gust_deviation": 10.0},
    {"vessel_sim.disturbance.periodic.frequency": 0.1},
    {"vessel_sim.sensors.velocity_noise": 0.1},
    {"vessel_sim.actuators.surge_lag": 1.0},
    {"reference_ship.surge_force_sine.phase": 1.0, "reference_ship.surge_force_sine.amplitude": 10.0},
    {
        "reference_ship.mode": "course",
        "reference_ship.course.heading_steps.times": [5.0],
        "reference_ship.course.heading_steps.values": [1.0],
    },
    {"reference_ship.lawnmower.legs": 6, "reference_ship.mode": "lawnmower"},
    {
        "reference_ship.mode": "lawnmower",
        "reference_ship.lawnmower.heading": 1.0,
        "reference_ship.lawnmower.run_in": 100.0,
        "reference_ship.lawnmower.rectangle": [0.0, 0.0, 400.0, 200.0],
    },
    {"controller.observer.position_noise": 2.0, "controller.observer.enabled": True},
    {"controller.safety.fallback_law": "los_pid", "controller.safety.action": "fallback"},
    {"controller.guided.velocity_noise": 0.1},
]


@pytest.mark.parametrize("given", WITHOUT_EFFECT, ids=lambda given: next(iter(given)))
def test_a_setting_without_effect_is_named_with_the_reason(given: dict[str, object]) -> None:
    scenario = parse_scenario(PLAIN, "s", given)
    (line,) = [each for each in check_effects(scenario) if each.startswith(f"{next(iter(given))} is given")]
    assert " has no effect: " in line


@pytest.mark.parametrize("given", WITH_EFFECT, ids=lambda given: next(iter(given)))
def test_a_setting_with_an_effect_is_not_named_even_if_it_is_given_on_the_command_line(given: dict[str, object]) -> None:
    assert check_effects(parse_scenario(PLAIN, "s", given), given) == []


def test_the_limits_of_the_wrench_have_no_effect_on_thrusters() -> None:
    path = share_directory() / "config" / "thrusters" / "case2_thrusters.yaml"
    (line,) = check_effects(load_scenario(path, {"vessel_sim.actuators.surge_lag": 1.0, "vessel_sim.actuators.yaw_lag": 1.0}))
    assert line.startswith("vessel_sim.actuators.surge_lag, vessel_sim.actuators.yaw_lag are given and have no effect: ")


def test_what_a_file_turns_off_expressly_may_keep_its_settings_but_not_those_of_the_command_line() -> None:
    name, off = "vessel_sim.disturbance.waves.peak_period", "vessel_sim.disturbance.waves.significant_height"
    scenario = parse_scenario(PLAIN, "s", {name: 5.0, off: 0.0})
    assert check_effects(scenario) == []
    (line,) = check_effects(scenario, [name])
    assert line.startswith(name)


@pytest.mark.parametrize("law", sorted(LAWS.built_in))
def test_settings_of_another_law_are_named_if_they_are_given_on_the_command_line(law: str) -> None:
    other = "pd" if law != "pd" else "guided"
    name = [each for each in schema.entries(NODES["controller"]) if each.startswith(f"{law}.")][-1]
    assert ineffective("controller", schema.build(NODES["controller"], {"law": law}, "controller"), [name], [name]) == []
    parameters = schema.build(NODES["controller"], {"law": other}, "controller")
    assert ineffective("controller", parameters, [name]) == []
    assert f"controller.law is not {law}" in ineffective("controller", parameters, [name], [name])[-1]


def test_settings_of_the_fallback_law_have_an_effect() -> None:
    given: dict[str, object] = {"controller.safety.action": "fallback", "controller.los_pid.lookahead_time": 9.0}
    assert check_effects(parse_scenario(PLAIN, "s", given), given) == []


@pytest.mark.parametrize("mode", sorted(REFERENCES))
def test_settings_of_another_mode_are_named_if_they_are_given_on_the_command_line(mode: str) -> None:
    name = (
        "surge_force"
        if mode == "virtual_ship"
        else next(each for each in schema.entries(NODES["reference_ship"]) if each.startswith(f"{mode}."))
    )
    other = schema.build(NODES["reference_ship"], {"mode": "course" if mode != "course" else "goal"}, "reference_ship")
    assert ineffective("reference_ship", other, [name]) == []
    assert f"reference_ship.mode is not {mode}" in ineffective("reference_ship", other, [name], [name])[-1]


@pytest.mark.parametrize("name", rest_long([*scenario_names(), "thrusters/case2_thrusters"], 5))
def test_the_files_of_the_package_have_no_setting_without_effect_and_neither_has_the_file_of_their_run(name: str) -> None:
    scenario = load_scenario(share_directory() / "config" / f"{name}.yaml")
    assert check_effects(scenario) == []
    assert check_effects(parse_scenario(dump_scenario(scenario), name)) == []


@pytest.mark.parametrize("text", NEW.values(), ids=NEW.keys())
def test_new_scenarios_have_no_setting_without_effect(text: str) -> None:
    assert check_effects(parse_scenario(text, "new")) == []


@pytest.mark.parametrize("node", SHIPS)
def test_every_rule_is_one_of_parameters_of_the_node(node: str) -> None:
    values = schema.flatten(NODES[node]())
    for rule in rules_of(node):
        assert rule.names(values), rule.settings
        assert set(rule.switches) <= set(values)
        assert rule.off(values) in (True, False)


@pytest.mark.parametrize(
    ("mode", "alone"), [("goal", {"goal.poses": [9.0, 9.0, 0.0]}), ("path", {"path.waypoints": [9.0, 9.0, 90.0, 9.0]})]
)
def test_a_reference_that_waits_for_messages_is_named_for_runs_without_ros(mode: str, alone: dict[str, object]) -> None:
    waiting: dict[str, object] = {"reference_ship.mode": mode, "reference_ship.initial_pose": [0.0, 0.0, 0.0]}
    (line,) = check_goals(parse_scenario(PLAIN, "s", waiting))
    assert line.startswith(f"reference_ship.mode = {mode} has no effect without {next(iter(alone))}")
    assert (
        check_goals(parse_scenario(PLAIN, "s", waiting | {f"reference_ship.{key}": value for key, value in alone.items()})) == []
    )
    assert check_goals(parse_scenario(PLAIN, "s")) == []
