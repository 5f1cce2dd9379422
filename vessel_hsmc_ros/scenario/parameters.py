"""The parameters of every node, each declared once for ROS, YAML files, the command line and the docs."""

from collections import UserDict
from collections.abc import Collection, Mapping
from dataclasses import dataclass, make_dataclass
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from vessel_hsmc_ros.control.interface.known_vessel import KnownVessel
from vessel_hsmc_ros.control.laws import LAWS
from vessel_hsmc_ros.control.loop.observer_model import ObserverParameters
from vessel_hsmc_ros.control.safety.parameters import FreshnessParameters, SafetyParameters, check_safety
from vessel_hsmc_ros.core import node_list, schema
from vessel_hsmc_ros.core.exceptions import ParameterError
from vessel_hsmc_ros.core.hull import NamedVessel
from vessel_hsmc_ros.core.schema import group, parameter
from vessel_hsmc_ros.core.thruster_layout import ThrusterLayout
from vessel_hsmc_ros.guidance.factory import ReferenceShipParameters
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

VESSEL = "vessel."  # prefix of the hull data, which the nodes share
VESSEL_NAME = f"{VESSEL}name"


def declared() -> dict[str, dict[str, schema.Entry]]:
    """The declarations of the nodes of a scenario, by node and dotted name."""
    return {node: schema.entries(cls) for node, cls in NODES.items()}


def vessel_names() -> list[str]:
    """The hull data that any node declares, by their dotted names."""
    every = (name for cls in (NODES | WATCHERS).values() for name in schema.entries(cls))
    return list(dict.fromkeys(name for name in every if name.startswith(VESSEL)))


def in_long_form(values: Mapping[str, object]) -> dict[str, object]:
    """The values with `vessel.name` for its short form `vessel`."""
    if "vessel" not in values:
        return dict(values)
    name = values["vessel"]
    if values.get(VESSEL_NAME, name) != name:
        raise ParameterError(f"vessel = {name} and {VESSEL_NAME} = {values[VESSEL_NAME]} differ: one of them is enough")
    return {VESSEL_NAME: name, **{key: value for key, value in values.items() if key != "vessel"}}


def without_foreign_hull_data(values: Mapping[str, object], declared: Collection[str]) -> dict[str, object]:
    """The values without hull data that only other nodes declare, so that one section `vessel` serves all nodes."""
    foreign = [name for name in values if name.startswith(VESSEL) and name not in declared]
    if foreign:
        names = vessel_names()
        for name in foreign:
            if name not in names:
                raise ParameterError(f"{name} is not a parameter of any node: {schema.suggestion(name, names)}")
    return {name: value for name, value in values.items() if name not in foreign}
