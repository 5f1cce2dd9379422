"""A scenario: the parameters of all nodes from one ROS parameters file, read without ROS and validated together."""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.control.interface.law import Law
from vessel_hsmc_ros.control.laws import construct
from vessel_hsmc_ros.control.loop.observer import Observer
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import InstabilityError, ParameterError, ScenarioError
from vessel_hsmc_ros.core.fence import allowed, fence_of
from vessel_hsmc_ros.core.node_list import RECORDER, taking_part
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.faults import TOPICS, FaultScript, check_mode, check_target
from vessel_hsmc_ros.guidance.factory import check_within, make_reference
from vessel_hsmc_ros.messages.raw import check_field
from vessel_hsmc_ros.messages.topics import message_type
from vessel_hsmc_ros.plant.hull_parameters import check_hull
from vessel_hsmc_ros.scenario.fault_script import faults_of_scenario
from vessel_hsmc_ros.scenario.law_file import law_source
from vessel_hsmc_ros.scenario.named_files import SCENARIOS
from vessel_hsmc_ros.scenario.parameters import (
    NODES,
    AllocationParameters,
    ControllerParameters,
    RecorderParameters,
    ReferenceParameters,
    SimParameters,
    declared,
    read_parameters,
    without_foreign_hull_data,
)
from vessel_hsmc_ros.scenario.parameters_file import dump_parameters, in_long_form, read_file
from vessel_hsmc_ros.scenario.vessels import with_vessel


@dataclass(frozen=True)
class Scenario:
    """The parameters of a closed loop, resolved and validated."""

    name: str  # name of the scenario, for run folders and reports
    # vessel_sim, reference_ship, controller, recorder, thruster_allocation: parameters of the nodes
    vessel_sim: SimParameters
    reference_ship: ReferenceParameters
    controller: ControllerParameters
    recorder: RecorderParameters
    thruster_allocation: AllocationParameters = field(default_factory=AllocationParameters)
    # the parameters that its file and its changes set, by `node.parameter`; the others have their defaults
    given: frozenset[str] = field(default=frozenset(), compare=False, repr=False)
    faults: FaultScript | None = None  # the faults that its file scripts; None for none

    def changed(self, changes: Mapping[str, object]) -> "Scenario":
        """The same scenario with other values, as `load_scenario` with these changes gives it, without reading a file.

        `changes`: values by `node.parameter`, or `vessel.parameter` for every node that declares it. Raises ScenarioError if
        the rates do not fit each other; ParameterError if a parameter is unknown or out of range, or parameters do not fit each
        other.
        """
        values = {node: changed for node, changed in by_node(changes).items() if changed}
        parts: dict[str, Any] = {node: schema.changed(getattr(self, node), new, node) for node, new in values.items()}
        if self.faults and "vessel_sim" in parts:  # the seed of the faults is that of the scenario
            parts["faults"] = replace(self.faults, seed=parts["vessel_sim"].seed)
        return _validated(replace(self, **parts, given=self.given | full_names(values)), values)

    def with_bag(self, directory: Path, parameters: Path) -> "Scenario":
        """The same scenario, recorded into a directory, with a parameters file to store inside the bag."""
        source = law_source(self.controller.law)
        demands = tuple(topic for topic, *_ in self.vessel_sim.vessel.thrusters.topics() if self.vessel_sim.by_thrusters)
        recorder = replace(
            self.recorder,
            directory=str(directory),
            topics=tuple(dict.fromkeys((*self.recorder.topics, *demands))),
            scenario_file=str(parameters),
            scenario=self.name,
            law_source=source,
        )
        controller = self.controller
        if not controller.lockstep:  # where there is no black box
            controller = replace(controller, black_box=controller.black_box.within(directory.parent))
        return replace(self, recorder=recorder, controller=controller)


scenario_names = SCENARIOS.names


def scenario_text(name: str | Path) -> str:
    """The ROS parameters file of a scenario. Raises ScenarioError if the scenario is unknown or unreadable."""
    return SCENARIOS.read(SCENARIOS.find(name))


