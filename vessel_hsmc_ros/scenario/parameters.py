"""The parameters of every node, each declared once for ROS, YAML files, the command line and the docs, and those without effect.

A setting has none where another one turns off what it describes. A file may keep settings of what it turns off expressly, such as
the period of waves of height 0, and those of modes and laws that it does not choose; a run's own file has a value for every
parameter, so that only values count that are not the default. What a person gives on the command line always counts.
"""

from collections import UserDict
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, make_dataclass
from fnmatch import fnmatchcase
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.control.loop.observer_model import ObserverParameters
from vessel_hsmc_ros.control.safety.parameters import FreshnessParameters, SafetyParameters, check_safety
from vessel_hsmc_ros.core import node_list, schema
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.hull import NamedVessel
from vessel_hsmc_ros.core.node_list import CONTROLLER, PLANT, REFERENCE
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.core.thruster_layout import ThrusterLayout
from vessel_hsmc_ros.guidance.factory import REFERENCES, ReferenceShipParameters
from vessel_hsmc_ros.plant.simulator import PlantParameters
from vessel_hsmc_ros.scenario.parameter_groups import (
    OWNER,
    ActionParameters,
    BlackBoxParameters,
    ClockParameters,
    CommonParameters,
    DiagnosticsParameters,
    OdometryParameters,
    rate,
    transform,
    world_frames,
)
from vessel_hsmc_ros.scenario.parameter_groups import LiveParameters as LiveParameters
from vessel_hsmc_ros.scenario.parameter_groups import MarkerParameters as MarkerParameters
from vessel_hsmc_ros.scenario.parameter_groups import RecorderParameters as RecorderParameters
from vessel_hsmc_ros.scenario.parameters_file import (
    FAULTS,
    USE_SIM_TIME,
    VESSEL,
    VESSEL_NAME,
    flat,
    in_long_form,
    parsed,
)


@dataclass(frozen=True)
class SimParameters(PlantParameters, CommonParameters):
    """Parameters of vessel_sim."""

    rate_hz: float = rate("Rate of the odometry messages and of the plant's time steps.")
    duration: float = parameter(
        0.0, "Simulated time after which the plant ends the run; 0 means no end.", unit="s", low=0.0, high=1e6
    )
    command_timeout: float = parameter(
        2.0,
        "In lockstep, the longest wait for a command, in wall time; in real time, the age of a command after which the"
        " wrench is set to zero.",
        unit="s",
        low=0.01,
        high=60.0,
    )
    publish_tf: bool = transform()
    clock: ClockParameters = group(ClockParameters)
    freshness: FreshnessParameters = group(FreshnessParameters)


@dataclass(frozen=True)
class ReferenceParameters(ReferenceShipParameters, CommonParameters):
    """Parameters of reference_ship."""

    rate_hz: float = rate("Rate of the reference messages.")
    frames: tuple[str, ...] = world_frames("goals and paths")
    actions: ActionParameters = group(ActionParameters)

    def __post_init__(self) -> None:
        if self.actions.at_end == "return" and self.mode not in ("goal", "path"):
            raise ParameterError(
                f"{OWNER}.at_end must be hold or stop in mode {self.mode} (got return): only goal and path have a way back"
            )


def choice_of_law(names: tuple[str, ...]) -> str:
    """Declare the parameter that selects the control law among some names."""
    remedy = "a law of your own needs --law-file FILE.py on the command line, or its package installed"
    return parameter("hierarchical", "The control law.", choices=names, remedy=remedy)


