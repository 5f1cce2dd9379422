"""A scenario: one ROS parameters file for all nodes, read here without ROS and checked as a whole."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from vessel_hsmc_ros.control.observer import Observer
from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError, ScenarioError
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.timing import RateGrid
from vessel_hsmc_ros.laws import Law, make_controller
from vessel_hsmc_ros.reference.factory import make_reference
from vessel_hsmc_ros.scenario.parameters import (
    NODES,
    ControllerParameters,
    RecorderParameters,
    ReferenceParameters,
    SimParameters,
)

USE_SIM_TIME = "use_sim_time"


class _Loader(yaml.SafeLoader):
    """Reads numbers as ROS does: 1e5 is one, though YAML 1.1 wants a point and a sign."""


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"^[-+]?(\d+(\.\d*)?|\.\d+)[eE][-+]?\d+$"), list("-+.0123456789")
)


def read_yaml(text: str) -> Any:
    """A YAML text with the numbers of a ROS parameters file; raises yaml.YAMLError."""
    return yaml.load(text, Loader=_Loader)  # noqa: S506 - a safe loader


@dataclass(frozen=True)
class Scenario:
    """Everything a closed loop needs, resolved and checked."""

    name: str
    vessel_sim: SimParameters
    reference_ship: ReferenceParameters
    controller: ControllerParameters
    recorder: RecorderParameters

    def with_bag(self, directory: Path, parameters: Path) -> "Scenario":
        """The same scenario recorded into another folder, with its parameters file inside the bag."""
        recorder = replace(self.recorder, directory=str(directory), scenario_file=str(parameters), scenario=self.name)
        return replace(self, recorder=recorder)


def scenario_names() -> list[str]:
    """The scenarios that come with the package."""
    return sorted(path.stem for path in (share_directory() / "config").glob("*.yaml"))


def load_scenario(name: str | Path, changes: Mapping[str, object] | None = None) -> Scenario:
    """Read a scenario, apply changes, check everything.

    Args:
        name: A scenario of the package, `case2_tracking`, or the path of a ROS parameters file.
        changes: Values by `node.parameter`, such as {"controller.rate_hz": 50.0}.

    Raises:
        ScenarioError: the scenario is unknown, unreadable or contradicts itself.
        ParameterError: a parameter is unknown or out of range.
    """
    path = _find(name)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"scenario file {path} cannot be read: {_line(error)}") from None
    return parse_scenario(text, path.stem, changes, f"scenario file {path}")


def parse_scenario(
    text: str, name: str, changes: Mapping[str, object] | None = None, source: str = "the bag's scenario"
) -> Scenario:
    """The same from the text of a ROS parameters file.

    Args:
        text: The file's content.
        name: What the scenario is called.
        changes: Values by `node.parameter`.
        source: Where the text comes from, for error messages.

    Raises:
        ScenarioError: the text is not a parameters file, or contradicts itself.
        ParameterError: a parameter is unknown or out of range.
    """
    values = _read(text, source)
    for key, value in (changes or {}).items():
        node, _, parameter = key.partition(".")
        if node not in NODES or not parameter:
            raise ParameterError(f"{key} is not a parameter: it takes node.parameter with a node of {', '.join(NODES)}")
        values[node][parameter] = value
    parts: dict[str, Any] = {node: schema.build(cls, values[node], node) for node, cls in NODES.items()}
    scenario = Scenario(name, **parts)
    _check_rates(scenario)
    make_law(scenario.controller)
    make_reference(scenario.reference_ship, 1.0 / scenario.reference_ship.rate_hz)
    return scenario


def for_nodes(recorded: bool, real_time: bool, namespace: str = "") -> dict[str, object]:
    """The changes to a scenario whose nodes run as processes.

    Args:
        recorded: A recorder takes part.
        real_time: Run in real time whatever the scenario chooses.
        namespace: The nodes' namespace, without slashes at its ends; their frames are prefixed with it.
    """
    changes: dict[str, object] = {f"{node}.recorded": recorded for node in NODES}
    if namespace:
        changes |= {f"{node}.frame_prefix": f"{namespace}/" for node in NODES}
    if real_time:
        changes |= {f"{node}.lockstep": False for node in NODES}
    return changes


def make_law(parameters: ControllerParameters) -> Law[Any]:
    """The law a controller's parameters ask for.

    Raises:
        ParameterError: a gain is unstable at the controller's rate.
    """
    chosen = getattr(parameters, parameters.law)
    return make_controller(
        parameters.law, 1.0 / parameters.rate_hz, **schema.flatten(parameters.vessel), **schema.flatten(chosen)
    )


def make_observer(parameters: ControllerParameters) -> Observer | None:
    """The observer a controller's parameters ask for, if they do."""
    return Observer(parameters.observer, parameters.vessel) if parameters.observer.enabled else None


