"""The interfaces of boats' stacks: the parameters and names of topics with which the nodes connect to each of them.

They stand in `config/interfaces/stacks.yaml`, of which `vessel-hsmc init` makes a parameters file, and `make docs` docs/boats.md.
"""

import shlex
from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple

import yaml

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.install_paths import share_directory
from vessel_hsmc_ros.core.node_list import PROGRAMS
from vessel_hsmc_ros.core.schema import suggestion


class Interface(NamedTuple):
    """The interface of a stack."""

    name: str  # as `init` takes it
    title: str
    # state, command: its messages, in words
    state: str
    command: str
    nodes: Mapping[str, Mapping[str, str]]  # the topics of each node under the names of the stack
    # values of each node by their dotted names, where they differ from the defaults
    parameters: Mapping[str, Mapping[str, Any]]
    # before, stop: what a person does before the first start, and to stop the boat
    before: tuple[str, ...]
    stop: tuple[str, ...]


@cache
def interfaces() -> dict[str, Interface]:
    """All interfaces by their names."""
    text = (share_directory() / "config" / "interfaces" / "stacks.yaml").read_text(encoding="utf-8")
    return {
        name: Interface(name, **{**entry, "before": tuple(entry["before"]), "stop": tuple(entry["stop"])})
        for name, entry in yaml.safe_load(text).items()
    }


def interface(name: str) -> Interface:
    """The interface of a name. Raises ParameterError if there is none."""
    known = interfaces()
    if name not in known:
        raise ParameterError(f"--interface {name} is not known: {suggestion(name, known)}")
    return known[name]


def parameters_of(stack: Interface, vessel: KnownVessel) -> dict[str, dict[str, Any]]:
    """The values of each node by their dotted names, with those of the vessel for names in braces."""

    def filled(value: Any) -> Any:
        return getattr(vessel, value.strip("{}")) if isinstance(value, str) and value.startswith("{") else value

    return {node: {name: filled(value) for name, value in values.items()} for node, values in stack.parameters.items()}


def interface_text(stack: Interface, name: str, vessel: KnownVessel, noise_known: bool = False) -> str:
    """Write the parameters file of an interface, which is given to each node after that of the ship.

    `name`: of the ship: the file is `<name>_<interface>.yaml`. `noise_known`: whether the file of the ship has the noise of its
    positions, which that of the stack then leaves as it is.
    """
    parameters = parameters_of(stack, vessel)
    if noise_known:
        parameters.get("controller", {}).pop("observer.position_noise", None)
    sections = {f"/**/{node}": {"ros__parameters": _nested(values)} for node, values in parameters.items()}
    head = [f"{stack.title}. Written by `vessel-hsmc init`; edit it at will. Start each node in a terminal of its own:", ""]
    lines = [
        *head,
        *commands(stack, name),
        "",
        "then `vessel-hsmc call enable`. docs/boats.md has the steps before, and the stop.",
    ]
    comment = "\n".join(f"# {line}".rstrip() for line in lines)
    return f"{comment}\n\n{yaml.safe_dump(sections, sort_keys=False, default_flow_style=None, width=130)}"


def commands(stack: Interface, name: str) -> list[str]:
    """The commands that start the nodes of an interface, for a ship of a name."""
    names: dict[str, Mapping[str, str]] = {}
    for node, topics in stack.nodes.items():  # in the order of their start, with the reference before the controller
        names |= {"reference_ship": {}, node: topics} if node == "controller" else {node: topics}
    files = " ".join(f"--params-file {shlex.quote(file)}" for file in (f"{name}.yaml", f"{name}_{stack.name}.yaml"))
    remaps = {node: "".join(f" -r {own}:={other}" for own, other in topics.items()) for node, topics in names.items()}
    return [f"{PROGRAMS[node].executable} --ros-args {files}{remaps[node]}" for node in names]


def _nested(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values by dotted names as nested sections."""
    found: dict[str, Any] = {}
    for name, value in values.items():
        *groups, last = name.split(".")
        section = found
        for group in groups:
            section = section.setdefault(group, {})
        section[last] = value
    return found