@dataclass(frozen=True)
class ControlParameters(CommonParameters):
    """Parameters of controller that concern all laws."""

    law: str = choice_of_law(tuple(LAWS.built_in))
    rate_hz: float = rate("Rate of the control law.")
    input_timeout: float = parameter(
        0.5, "In real time, the age of odometry or reference from which on the safe action begins.", unit="s", low=0.01, high=60.0
    )
    start_enabled: bool = parameter(
        False,
        "In real time, command as soon as the node is ready; false waits in standby for ~/enable. Lockstep always starts, and so"
        " does a run with its own simulated plant.",
    )
    autostart: bool = parameter(
        True,
        "In real time, go to the lifecycle state inactive by itself; false stays unconfigured, and never activates itself, for a"
        " lifecycle manager. Lockstep always starts.",
    )
    odometry: OdometryParameters = group(OdometryParameters)
    safety: SafetyParameters = group(SafetyParameters)
    vessel: KnownVessel = group(KnownVessel)
    observer: ObserverParameters = group(ObserverParameters)


if TYPE_CHECKING:

    class LawParameters(ControlParameters):
        """The parameters of controller with a group for every law of this package, which has the law's name."""

        def __getattr__(self, name: str) -> Any: ...

else:
    _groups = [(name, kind.parameters, group(kind.parameters)) for name, kind in LAWS.built_in.items()]
    LawParameters = make_dataclass("LawParameters", _groups, bases=(ControlParameters,), frozen=True)


@dataclass(frozen=True)
class ControllerParameters(LawParameters):
    """Parameters of controller; `controller_parameters` adds those of the laws that are not of this package."""

    diagnostics: DiagnosticsParameters = group(DiagnosticsParameters)
    black_box: BlackBoxParameters = group(BlackBoxParameters)

    def __post_init__(self) -> None:
        if self.lockstep and self.odometry.form != "odometry":
            raise ParameterError(
                f"controller.odometry.form must be odometry in lockstep, as the plant publishes it (got {self.odometry.form})"
            )
        check_safety(self.safety, self.law, tuple(LAWS), (self.vessel.surge_force_limit, self.vessel.yaw_moment_limit))


def controller_parameters() -> type[ControllerParameters]:
    """The parameters of controller with a group for every registered law."""
    return _with_groups(tuple((name, kind.parameters) for name, kind in LAWS.others.items()))


@cache
def _with_groups(laws: tuple[tuple[str, type], ...]) -> type[ControllerParameters]:
    """The parameters of controller with groups for further laws, by their names and dataclasses."""
    if not laws:
        return ControllerParameters
    added = [("law", str, choice_of_law((*LAWS.built_in, *dict(laws)))), *((name, cls, group(cls)) for name, cls in laws)]
    # Pickled by its values: pickle finds a class by its name, which here is that of the base.
    by_values = {"__reduce__": lambda self: (_restored, (schema.flatten(self),))}
    return make_dataclass(ControllerParameters.__name__, added, bases=(ControllerParameters,), namespace=by_values, frozen=True)


def _restored(values: dict[str, schema.Value]) -> ControllerParameters:
    return schema.build(controller_parameters(), values, "controller")


@dataclass(frozen=True)
class FittedThrusters(NamedVessel):
    """The part of the hull data that the allocation takes."""

    thrusters: ThrusterLayout = group(ThrusterLayout)


@dataclass(frozen=True)
class AllocationParameters(CommonParameters):
    """Parameters of thruster_allocation, which takes part where thrusters drive the ship."""

    command_timeout: float = parameter(
        0.5,
        "In real time, the age of a command after which all thrusts are set to zero.",
        unit="s",
        low=0.01,
        high=60.0,
        tunable=True,
    )
    freshness: FreshnessParameters = group(FreshnessParameters)
    odometry: OdometryParameters = group(OdometryParameters)
    vessel: FittedThrusters = group(FittedThrusters)


class Declarations(UserDict[str, Any]):
    """The parameters of nodes by their names; those of controller follow the registry of laws.

    A node of a room above registers its parameters by the name of their class, in the list of nodes; they are loaded when used.
    """

    def __getitem__(self, node: str) -> type:
        if node == "controller":
            return controller_parameters()
        declared: type | str = super().__getitem__(node)
        if isinstance(declared, str):
            module, _, name = declared.partition(":")
            declared = getattr(import_module(module), name)
        return declared  # type: ignore[return-value]