def dump_scenario(scenario: Scenario) -> str:
    """The whole scenario as a ROS parameters file, every parameter with its value."""
    document: dict[str, Any] = {}
    for node in NODES:
        document[f"/**/{node}"] = {"ros__parameters": tree(schema.flatten(getattr(scenario, node)))}
    return yaml.safe_dump(document, sort_keys=False)


def tree(values: Mapping[str, object]) -> dict[str, Any]:
    """Values by dotted names as a ROS parameters file nests them."""
    nested: dict[str, Any] = {}
    for name, value in values.items():
        *groups, leaf = name.split(".")
        branch = nested
        for part in groups:
            branch = branch.setdefault(part, {})
        branch[leaf] = list(value) if isinstance(value, tuple) else value
    return nested


def flat(nested: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted names and values of what a ROS parameters file nests."""
    for key, value in nested.items():
        if isinstance(value, Mapping):
            yield from flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _find(name: str | Path) -> Path:
    path = Path(name)
    if path.suffix in (".yaml", ".yml"):
        if path.is_file():
            return path
        raise ScenarioError(f"scenario file {path} does not exist")
    known = scenario_names()
    if str(name) not in known:
        raise ScenarioError(f"scenario {name} is unknown: it takes one of {', '.join(known)} or the path of a YAML file")
    return share_directory() / "config" / f"{name}.yaml"


def _read(text: str, source: str) -> dict[str, dict[str, object]]:
    """Flat parameters by node, later sections over earlier ones, as ROS reads a parameters file."""
    try:
        document = read_yaml(text)
    except yaml.YAMLError as error:
        raise ScenarioError(f"{source} cannot be read: {_line(error)}") from None
    if not isinstance(document, dict):
        raise ScenarioError(f"{source} is not a ROS parameters file: it takes node names at its top level")
    # A node that is started alone runs in real time; a scenario is in lockstep unless it chooses otherwise.
    values: dict[str, dict[str, object]] = {node: {"lockstep": True} for node in NODES}
    for section, content in document.items():
        nested = content.get("ros__parameters") if isinstance(content, dict) else None
        if not isinstance(nested, dict):
            raise ScenarioError(f"{source}: section {section} has no ros__parameters")
        given = dict(flat(nested))
        given.pop(USE_SIM_TIME, None)
        for node in _addressed(str(section), source):
            values[node].update(given)
    return values


def _line(error: Exception) -> str:
    return " ".join(str(error).split())


def _addressed(section: str, source: str) -> list[str]:
    """The nodes a section of a parameters file speaks of, in whatever namespace."""
    node = section.rsplit("/", 1)[-1]
    if node in ("*", "**"):
        return list(NODES)
    if node not in NODES:
        raise ScenarioError(f"{source}: section {section} names no node: it takes /** or one of {', '.join(NODES)}")
    return [node]


def _check_rates(scenario: Scenario) -> None:
    """In lockstep every period of the law must find an odometry and a reference of its own time."""
    if not scenario.controller.lockstep:
        return
    law = RateGrid(scenario.controller.rate_hz)
    for node in ("vessel_sim", "reference_ship"):
        rate_hz = getattr(scenario, node).rate_hz
        if not law.divides(RateGrid(rate_hz)):
            raise ScenarioError(
                f"controller.rate_hz = {law.rate_hz:g} Hz does not fit {node}.rate_hz = {rate_hz:g} Hz:"
                " in lockstep the second must be a whole multiple of the first"
            )
