"""A fleet: one scenario for several vessels, each in a namespace of its own, with starts and references side by side."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from vessel_hsmc_ros.core import schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.node_list import RECORDER
from vessel_hsmc_ros.scenario.parameters import NODES
from vessel_hsmc_ros.scenario.parameters_file import dump_parameters
from vessel_hsmc_ros.scenario.scenario import Scenario

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
