"""Settings that are given and have no effect, because another setting turns off what they describe.

A file may keep settings of what it turns off expressly, such as the period of waves of height 0, and those of modes and laws that
it does not choose; a run's own file has a value for every parameter, so that only values count that are not the default. What a
person gives on the command line is meant to have an effect, and always counts.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.node_list import CONTROLLER, PLANT, REFERENCE
from vessel_hsmc_ros.guidance.factory import REFERENCES
from vessel_hsmc_ros.scenario.parameters import VESSEL_NAME

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