NODES = Declarations(
    {
        "vessel_sim": SimParameters,
        "reference_ship": ReferenceParameters,
        "controller": ControllerParameters,
        "thruster_allocation": AllocationParameters,
        "recorder": RecorderParameters,
    }
)

WATCHERS = Declarations({name: program.parameters for name, program in node_list.WATCHERS.items()})
"""Nodes outside the closed loop, whose parameters are not part of a scenario."""

FIRST = (
    "controller.vessel.name",
    "controller.law",
    "controller.rate_hz",
    "controller.odometry.form",
    "controller.input_timeout",
    "controller.safety.action",
    "controller.safety.fence.inside",
    "reference_ship.mode",
)
"""The parameters that the owner of a vessel sets first, in this order; the others may keep their defaults."""


def declared() -> dict[str, dict[str, schema.Entry]]:
    """The declarations of the nodes of a scenario, by node and dotted name."""
    return {node: schema.entries(cls) for node, cls in NODES.items()}


def vessel_names() -> list[str]:
    """The hull data that any node declares, by their dotted names."""
    every = (name for cls in (NODES | WATCHERS).values() for name in schema.entries(cls))
    return list(dict.fromkeys(name for name in every if name.startswith(VESSEL)))


def without_foreign_hull_data(values: Mapping[str, object], declared: Collection[str]) -> dict[str, object]:
    """The values without hull data that only other nodes declare, so that one section `vessel` serves all nodes."""
    foreign = [name for name in values if name.startswith(VESSEL) and name not in declared]
    if foreign:
        names = vessel_names()
        for name in foreign:
            if name not in names:
                raise ParameterError(f"{name} is not a parameter of any node: {schema.suggestion(name, names)}")
    return {name: value for name, value in values.items() if name not in foreign}


def read_parameters(
    text: str, nodes: Mapping[str, Collection[str]], source: str, namespace: str | None = None
) -> dict[str, dict[str, object]]:
    """Read the parameters of nodes from a ROS parameters file.

    As in ROS, sections further down override those above, and `/**` stands for all nodes. There the hull data below `vessel.`
    may be given once for all: each node takes those that it declares. `nodes`: the names of the nodes, in whatever namespace,
    with the names of their parameters. `namespace`: of the vessel, where sections for others are to be left out.
    """
    document = parsed(text, source)
    if not isinstance(document, dict):
        raise ScenarioError(f"{source} is not a ROS parameters file: it must have node names at its top level")
    values: dict[str, dict[str, object]] = {node: {} for node in nodes}
    for section, content in document.items():
        if section == FAULTS:
            continue
        nested = content.get("ros__parameters") if isinstance(content, dict) else None
        if not isinstance(nested, dict):
            raise ScenarioError(f"{source}: section {section} has no ros__parameters")
        try:
            given = flat(nested)
        except ParameterError as error:
            raise ScenarioError(f"{source}, section {section}: {error}") from None
        parameters = in_long_form(given)
        parameters.pop(USE_SIM_TIME, None)
        addressed = _nodes_of_section(str(section), list(nodes), source) if _is_for(str(section), namespace) else ()
        for node in addressed:
            shared = len(addressed) > 1
            values[node].update(without_foreign_hull_data(parameters, nodes[node]) if shared else parameters)
    return values


def _is_for(section: str, namespace: str | None) -> bool:
    """Whether a section is for nodes of a namespace; True where either names none."""
    of = section.rpartition("/")[0].strip("/")
    return not namespace or not of or "*" in of or of == namespace.strip("/")


def _nodes_of_section(section: str, nodes: list[str], source: str) -> list[str]:
    # Only the last part of a fully qualified node name matters here: the file of one vessel has one namespace at most.
    node = section.rsplit("/", 1)[-1]
    if node in ("*", "**"):
        return nodes
    if node not in nodes:
        raise ScenarioError(f"{source}: section {section} names no node: it must be /** or one of {', '.join(nodes)}")
    return [node]


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
