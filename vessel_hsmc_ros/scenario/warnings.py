"""Warnings on a scenario that is valid, but probably not what was meant, and on settings that have no effect.

A setting has none where another one turns off what it describes. A file may keep settings of what it turns off expressly, such as
the period of waves of height 0, and those of modes and laws that it does not choose; a run's own file has a value for every
parameter, so that only values count that are not the default. What a person gives on the command line always counts.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.control.laws.hierarchical_parameters import sway_warning
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.hull import another_ship, kept
from vessel_hsmc_ros.core.node_list import CONTROLLER, PLANT, REFERENCE
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.guidance.factory import REFERENCES, make_reference
from vessel_hsmc_ros.guidance.waypoints import scheduled_goals, scheduled_path
from vessel_hsmc_ros.plant.dynamics import hull_warning
from vessel_hsmc_ros.scenario.parameters import VESSEL_NAME
from vessel_hsmc_ros.scenario.scenario import Scenario

Values = Mapping[str, Any]


@dataclass(frozen=True)
class Rule:
    """Settings that another setting turns off."""

    settings: tuple[str, ...]  # patterns of their names
    off: Callable[[Values], bool]  # whether the values of the node turn them off
    why: str  # the reason, for the message
    switches: tuple[str, ...] = ()  # settings that excuse a file: one that gives them has turned off the others expressly
    alternative: bool = False  # whether they are those of a mode or law, of which a file may keep several

    def names(self, values: Values) -> list[str]:
        """The settings among the parameters of a node."""
        return [name for name in values if name not in self.switches and any(fnmatchcase(name, each) for each in self.settings)]


def _without(switches: tuple[str, ...], *settings: str) -> Rule:
    """Settings that have no effect while all switches, numbers or lists of numbers, are zero."""

    def off(values: Values) -> bool:
        return not any(any(value) if isinstance(value := values[name], tuple) else value for name in switches)

    return Rule(settings, off, f"{' and '.join(switches)} {'are' if len(switches) > 1 else 'is'} zero", switches)


def _in_group(group: str, names: str) -> tuple[str, ...]:
    return tuple(f"{group}.{name}" for name in names.split())


IN_LOCKSTEP = Rule(("real_time.*",), lambda values: bool(values.get("lockstep")), "lockstep is true", alternative=True)

OF_THE_PLANT = (
    _without(_in_group("disturbance.periodic", "surge_force sway_force yaw_moment"), "disturbance.periodic.frequency"),
    _without(_in_group("disturbance.earth_fixed", "east_force north_force gust_deviation"), "disturbance.earth_fixed.lever"),
    _without(("disturbance.earth_fixed.gust_deviation",), "disturbance.earth_fixed.gust_time_constant"),
    _without(("disturbance.waves.significant_height",), "disturbance.waves.*"),
    Rule(
        ("sensors.velocity_*", "sensors.yaw_rate_*"),
        lambda values: not values["sensors.measures_velocity"],
        "sensors.measures_velocity is false",
    ),
    Rule(
        ("actuators.surge_*", "actuators.yaw_*"),
        lambda values: values["actuators.kind"] == "thrusters",
        "actuators.kind is thrusters, which have limits and lags of their own in vessel.thrusters",
        (VESSEL_NAME,),  # a vessel by name brings its own for the wrench
    ),
)


def _of_the_reference() -> Iterator[Rule]:
    for program in ("surge_force", "yaw_moment", "course.heading"):
        yield _without((f"{program}_sine.amplitude",), f"{program}_sine.*")
        yield from (_without((f"{program}_{kind}.values",), f"{program}_{kind}.times") for kind in ("steps", "ramp"))
    areas = "lawnmower.rectangle", "lawnmower.polygon"
    yield _without(areas, "lawnmower.heading")
    for area in areas:
        yield Rule(
            ("lawnmower.legs", "lawnmower.leg_length"),
            lambda values, area=area: any(values[area]),  # type: ignore[misc]
            f"{area} is given, from which they follow",
        )
    for mode in REFERENCES:
        own = ("surge_force*", "yaw_moment*") if mode == "virtual_ship" else (f"{mode}.*",)
        yield Rule(own, _unlike("mode", mode), f"mode is not {mode}", alternative=True)


def _of_the_controller() -> Iterator[Rule]:
    observer = "observer.enabled"
    yield Rule(("observer.*",), lambda values: not values[observer], f"{observer} is false", (observer,))
    action = "safety.action"
    for kind, name in {"hold": "safety.hold_time", "fallback": "safety.fallback_law"}.items():
        yield Rule((name,), _unlike(action, kind), f"{action} is not {kind}", (action,))
    yield _without(("open_loop.surge_force", "open_loop.yaw_moment"), "open_loop.times")
    for law in LAWS:
        yield Rule((f"{law}.*",), _unused(law), f"law is not {law}", alternative=True)


def _unlike(name: str, choice: str) -> Callable[[Values], bool]:
    return lambda values: values[name] != choice


def _unused(law: str) -> Callable[[Values], bool]:
    """Whether a law is neither the chosen one nor that of the safe action."""
    return lambda values: law != values["law"] and (values["safety.action"], values["safety.fallback_law"]) != ("fallback", law)


def rules_of(node: str) -> tuple[Rule, ...]:
    """The rules on the parameters of a node."""
    own = {PLANT: lambda: OF_THE_PLANT, REFERENCE: _of_the_reference, CONTROLLER: _of_the_controller}.get(node, tuple)
    return IN_LOCKSTEP, *own()


def not_in_use(node: str, values: Values) -> dict[str, str]:
    """The parameters of the modes or laws that a node does not run, with the reason.

    `values`: of all parameters of the node.
    """
    rules = (rule for rule in rules_of(node) if rule.alternative and rule.off(values))
    return {name: rule.why for rule in rules for name in rule.names(values)}


def ineffective(node: str, parameters: Any, given: Collection[str], commanded: Collection[str] = ()) -> list[str]:
    """Name the settings of a node that are given and have no effect.

    `commanded`: those among them that a person gave on the command line. Returns one line for each rule that applies, with the
    parameters as `node.parameter`.
    """
    values, entries = schema.flatten(parameters), schema.entries(type(parameters))
    other = {name for name in given if name in values and values[name] != entries[name].default}
    lines = []
    for rule in rules_of(node):
        excused = rule.alternative or any(switch in given for switch in rule.switches)
        counted = {*commanded} if excused else {*commanded, *other}
        names = [f"{node}.{name}" for name in rule.names(values) if name in counted] if rule.off(values) else []
        if names:
            verbs = "is given and has" if len(names) == 1 else "are given and have"
            lines.append(f"{', '.join(names)} {verbs} no effect: {node}.{rule.why}")
    return lines


SHIPS = (PLANT, REFERENCE, CONTROLLER)  # the nodes that have hull data
FORCES = ("surge_force", "sway_force", "yaw_moment")


def check_scenario(scenario: Scenario) -> list[str]:
    """Find what a scenario leaves at the paper's values although it describes another ship, and a law that was not chosen.

    Returns one line for each finding; none for the scenarios of the package.
    """
    found = []
    if any(another_ship(getattr(scenario, node).vessel) for node in SHIPS):
        found = [*_partial_hull(scenario), *_papers_disturbance(scenario)]
    if gain := hull_warning(scenario.vessel_sim.vessel):
        found.append(gain)
    if scenario.controller.law == "hierarchical" and (lost := _loss(scenario)):
        found.append(lost)
    reference = scenario.reference_ship
    if reference.mode == "path":  # its plan is the one of the check of the scenario
        slow = getattr(make_reference(reference, 1.0 / reference.rate_hz), "slow", "")
        found += [f"reference_ship.path: {slow}"] if slow else []
    if "controller.law" not in scenario.given:
        found.append(
            f"controller.law is not given: it is {scenario.controller.law}, the law of the paper; guided suits every ship"
        )
    return found


def check_effects(scenario: Scenario, commanded: Collection[str] = (), given: Collection[str] | None = None) -> list[str]:
    """Find the settings of a scenario that are given and have no effect.

    `given`: those of its file that are judged as well; None for all. Returns one line for each finding; none for the scenarios
    of the package.
    """
    lines: list[str] = []
    of_file = scenario.given if given is None else given
    for node in SHIPS:
        given, own = (_of_node(node, names) for names in (of_file, commanded))
        lines += ineffective(node, getattr(scenario, node), given, own)
    return lines


def check_goals(scenario: Scenario) -> list[str]:
    """Find that the reference of a scenario waits for messages, which a run without ROS does not have."""
    p = scenario.reference_ship
    goals = any(time >= 0.0 for time, _ in scheduled_goals(p.goal))
    set_alone = {"goal": (goals, "goal.poses"), "path": (scheduled_path(p.path, p.motion.speed) is not None, "path.waypoints")}
    is_set, name = set_alone.get(p.mode, (True, ""))
    return [] if is_set else [f"reference_ship.mode = {p.mode} has no effect without {name}: the reference stays at initial_pose"]


def _loss(scenario: Scenario) -> str:
    """A sentence on a declared sway with which the hierarchical law loses the path; empty where it keeps it."""
    c = scenario.controller
    return sway_warning(c.hierarchical, c.vessel.as_controlled(), RateGrid(c.rate_hz).period)


def _of_node(node: str, names: Collection[str]) -> set[str]:
    return {name.removeprefix(f"{node}.") for name in names if name.startswith(f"{node}.")}


def _partial_hull(scenario: Scenario) -> list[str]:
    """The hull data that another ship has in common with the paper's ship."""
    remaining = {node: kept(getattr(scenario, node).vessel) for node in SHIPS}
    texts: list[str] = []
    for name, text in {key: value for of_node in remaining.values() for key, value in of_node.items()}.items():
        nodes = [node for node in SHIPS if hasattr(getattr(scenario, node).vessel, name)]
        keeping = [node for node in nodes if name in remaining[node]]
        texts += [f"vessel.{text}"] if keeping == nodes else [f"{node}.vessel.{text}" for node in keeping]
    advice = "give them in a section `vessel` for all nodes (vessel-hsmc init writes one)"
    return (
        [f"only a part of the hull is given, the paper's ship's values remain in {', '.join(texts)}: {advice}"] if texts else []
    )


def _papers_disturbance(scenario: Scenario) -> list[str]:
    """The disturbance of the paper's ship, where it acts on another one."""
    remaining = [text for name, text in kept(scenario.vessel_sim.disturbance.periodic).items() if name in FORCES]
    if not remaining or not another_ship(scenario.vessel_sim.vessel):
        return []
    return [
        f"the paper's disturbance acts on another ship: vessel_sim.disturbance.periodic has {', '.join(remaining)};"
        " set them to 0 for calm water"
    ]