def load_scenario(name: str | Path, changes: Mapping[str, object] | None = None) -> Scenario:
    """Read a scenario, apply changes and check it.

    Args:
        name: A scenario of the package, such as `case2_tracking`, or the path of a ROS parameters file.
        changes: Values by `node.parameter`, such as {"controller.rate_hz": 50.0}; those of `vessel.parameter` hold for every
            node that declares it.

    Raises:
        ScenarioError: the scenario is unknown or unreadable, or its rates do not fit each other.
        ParameterError: a parameter is unknown or out of range.
    """
    path = SCENARIOS.find(name)
    return parse_scenario(SCENARIOS.read(path), path.stem, changes, f"scenario file {path}", path.parent)


def read_changes(path: Path) -> dict[str, object]:
    """Read a ROS parameters file as changes by `node.parameter`, which `load_scenario` applies to a scenario."""
    values = _read_values(read_file(path, "parameters file"), f"parameters file {path}", path.parent)
    return {f"{node}.{name}": value for node, of_node in values.items() for name, value in of_node.items()}


def _read_values(text: str, source: str, folder: Path, namespace: str | None = None) -> dict[str, dict[str, object]]:
    """Values by node and dotted name, with those of the vessel that the text names."""
    nodes = declared()
    found = read_parameters(text, nodes, source, namespace)
    return {node: with_vessel(values, nodes[node], folder) for node, values in found.items()}


def parse_scenario(
    text: str,
    name: str,
    changes: Mapping[str, object] | None = None,
    source: str = "the bag's scenario",
    folder: Path = Path(),
    namespace: str | None = None,
) -> Scenario:
    """Make a scenario from the text of a ROS parameters file.

    `changes`: values by `node.parameter`, or `vessel.parameter` for all nodes. `folder`: where the path of a vessel file in
    the text starts. `namespace`: of the vessel, where the text has sections for several.
    """
    values = _read_values(text, source, folder, namespace)
    changed = {node: of_node for node, of_node in by_node(changes or {}).items() if of_node}
    in_file = full_names(values) - full_names(changed)
    for node, of_node in changed.items():
        values[node] |= of_node
    try:
        # A node that is started alone runs in real time; a scenario is in lockstep unless it chooses otherwise.
        parts: dict[str, Any] = {node: schema.build(cls, {"lockstep": True} | values[node], node) for node, cls in NODES.items()}
        faults = faults_of_scenario(text, parts["vessel_sim"].seed, source)
        return _validated(Scenario(name, **parts, given=full_names(values), faults=faults), NODES)
    except ParameterError as error:
        raise type(error)(f"{_place(str(error), text, source, in_file)}{error}") from None


def _place(message: str, text: str, source: str, in_file: Collection[str]) -> str:
    """Where a text has the parameter with which an error message begins; empty for one that the text does not give."""
    named = re.match(r"[\w.]+", message)
    if named is None or named.group() not in in_file:
        return ""
    key = re.compile(rf"[\s{{,.]{re.escape(named.group().rpartition('.')[2])}\s*:")
    lines = [number for number, line in enumerate(text.splitlines(), start=1) if key.search(f" {line.partition('#')[0]}")]
    return f"{source}, line {lines[0]}: " if len(lines) == 1 else f"{source}: " if lines else ""


def by_node(changes: Mapping[str, object]) -> dict[str, dict[str, object]]:
    """Sort values by `node.parameter`, or `vessel.parameter` for every node that declares it, by node and parameter.

    The values of a vessel by name come with it.
    """
    values: dict[str, dict[str, object]] = {node: {} for node in NODES}
    for key, value in in_long_form(changes).items():
        node, _, parameter = key.partition(".")
        if parameter and node == "vessel":
            declaring = [each for each, cls in NODES.items() if key in schema.entries(cls)]
            if not declaring:
                without_foreign_hull_data({key: value}, ())  # raises the error that suggests a name
            for each in declaring:
                values[each][key] = value
        elif parameter and node in NODES:
            values[node][parameter] = value
        else:
            nodes = f"{', '.join(NODES)}, or vessel.parameter for all nodes"
            raise ParameterError(f"{key} is not a parameter: it must be node.parameter with a node of {nodes}")
    return {node: with_vessel(changed, schema.entries(NODES[node])) for node, changed in values.items()}


def full_names(values: Mapping[str, Mapping[str, object]]) -> frozenset[str]:
    """The names `node.parameter` of values by node and parameter."""
    return frozenset(f"{node}.{parameter}" for node in values for parameter in values[node])


def _validated(scenario: Scenario, changed: Collection[str]) -> Scenario:
    """The scenario, once what single parameters cannot show is validated: rates, stability at the rate, lengths of lists.

    `changed`: the nodes whose parameters have not been validated together yet.
    """
    check_rates(scenario)
    check_thrusters(scenario)
    check_late_odometry(scenario)
    check_following(scenario)
    # Law and reference are constructed only for their validation.
    if "controller" in changed:
        try:
            make_law(scenario.controller)
        except InstabilityError as error:
            raise InstabilityError(f"{error}{_defaults_named_in(str(error), scenario.given)}") from None
    if "vessel_sim" in changed:
        check_hull(scenario.vessel_sim.vessel)
    if "reference_ship" in changed:
        make_reference(scenario.reference_ship, 1.0 / scenario.reference_ship.rate_hz)
    check_fence(scenario)
    return scenario


def check_fence(scenario: Scenario) -> None:
    """Check that the vessel begins inside of the controller's fence, and that the reference keeps to it."""
    fence = fence_of(scenario.controller.safety.fence, "controller.safety.fence")
    if fence is None:
        return
    begin, p = complex(*scenario.vessel_sim.initial_pose[:2]), scenario.reference_ship
    if not allowed(fence, begin):
        raise ParameterError(f"vessel_sim.initial_pose must be inside of the fence (got ({begin.real:g}, {begin.imag:g}) m)")
    check_within(fence, p, make_reference(replace(p, follow="time"), 1.0 / p.rate_hz))


def check_rates(scenario: Scenario) -> None:
    """Check that in lockstep every control period coincides with an odometry and a reference message."""
    if not scenario.controller.lockstep:
        return
    # In lockstep a control period may only begin at an instant for which both messages exist.
    law = RateGrid(scenario.controller.rate_hz)
    for node in ("vessel_sim", "reference_ship"):
        rate_hz = getattr(scenario, node).rate_hz
        if not law.divides(RateGrid(rate_hz)):
            raise ScenarioError(
                f"controller.rate_hz = {law.rate_hz:g} Hz does not fit {node}.rate_hz = {rate_hz:g} Hz:"
                " in lockstep the second must be an integer multiple of the first"
            )


def check_thrusters(scenario: Scenario) -> None:
    """Check that the allocation has the thrusters of the plant. Raises ScenarioError if it has others."""
    sim, allocation = scenario.vessel_sim, scenario.thruster_allocation
    names = sim.vessel.thrusters.names
    if sim.by_thrusters and allocation.vessel.thrusters.names != names:
        raise ScenarioError(
            f"thruster_allocation.vessel.thrusters.names = {list(allocation.vessel.thrusters.names)} are not those of vessel_sim,"
            f" {list(names)}: give vessel.thrusters once, in the section /** of all nodes"
        )


def check_late_odometry(scenario: Scenario) -> None:
    """Check that a lockstep run that rides through missing inputs has odometry of the present step."""
    sim, controller = scenario.vessel_sim, scenario.controller
    if controller.lockstep and sim.sensors.delay > 0.0 and (controller.ride_through or scenario.faults):
        raise ScenarioError(
            "vessel_sim.sensors.delay must be 0 s in lockstep with scripted faults or controller.ride_through"
            f" (got {sim.sensors.delay:g} s): set it, or run in real time"
        )


def relayed_topics(scenario: Scenario) -> tuple[str, ...]:
    """The topics that pass through the relay in a scenario."""
    demands = tuple(topic for topic, *_ in scenario.vessel_sim.vessel.thrusters.topics() if scenario.vessel_sim.by_thrusters)
    return (*TOPICS, *demands)


def check_script(script: FaultScript, scenario: Scenario) -> None:
    """Check that every fault can be carried out in a scenario."""
    check_late_odometry(replace(scenario, faults=script))
    topics, nodes = relayed_topics(scenario), taking_part(scenario.vessel_sim.by_thrusters)
    duration = scenario.vessel_sim.duration
    for index, fault in enumerate(script.faults):
        owner = f"faults[{index}]"
        check_target(fault, topics, nodes, owner)
        check_mode(fault, scenario.controller.lockstep, owner)
        if fault.field:
            check_field(message_type(fault.topic), fault.field, f"{owner}.field")
        if duration and fault.at > duration:
            raise ParameterError(f"{owner}.at must be at most {duration:g} s, the end of the run (got {fault.at:g} s)")


def check_following(scenario: Scenario) -> None:
    """Check that a reference that follows the vessel has odometry, in lockstep that of the step before."""
    sim, controller = scenario.vessel_sim, scenario.controller
    if scenario.reference_ship.follow != "vessel":
        return
    reason = ""
    if controller.odometry.form != "odometry":
        reason = f"with controller.odometry.form = odometry (got {controller.odometry.form}), which the reference reads too"
    elif controller.lockstep and sim.sensors.delay > 0.0:
        reason = f"in lockstep with vessel_sim.sensors.delay = 0 (got {sim.sensors.delay:g} s)"
    elif controller.lockstep and (sim.clock.source == "follow" or sim.clock.others):
        reason = "for a fleet in real time, as each vessel of a lockstep fleet has the clock of the first"
    if reason:
        raise ScenarioError(f"reference_ship.follow = vessel is only allowed {reason}")


def for_nodes(recorded: bool, real_time: bool, namespace: str = "") -> dict[str, object]:
    """The changes to a scenario whose nodes run as processes.

    `real_time`: run in real time whatever the scenario chooses. `namespace`: the nodes' namespace, without slashes at its ends;
    their frames are prefixed with it.
    """
    # The plant is simulated, and started with them: no person has to enable the controller in real time.
    changes: dict[str, object] = {**{f"{node}.recorded": recorded for node in NODES}, "controller.start_enabled": True}
    if namespace:
        changes |= {f"{node}.frame_prefix": f"{namespace}/" for node in NODES}
    if real_time:
        changes |= {f"{node}.lockstep": False for node in NODES}
    return changes


def make_law(parameters: ControllerParameters) -> Law[Any]:
    """Make the law that the parameters of a controller select."""
    vessel = parameters.vessel.as_controlled()
    return construct(parameters.law, getattr(parameters, parameters.law), vessel, 1.0 / parameters.rate_hz)


def make_observer(parameters: ControllerParameters) -> Observer | None:
    """Make the observer of a controller, if its parameters enable one."""
    return Observer(parameters.observer, parameters.vessel) if parameters.observer.enabled else None


def dump_scenario(scenario: Scenario) -> str:
    """Write a scenario as a ROS parameters file, with the value of every parameter."""
    return dump_parameters({node: schema.flatten(getattr(scenario, node)) for node in NODES})


def _defaults_named_in(message: str, given: Collection[str]) -> str:
    """The parameters in an error message of a law that the scenario does not set, as a further part of the message."""
    names = ["controller.law", *re.findall(r"controller[.\w]*\w", message)]
    defaults = [name for name in names if name not in given]
    return f"; {' and '.join(defaults)} {'is a default' if len(defaults) == 1 else 'are defaults'}" if defaults else ""


MAX_VESSELS = 100  # largest number of vessels; a ROS domain on one machine has room for about as many participants
SPACING = 50.0  # default distance between the starts of two neighbours, m
NAMESPACE = "vessel"  # the vessels are `vessel_1`, `vessel_2` and so on, unless a namespace is given


@dataclass(frozen=True)
class Fleet:
    """The scenarios of several vessels."""

    base: Scenario  # the scenario that they share
    # the scenario of each vessel by its namespace; in lockstep the plant of the first owns /clock
    vessels: Mapping[str, Scenario]

    @property
    def lockstep(self) -> bool:
        """Whether the vessels take their steps together, as fast as the machine allows."""
        return self.base.controller.lockstep

    def with_bag(self, directory: Path, parameters: Path) -> "Fleet":
        """The same fleet, recorded into one bag; the arguments are those of `Scenario.with_bag`."""
        base = self.base.with_bag(directory, parameters)
        names = base.recorder.topics
        own = tuple(f"{vessel}/{name}" for vessel in self.vessels for name in names if not name.startswith("/"))
        shared = tuple(name for name in names if name.startswith("/"))
        recorder = replace(base.recorder, topics=own + shared)
        vessels = {name: vessel.with_bag(directory, parameters) for name, vessel in self.vessels.items()}
        return Fleet(replace(base, recorder=recorder), vessels)


def make_fleet(base: Scenario, count: int, namespace: str = NAMESPACE, spacing: float = SPACING) -> Fleet:
    """Place vessels side by side: vessel i starts (i - 1)·spacing further in y, and its reference with it.

    Each has the scenario's seed plus i - 1, so that noise differs between the vessels. `namespace`: the vessels have the
    namespaces `<namespace>_1`, `<namespace>_2` and so on.
    """
    if not 1 <= count <= MAX_VESSELS:
        raise ParameterError(f"--vessels must be 1 to {MAX_VESSELS} (got {count})")
    names = [f"{namespace or NAMESPACE}_{number}" for number in range(1, count + 1)]
    vessels = {name: base.changed(_differences(base, name, index * spacing, index)) for index, name in enumerate(names)}
    if count > 1:
        vessels[names[0]] = vessels[names[0]].changed({"vessel_sim.clock.followers": tuple(names[1:])})
    for name in names[1:]:
        vessels[name] = vessels[name].changed({"vessel_sim.clock.source": "follow"})
    return Fleet(base, vessels)


def dump_fleet(fleet: Fleet) -> str:
    """Write a fleet as a ROS parameters file: what the vessels share in all namespaces, then what differs in those of each."""
    base = {node: schema.flatten(getattr(fleet.base, node)) for node in NODES}
    text = dump_parameters(base)
    for name, scenario in fleet.vessels.items():
        own = {node: schema.flatten(getattr(scenario, node)) for node in NODES if node != RECORDER}
        different = {node: {key: value for key, value in of.items() if value != base[node][key]} for node, of in own.items()}
        text += dump_parameters({node: values for node, values in different.items() if values}, f"/{name}")
    return text


def _differences(base: Scenario, name: str, shift: float, index: int) -> dict[str, object]:
    """What a vessel has for itself: frames, seed, and positions shifted in y [m]."""
    plant, reference = base.vessel_sim, base.reference_ship
    changes: dict[str, Any] = {f"{node}.frame_prefix": f"{name}/" for node in NODES if node != RECORDER}
    changes["vessel_sim.seed"] = plant.seed + index
    changes["vessel_sim.initial_pose"] = _shifted(plant.initial_pose, 3, shift)
    changes["reference_ship.initial_pose"] = _shifted(reference.initial_pose, 3, shift)
    if reference.path.time >= 0.0:
        changes["reference_ship.path.waypoints"] = _shifted(reference.path.waypoints, 2, shift)
    if max(reference.goal.times) >= 0.0:
        changes["reference_ship.goal.poses"] = _shifted(reference.goal.poses, 3, shift)
    if any(reference.lawnmower.rectangle):
        changes["reference_ship.lawnmower.rectangle"] = _shifted(reference.lawnmower.rectangle, 4, shift)
    if any(reference.lawnmower.polygon):
        changes["reference_ship.lawnmower.polygon"] = _shifted(reference.lawnmower.polygon, 2, shift)
    return changes


def _shifted(values: tuple[float, ...], width: int, shift: float) -> tuple[float, ...]:
    """Positions x, y, with `width` values each, shifted in y."""
    return tuple(value + shift if i % width == 1 else value for i, value in enumerate(values))
